"""Kernels as plain Python, in which the checks of components look for wrong indices, compute what machine code does."""

from __future__ import annotations

from operator import attrgetter
from typing import Any

import numpy as np
import pytest

from teamsight import Sensor, check_awareness, check_policy, check_sensor
from teamsight.agents.awareness.registry import AWARENESS
from teamsight.core.kernel import guard
from teamsight.policies.registry import POLICIES, policy_named

# A memory has to be given to the others.
_ALONE = [name for name in POLICIES if not name.startswith("lazy")]


@pytest.fixture
def compared(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Compares both in each run of a guard; holds how many arrays were."""
    run, number = guard.Guard.run, [0]

    def both(self: Any, owner: str, kernel: str, entry: Any, value: Any, noise: Any = guard._ALL) -> Any:
        given = self._checked(value, noise)
        with np.errstate(all="ignore"):
            guard._as_python(entry.function)(given)
        done = run(self, owner, kernel, entry, value, noise)
        for path in self._record.leaves:
            if path.startswith(self._writable):
                one, other = np.asarray(attrgetter(path)(given)), attrgetter(path)(done[1])
                assert one.tobytes() == np.asarray(other).tobytes() or np.allclose(one, other, 1e-12, 1e-15, equal_nan=True), path
                number[0] += 1
        return done

    monkeypatch.setattr(guard.Guard, "run", both)
    # Not as far as the accesses of a check reach, but to the end.
    monkeypatch.setattr(guard, "_MOST_ACCESSES", 10**12)
    return number


@pytest.mark.parametrize("name", _ALONE)
def test_a_policy_decides_the_same(name: str, compared: list[int]) -> None:
    check_policy(policy_named(name), steps=2)
    assert compared[0] > 3


@pytest.mark.parametrize("name", list(AWARENESS))
def test_a_degree_of_awareness_shows_the_same(name: str, compared: list[int]) -> None:
    check_awareness(AWARENESS[name]())
    assert compared[0] > 3


def test_a_sensor_senses_the_same(compared: list[int]) -> None:
    check_sensor(Sensor(field_of_view=2.0, missed=0.1, range_noise=0.1, bearing_noise=0.1, false_positives=0.2))
    assert compared[0] > 3
