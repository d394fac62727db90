"""Choosing δ, the number of inputs about teammates, from simulations or recorded positions."""
