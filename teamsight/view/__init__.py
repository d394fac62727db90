"""Frames of a run, how they are packed, and the page that plays them."""
