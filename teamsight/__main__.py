"""``python -m teamsight`` is ``teamsight``."""

from __future__ import annotations

from teamsight.cli import main

if __name__ == "__main__":
    main()
