"""Presets: settings of what the paper leaves open, found by calibration (docs/calibration.md)."""

from __future__ import annotations

from typing import Any

PRESETS: dict[str, dict[str, Any]] = {"touzet2000": {}}
