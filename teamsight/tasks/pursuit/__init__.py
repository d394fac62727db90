"""Pursuit: hunters on a grid capture prey, after Tan (1993)."""
