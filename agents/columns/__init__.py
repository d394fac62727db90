"""Columns: properties of the user's own that the agents of a group have."""
