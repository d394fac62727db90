"""Columns: user-defined properties, one element for each agent of a group."""
