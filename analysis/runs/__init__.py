"""Running many worlds: root seeds, runs, the runner, executors, the checkpoint and files.

`run.Run` describes one world by value: model, parameters, seed, steps and what to measure. `simulate.run_all` makes
runs on an `executor.Executor`, each distinct run once, and returns their results in order; a `checkpoint.Checkpoint`
keeps them meanwhile. `simulate.run_rows` makes runs that come with the columns that identify them, and returns a
table; `files.check_results` and `files.write_results` write tables, pictures and pages. `experiment.Experiment`
describes runs over team sizes and radii, and `experiment.make_tables` returns their tables. Larger units of work
implement `simulate.Job`. `seeds.ROOTS` holds every root seed.

An executor calls one function with many jobs and yields their outcomes. `processes.WorkerPool` does so in this
process, or in worker processes that it replaces when they die: `processes.WorkerProcess` is one of them, and
`processes.JobQueue` holds the jobs on their way to them. `dask.DaskExecutor` does so on a Dask cluster.
`executor.attempt` makes one job.
"""
