"""The command line: ``teamsight reproduce``, ``teamsight delta`` and ``teamsight run``."""

from __future__ import annotations

from teamsight.cli.main import commands, main

__all__ = ["commands", "main"]
