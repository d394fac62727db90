"""Columns: properties of the user's own, one element for each agent of a group."""
