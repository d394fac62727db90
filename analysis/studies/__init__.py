"""Studies: a model over many settings and replicates, made by any engine, interrupted and continued at will.

How data flows from a study file to a figure:

1. `study.Study` is what a researcher wants to know; `definition/` reads and checks it.
2. `plan.Plan` lists all runs of a study as columns: settings with their ids, and the seed of each run.
3. `sweep.sweep` asks the folder which runs are missing; `Sharding` divides them into shards of about a second.
4. An executor (`analysis/runs/executor.py`) makes shards: in this process, in worker processes or on a Dask cluster.
5. `shard.make_shard` makes the runs of one shard and returns Parquet files as bytes; all engines run this function.
6. `folder/` writes them as parts, and knows which runs are done, which failed and which parts are damaged.
7. `standing.py` reads the measures back and adds replicates where an interval is too wide; then it goes on with 3.
8. `results.open_study` reads the parts as one table; `figures/` draws it. `rerun.rerun` repeats a single run.
"""
