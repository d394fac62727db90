"""The command line: one file for each command; `main` lists them."""

from __future__ import annotations

from teamsight.cli.main import commands, main

__all__ = ["commands", "main"]
