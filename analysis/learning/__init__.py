"""Learning from exploration: memories, learners by name, evaluation and learning curves."""
