"""The engine of a world: records for the kernels, the compiled loop, and decisions in Python."""
