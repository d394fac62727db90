"""What all tests share: the slow twins on the path, and hypothesis without a clock, since kernels compile on first use."""

from __future__ import annotations

import sys
from pathlib import Path

from hypothesis import HealthCheck, settings

sys.path.insert(0, str(Path(__file__).parent))

settings.register_profile("teamsight", deadline=None, max_examples=40, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("teamsight")
