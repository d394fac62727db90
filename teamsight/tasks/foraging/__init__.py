"""Forage, consume and graze, after Balch and Arkin (1994): worlds, what happens in them, and the tasks."""
