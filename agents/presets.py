"""The presets of `CMOMMT`. Nothing is imported here, so that what is in closed form needs no world."""

from __future__ import annotations

from typing import Any

#: Values for what the paper leaves open, chosen by calibration (docs/calibration.md). The policy options of a preset
#: apply to a policy given by name, if it has them.
PRESETS: dict[str, dict[str, Any]] = {
    "touzet2000": {
        "robot_speed": 0.1,
        "target_speed": 0.075,
        "uniform_target_speed": False,
        "policy_options": {"idle": "stay", "idle_when": "no-force", "weights": "nearest", "gain": 0.5},
    }
}
