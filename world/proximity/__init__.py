"""The neighbour search: which bodies are within range of which."""
