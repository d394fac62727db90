"""Presets: values for what the paper leaves open, chosen by calibration (docs/calibration.md).

The policy options of a preset apply to a policy given by name, if it has them.
"""

from __future__ import annotations

from typing import Any

PRESETS: dict[str, dict[str, Any]] = {
    "touzet2000": {
        "robot_speed": 0.1,
        "target_speed": 0.075,
        "uniform_target_speed": False,
        "policy_options": {"idle": "stay", "idle_when": "no-force", "weights": "nearest", "gain": 0.5},
    }
}
