"""Tan's pursuit: his tables and figures beside ours, and what awareness of a partner is worth while a team learns."""
