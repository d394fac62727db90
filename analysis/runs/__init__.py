"""Running many worlds: root seeds, runs, the runner, the worker pool, the checkpoint and files.

`run.Run` describes one world by value: model, parameters, seed, steps and what to measure. `simulate.run_all` makes
runs on a `workers.WorkerPool`, each distinct run once, and returns their results in order; a `checkpoint.Checkpoint`
keeps them meanwhile. `experiment.Experiment` describes runs over team sizes and radii, and `experiment.make_tables`
returns their tables. Larger units of work implement `simulate.Job`. `seeds.ROOTS` holds every root seed.
"""
