"""Presets: values for what the paper leaves open, found by calibration (docs/calibration.md).

The policy options of a preset reach each policy by name that has them.
"""

from __future__ import annotations

from typing import Any

PRESETS: dict[str, dict[str, Any]] = {
    "touzet2000": {
        "robot_speed": 0.2,
        "target_speed": 0.1,
        "uniform_target_speed": False,
        "policy_options": {"idle": "stay", "idle_when": "no-force", "weights": "nearest"},
    }
}
