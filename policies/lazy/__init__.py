"""Lazy learners: they keep the transitions of a memory, and compute action values when they decide."""
