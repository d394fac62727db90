"""Policies designed by hand: those of the paper, and targets that avoid robots."""
