"""Policies designed by hand: the paper's three, and targets that avoid robots."""
