"""Searches over the constants that the paper leaves open."""
