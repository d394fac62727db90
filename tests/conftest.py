"""What all tests share: the slow twins on the path, and hypothesis without a clock, since kernels compile on first use.

Kernels compile in silence: which test is the first to need one, and on an empty cache prints that, is up to the order.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from teamsight.core.kernel import entry as kernel_entry

sys.path.insert(0, str(Path(__file__).parent))

settings.register_profile("teamsight", deadline=None, max_examples=40, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("teamsight")


@pytest.fixture(autouse=True)
def _silent_compilation(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernel_entry, "announce", lambda name: None)
