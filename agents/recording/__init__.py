"""What is kept of a run: history, trajectories, transitions."""
