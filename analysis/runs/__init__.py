"""Running many worlds: seeds, experiments, the runner, worker processes, checkpoints and files."""
