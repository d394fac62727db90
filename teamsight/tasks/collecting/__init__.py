"""Collecting: robots that find pucks by chance, carry them home and rest there by night."""
