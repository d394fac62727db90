"""Sensors that break the contract are named by worlds, and leave them as after the last complete step."""

from __future__ import annotations

import numpy as np
import pytest

from teamsight import CMOMMT, Sensor
from teamsight.core.kernel import kernel

BREAKS_AT = 5


@kernel
def _identities(view, parameters, sensed):
    """Copy what is in range, with identities in place of indices from some tick on."""
    entries = view.in_range.start[view.member.shape[0]]
    for i in range(view.in_range.start.shape[0]):
        sensed.start[i] = view.in_range.start[i]
    for k in range(min(entries, sensed.identity.shape[0])):
        index = view.in_range.identity[k]
        sensed.identity[k] = index + 999_999 if view.tick[0] >= parameters[0] else index
        sensed.offset[k, 0] = view.in_range.offset[k, 0]
        sensed.offset[k, 1] = view.in_range.offset[k, 1]
        sensed.distance[k] = view.in_range.distance[k]
    return entries


@kernel
def _descending(view, parameters, sensed):
    for i in range(sensed.start.shape[0]):
        sensed.start[i] = -i
    return 0


@kernel
def _endless(view, parameters, sensed):
    return 10**15


@kernel
def _nowhere(view, parameters, sensed):
    for i in range(1, sensed.start.shape[0]):
        sensed.start[i] = 1
    sensed.start[0] = 0
    sensed.identity[0] = 0
    sensed.offset[0, 0] = np.nan
    return 1


def broken(rule, first: float = 0.0) -> Sensor:
    kind = type("Broken", (Sensor,), {"sense": rule, "parameters": property(lambda self: np.array([first]))})
    return kind()


@pytest.mark.parametrize("rule", [_identities, _descending, _endless, _nowhere], ids=lambda rule: rule.__name__)
@pytest.mark.parametrize("together", [True, False], ids=["run", "step"])
def test_a_wrong_list_is_an_error(rule, together):
    model = CMOMMT(robots=20, radius=2.0, rng=1)
    model.robots.sensors["teammates"] = broken(rule)
    with pytest.raises(ValueError, match=r"sensors\['teammates'\]=.* of robots: sense has written a wrong list"):
        model.run(2) if together else model.step()
    assert model.tick == 0


@pytest.mark.parametrize("policy", ["a-cmommt", lambda percept, rng: (0.1, 0.05)], ids=["compiled", "in Python"])
@pytest.mark.filterwarnings("ignore:run\\(\\) makes its steps one by one")
def test_a_step_whose_sensing_fails_is_not_made(policy):
    """The world is as after the last complete step, and goes on with another sensor as if nothing had happened."""
    seed = int(np.random.SeedSequence().entropy % 2**32)
    fine, model = (CMOMMT(robots=20, radius=2.0, policy=policy, rng=seed) for _ in range(2))
    fine.run(BREAKS_AT - 1)
    model.sensor = broken(_identities, BREAKS_AT)
    with pytest.raises(ValueError, match=f"wrong list for tick {BREAKS_AT}"):
        model.run(20)
    assert model.tick == BREAKS_AT - 1, seed
    np.testing.assert_array_equal(model.robots.position, fine.robots.position, str(seed))
    model.sensor = Sensor()
    for world in (fine, model):
        world.run(10)
    np.testing.assert_array_equal(model.robots.position, fine.robots.position, str(seed))
    assert model.recording.history.equals(fine.recording.history), seed
