"""The command line: commands and their options; `main` lists them."""

from __future__ import annotations

from teamsight.cli.main import commands, main

__all__ = ["commands", "main"]
