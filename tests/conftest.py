"""What all tests share: the slow twins on the path, and hypothesis without a clock, since kernels compile on first use.

Kernels compile in silence: which test is the first to need one, and on an empty cache prints that, is up to the order.
The same commit gives the same result: hypothesis draws the same examples each time, and a world without a seed gets one
from the name of its test. ``pytest --explore`` draws both anew, to look for what fails only now and then.
"""

from __future__ import annotations

import random
import secrets
import signal
import sys
from pathlib import Path

import numpy.random.bit_generator
import pytest
from hypothesis import HealthCheck, settings

from teamsight.analysis.runs import simulate
from teamsight.core.kernel import cache as kernel_cache
from teamsight.core.kernel import entry as kernel_entry
from teamsight.core.kernel import guard

sys.path.insert(0, str(Path(__file__).parent))

import chance

# The same examples each time prove no more the next time; new ones do.
for name, repeats, examples in (("repeat", True, 20), ("explore", False, 100)):
    settings.register_profile(
        name, deadline=None, max_examples=examples, suppress_health_check=[HealthCheck.too_slow], derandomize=repeats
    )  # fmt: skip


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--explore", action="store_true", help="new random worlds and examples in every run")


def pytest_configure(config: pytest.Config) -> None:
    # A run in the background of a shell ignores Ctrl-C, and so would the programs that tests interrupt.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    settings.load_profile("explore" if config.getoption("--explore") else "repeat")


@pytest.fixture(autouse=True)
def _seeds_of_worlds_without_one(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    if not request.config.getoption("--explore"):
        # Where worlds and NumPy's generators take the entropy of a seed that is not given.
        entropy = random.Random(request.node.nodeid).getrandbits
        monkeypatch.setattr(secrets, "randbits", entropy)
        monkeypatch.setattr(numpy.random.bit_generator, "randbits", entropy)
        monkeypatch.setattr(chance, "draw", random.Random(f"chance {request.node.nodeid}").getrandbits)


@pytest.fixture(autouse=True)
def _silent_compilation(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernel_entry, "announce", lambda name: None)
    # Two processes of the tests may need one kernel at once, on an empty cache.
    monkeypatch.setattr(kernel_cache, "_say_waiting", lambda: None)
    # So do those of whole analyses, which announce it themselves, once a process.
    monkeypatch.setattr(simulate, "_announced", True)


@pytest.fixture(autouse=True)
def _short_trials(monkeypatch: pytest.MonkeyPatch) -> None:
    # Checks interpret a fifth of what they do for users: what ships has many checks, and what tests plant is found soon.
    monkeypatch.setattr(guard, "_MOST_ACCESSES", 200_000)
