"""Mistakes of a first model: the error names the cure."""

from __future__ import annotations

import sys
from typing import Any

import pytest

from teamsight import CMOMMT, Body, Box, Circle, Disc, Robot, Sensor, World, check_sensor, run_many
from teamsight.agents import portrayal
from teamsight.analysis.delta import choose_delta
from teamsight.core.kernel import kernel
from teamsight.policies import RandomWalk
from teamsight.policies.compiled import CompiledPolicy


@kernel
def _read(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    for i in range(percept.heading.shape[0]):
        action.distance[i] = percept.channels.beacons.start[i]


def _watching(policy: Any) -> World:
    world = World(Box(4, 3), rng=1)
    robots = world.add(Robot, 3, policy=policy)
    beacons = world.add(Body, 3, policy="stationary", name="beacons")
    world.senses(robots, beacons, as_="beacon")
    return world


@pytest.mark.parametrize(
    ("declared", "message"),
    [
        ((), r"test_first_mistakes\.py:\d+: the policy declares no channels; declare channels = \(\"beacons\",\)"),
        (("beacon",), r"declares the channels beacon, but not 'beacons'; did you mean 'beacon'\?; otherwise add"),
    ],
)
def test_a_kernel_that_reads_an_undeclared_channel(declared: tuple[str, ...], message: str) -> None:
    policy = type("Watch", (CompiledPolicy,), {"kernel": _read, "channels": declared, "parameters": ()})
    with pytest.raises(TypeError, match=message):
        _watching(policy()).run(1)


def test_a_python_policy_that_reads_an_undeclared_channel() -> None:
    with pytest.raises(
        AttributeError,
        match=r"no such channel; it has beacon; declare it by world\.senses\(group, others, as_='beacons'",
    ):
        _watching(lambda percept, rng: (0.0, len(percept.channels.beacons.distance))).step()


class _Late(World):
    """Uses the world before it is made."""

    def __init__(self, rng: int | None = None) -> None:
        self.add(Robot, 3, policy=RandomWalk())
        super().__init__(Disc(2.0), rng=rng)


class _Misspelt(World):
    """A property that has a mistake of its own."""

    @property
    def mean(self) -> float:
        """Return nothing."""
        return float(self.observed_fractoin)  # type: ignore[attr-defined]


def test_a_world_that_is_used_before_it_is_made() -> None:
    with pytest.raises(
        AttributeError, match=r"_Late\.__init__ uses '_host' .*call super\(\)\.__init__\(arena, rng=rng\)"
    ):
        _Late()
    world = _Misspelt(Disc(2.0), rng=1)
    with pytest.raises(AttributeError, match="'_Misspelt' object has no attribute 'observed_fractoin'"):
        _ = world.mean
    assert not hasattr(world, "absent")


@kernel
def _far_index(view: Any, parameters: Any, sensed: Any) -> int:
    size = view.heading.shape[0]
    if size > sensed.distance.shape[0]:
        return int(size)
    for i in range(size):
        sensed.start[i] = i
        sensed.identity[i] = 999_999
        sensed.offset[i, 0] = sensed.distance[i] = 0.1
        sensed.offset[i, 1] = 0.0
    sensed.start[size] = size
    return int(size)


def _plain(view: Any, parameters: Any, sensed: Any) -> int:
    return 0


def test_sensors_of_ones_own() -> None:
    with pytest.raises(ValueError, match=r"the index 999999, but there are \d+ observed agents"):
        check_sensor(type("Far", (Sensor,), {"sense": _far_index})())
    with pytest.raises(
        TypeError, match=r"test_first_mistakes\.py:\d+: the kernel is a plain function; decorate it with @kernel"
    ):
        check_sensor(type("Plain", (Sensor,), {"sense": _plain})())


class _Unseeded(World):
    """Takes no seed."""

    def __init__(self, robots: int = 5) -> None:
        super().__init__(Disc(2.0))
        self.add(Robot, robots, policy=RandomWalk())


def test_models_that_take_no_seed() -> None:
    with pytest.raises(
        TypeError, match=r"model=_Unseeded: takes no seed: .*robots=5 is another parameter; add rng=None"
    ):
        choose_delta(_Unseeded, runs=2, steps=2, rng=1)
    with pytest.raises(TypeError, match=r"model=.*_Unseeded.*: takes no rng; add rng=None"):
        run_many({"robots": 3}, model=_Unseeded, steps=2)


def test_what_is_not_a_group_or_a_shape() -> None:
    world = _watching(RandomWalk())
    robots, beacons = world.groups
    for wrong in ([robots], robots[0]):
        with pytest.raises(TypeError, match="give a group, not a list or an agent"):
            world.senses(wrong, beacons)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"unpack it: with_obstacles\(\*shapes\)"):
        Box(4, 3).with_obstacles([Circle((1, 1), 0.2)])  # type: ignore[arg-type]


def test_a_portrayal_without_mesas_visualisation(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mesa.visualization.components", None)
    with pytest.raises(ImportError, match=r"pip install 'teamsight\[viz\]'"):
        portrayal(_watching(RandomWalk()).groups[0][0])


def test_a_misspelt_argument_of_a_world_is_answered_with_the_nearest() -> None:
    with pytest.raises(TypeError, match=r"robot=3: unknown; did you mean 'robots'\? CMOMMT takes robots, targets"):
        CMOMMT(robot=3)  # type: ignore[call-arg]
