"""The regression: against its slow twin, where the right slopes are known, under symmetries, and what it refuses."""

from __future__ import annotations

import math
import pickle
import re
import warnings
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from naive import regression as naive

from teamsight.policies import LazyRegression, check_policy
from teamsight.policies.check import sample_percept
from teamsight.policies.lazy.lazy_regression import POINTS, local_slopes, significant
from teamsight.policies.lazy.readings import KINDS
from teamsight.policies.memory import LazyMemory
from teamsight.policies.rewards import keep_reward, own_reward

pytestmark = [pytest.mark.short, pytest.mark.filterwarnings("error")]

SETTINGS = {"robot_speed": 0.2, "sensing_range": 1.0, "awareness_range": 1.0, "teammate_layout": "sectors", "degree": "ring"}
FREE, TAKEN, TEAMMATE = KINDS


def parts(seed: int, transitions: int, own: int, added: int, layout: str) -> tuple[Any, Any]:
    """Situations in which one input of three shows something, and actions."""
    rng = np.random.default_rng(seed)
    size = (transitions, own + added)
    situation = np.where(rng.random(size) < 1 / 3, rng.random(size), 1.0)
    if layout == "offsets":
        situation[:, own + 1 :: 2] = np.where(situation[:, own::2] < 1, rng.random((transitions, added // 2)), 1.0)
    action = np.stack([rng.uniform(-math.pi, math.pi, transitions), rng.random(transitions)], axis=1)
    return situation.astype(np.float32), action


def made_up(
    seed: int, transitions: int = 200, own: int = 8, added: int = 6, layout: str = "sectors", **settings: Any
) -> LazyMemory:
    situation, action = parts(seed, transitions, own, added, layout)
    lost = np.random.default_rng(seed + 1).integers(0, 3, transitions)
    facts = {"alone_lost": lost, "gained": lost > 1, "lost": lost > 0}
    return LazyMemory.of(situation, action, situation, facts, own, SETTINGS | {"teammate_layout": layout} | settings)


def percept_of(seed: int, situation: Any, ratio: float = 1.0) -> Any:
    size = len(situation)
    percept = sample_percept(size, np.random.default_rng(seed))
    return percept._replace(
        situation=np.ascontiguousarray(situation, np.float32), awareness_range=ratio * percept.sensing_range
    )


def turns(policy: LazyRegression, percept: Any) -> Any:
    """Return the chosen rotations as complex numbers; a full step is checked."""
    size = len(percept.heading)
    action, _ = policy.decide(percept, policy.start(size), np.zeros((0, size)))
    assert action.distance.tolist() == percept.speed.tolist()
    return action.heading.view(complex)[:, 0] / percept.heading.view(complex)[:, 0]


@given(
    seed=st.integers(0, 2**32 - 1), own=st.integers(1, 70), added=st.integers(1, 70),
    layout=st.sampled_from(["", "sectors", "offsets"]), ratio=st.floats(0.5, 2), significance=st.sampled_from([0, 2]),
)  # fmt: skip
def test_decides_as_the_slow_twin(
    seed: int, own: int, added: int, layout: str, ratio: float, significance: int
) -> None:
    added += added % 2
    memory = made_up(seed, 60, own, added, layout)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # in a single sector all targets may be taken
        policy = LazyRegression(memory, inputs=None if layout else own, significance=significance)
    situation, _ = parts(seed + 2, 12, own, added if layout else 0, layout)
    percept = percept_of(seed, situation, ratio)
    for i, turn in enumerate(turns(policy, percept)):
        force = naive.decide(policy.forces, [float(x) for x in percept.situation[i]], own, layout, ratio)
        if abs(force) > 1e-3 * abs(policy.learned).max():
            assert turn == pytest.approx(force / abs(force), abs=1e-3)
        elif not force:
            assert turn == pytest.approx(1)


@given(seed=st.integers(0, 2**32 - 1), layout=st.sampled_from(["sectors", "offsets"]))
def test_forces_are_the_slopes_of_the_slow_twins_readings(seed: int, layout: str) -> None:
    memory = made_up(seed, layout=layout, awareness_range=1.5)
    found = LazyRegression(memory, own_reward, significance=1.0).forces
    rewards = own_reward(memory)
    readings = naive.read(memory, memory.inputs, layout, 1.5, 0.2)
    for kind, force in found.items():
        chosen = [one for one in readings if one[0] == kind]
        distance, moved = (np.array([one[k] for one in chosen]) for k in (2, 3))
        y = np.array([rewards[one[1]] for one in chosen])
        given = None if kind == FREE else distance
        slopes = local_slopes(moved, y, np.linspace(0, 1, POINTS), 1.0, 0.5, given=given)
        expected = -significant(slopes, 0.0 if kind == FREE else 1.0)
        assert force == pytest.approx(expected, rel=1e-4, abs=1e-6)


def constructed(seed: int, free: float, taken: float, teammate: float, noise: float = 0.1) -> tuple[LazyMemory, Any]:
    """A memory in which one reading shows each kind, and the reward falls by a known slope with each distance."""
    rng = np.random.default_rng(seed)
    n, own = 3000, 8
    situation = np.ones((n, 2 * own))
    case = rng.integers(0, 3, n)
    at, distance = rng.integers(0, own, n), rng.uniform(0.3, 0.95, n)
    row = np.arange(n)
    situation[row[case < 2], at[case < 2]] = distance[case < 2]
    # A teammate at a target's very place takes it; it adds a reading of its own.
    situation[row[case > 0], own + at[case > 0]] = distance[case > 0]
    action = np.stack([rng.uniform(-math.pi, math.pi, n), rng.random(n)], axis=1)
    way = np.exp(2j * math.pi * at / own)
    moved = abs(distance * way - 0.2 * action[:, 1] * np.exp(1j * action[:, 0]))
    slope = np.array([free, taken, teammate])[case]
    reward = slope * moved + noise * rng.standard_normal(n)
    memory = LazyMemory.of(situation, action, situation, {"points": reward}, own, SETTINGS)
    return memory, lambda memory: memory.fact("points")


@pytest.mark.parametrize("seed", range(5))
def test_slopes_that_are_known_by_construction(seed: int) -> None:
    memory, points = constructed(seed, free=-2.0, taken=0.0, teammate=1.0)
    policy = LazyRegression(memory, points, ridge=0.0, significance=0)
    inner = slice(6, 19)
    # 1,000 readings of each kind, noise 0.1, and moves of which 0.08 is along the reading: the standard errors are below
    # 0.02 (free) and 0.05 (taken); tolerances are five of them.
    assert policy.forces[FREE][inner] == pytest.approx(np.full(13, 2.0), abs=0.1)
    assert abs(policy.forces[TAKEN][inner]).max() < 0.25
    # In half of the readings of teammates the reward is 0, which adds to the noise: a standard error of 0.09.
    assert policy.forces[TEAMMATE][inner].mean() == pytest.approx(-0.5, abs=0.45)


def test_robots_go_to_targets_whose_distance_costs_reward_and_leave_others() -> None:
    memory, points = constructed(1, free=-2.0, taken=1.0, teammate=0.0)
    policy = LazyRegression(memory, points)
    situation = np.ones((3, 16))
    situation[0, 2] = 0.6  # to the left, free
    situation[1, [2, 10]] = 0.6  # to the left, with a teammate at its place
    left, away, nothing = turns(policy, percept_of(1, situation))
    assert left == pytest.approx(1j)
    assert away == pytest.approx(-1j)
    assert nothing == pytest.approx(1)


def agree(found: Any, expected: Any, policy: LazyRegression, percept: Any) -> bool:
    """Whether rotations agree wherever forces do not nearly cancel."""
    for i, (one, other) in enumerate(zip(found, expected, strict=True)):
        seen = [float(x) for x in percept.situation[i]]
        force = naive.decide(policy.forces, seen, policy.memory.own, policy.layout, 1.0)
        if abs(force) > 1e-2 * abs(policy.learned).max() and abs(one - other) > 1e-3:
            return False
    return True


@given(seed=st.integers(0, 2**32 - 1), layout=st.sampled_from(["sectors", "offsets"]))
def test_mirroring_a_memory_changes_no_force_and_mirrors_decisions(seed: int, layout: str) -> None:
    own, added = 8, 6
    situation, action = parts(seed, 150, own, added, layout)
    facts = {"alone_lost": np.random.default_rng(seed).integers(0, 2, 150)}
    settings = SETTINGS | {"teammate_layout": layout}

    def mirrored(rows: Any) -> Any:
        added_rows = rows[:, own:].copy()
        if layout == "sectors":
            added_rows = added_rows[:, (-np.arange(added)) % added]
        else:
            added_rows[:, 1::2] = np.where(added_rows[:, ::2] < 1, (1 - added_rows[:, 1::2]) % 1, 1.0)
        return np.concatenate([rows[:, (-np.arange(own)) % own], added_rows], axis=1)

    one = LazyRegression(LazyMemory.of(situation, action, situation, facts, own, settings))
    other_action = action * [-1, 1]
    turned = mirrored(situation)
    other = LazyRegression(LazyMemory.of(turned, other_action, turned, facts, own, settings))
    assert one.learned == pytest.approx(other.learned, rel=1e-5, abs=1e-7)
    percept = percept_of(seed, situation[:20])
    straight = turns(one, percept)
    reflected = turns(other, percept._replace(situation=np.ascontiguousarray(mirrored(percept.situation))))
    assert agree(straight, reflected.conj(), one, percept)


@given(seed=st.integers(0, 2**32 - 1), sectors=st.integers(0, 5))
def test_rotating_a_memory_changes_no_force_and_rotates_decisions(seed: int, sectors: int) -> None:
    own = added = 6
    situation, action = parts(seed, 150, own, added, "sectors")
    facts = {"alone_lost": np.random.default_rng(seed).integers(0, 2, 150)}
    angle = 2 * math.pi * sectors / own

    def rotated(rows: Any) -> Any:
        return np.concatenate([np.roll(rows[:, :own], sectors, axis=1), np.roll(rows[:, own:], sectors, axis=1)], axis=1)

    other_action = action.copy()
    other_action[:, 0] = np.clip(np.remainder(action[:, 0] + angle + math.pi, 2 * math.pi) - math.pi, -3.14159, 3.14159)
    one = LazyRegression(LazyMemory.of(situation, action, situation, facts, own, SETTINGS))
    moved = rotated(situation)
    other = LazyRegression(LazyMemory.of(moved, other_action, moved, facts, own, SETTINGS))
    assert one.learned == pytest.approx(other.learned, rel=1e-3, abs=1e-4)
    percept = percept_of(seed, situation[:20])
    straight = turns(one, percept)
    ahead = turns(one, percept._replace(situation=np.ascontiguousarray(rotated(percept.situation))))
    assert agree(straight * np.exp(1j * angle), ahead, one, percept)


@pytest.mark.parametrize("factor", [1e-12, 3.0, 1e12])
def test_the_unit_of_the_reward_changes_no_decision(factor: float) -> None:
    memory = made_up(4)
    percept = percept_of(5, memory.situation[:50])
    one = turns(LazyRegression(memory), percept)
    other = turns(LazyRegression(memory, lambda memory: factor * keep_reward(memory)), percept)
    assert one == pytest.approx(other, abs=1e-4)
    assert abs(one - 1).max() > 0.1


def test_a_threshold_of_zero_keeps_all_slopes_and_a_high_one_free_targets_only() -> None:
    memory = made_up(3)
    every, few = (LazyRegression(memory, significance=value).forces for value in (0, 100))
    assert all(force.all() for force in every.values())
    assert (few[FREE] == every[FREE]).all()
    assert not few[TAKEN].any()
    assert not few[TEAMMATE].any()


def test_the_contract_and_the_way_to_other_processes() -> None:
    for memory in (made_up(1), made_up(1, layout="offsets"), made_up(2, own=70, added=80)):
        policy = LazyRegression(memory)
        check_policy(policy)
        copy = pickle.loads(pickle.dumps(policy))
        assert repr(copy) == repr(policy)
        percept = percept_of(2, memory.situation[:9])
        assert (turns(policy, percept) == turns(copy, percept)).all()


def test_policies_that_differ_have_different_reprs() -> None:
    memory = made_up(1)
    policies = [
        LazyRegression(memory), LazyRegression(memory, own_reward), LazyRegression(memory, inputs=8), LazyRegression(made_up(2)),
        LazyRegression(memory, bandwidth=0.5), LazyRegression(memory, ridge=0.0), LazyRegression(memory, significance=2),
        LazyRegression(memory, stride=0.1),
    ]  # fmt: skip
    assert len({repr(policy) for policy in policies}) == len(policies)


def without(name: str) -> LazyMemory:
    memory = made_up(1)
    settings = {key: value for key, value in memory.settings.items() if key != name}
    return LazyMemory(memory.table, memory.own, memory.added, memory.facts, settings)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: LazyRegression(made_up(1), lambda memory: memory.fact("team_lost")), r"fact='team_lost': unknown.*known are alone_lost, gained, lost"),
        (lambda: LazyRegression(made_up(1, degree="shared", teammate_layout="")), r"memory: the 6 inputs .*'shared', do not show where teammates are.*awareness='ring' or 'pairwise'.*inputs=8"),
        (lambda: LazyRegression(made_up(1, teammate_layout="spiral")), r"do not show where teammates are \(teammate_layout='spiral'\)"),
        (lambda: LazyRegression(made_up(1, added=5, teammate_layout="offsets")), r"the 5 inputs .*do not show where teammates are \(teammate_layout='offsets'\)"),
        (lambda: LazyRegression(without("teammate_layout")), r"settings lack teammate_layout.*explore again.*inputs=8"),
        (lambda: LazyRegression(without("robot_speed")), r"settings lack robot_speed; explore again, or add .*settings=\{'robot_speed': 0\.1\}\), or give stride"),
        (lambda: LazyRegression(made_up(1, robot_speed=[0.1, 0.2])), r"robot_speed=\[0\.1, 0\.2\] .*one speed and range, or give stride"),
        (lambda: LazyRegression(made_up(1, robot_speed=0.0)), r"robot_speed=0\.0 in its settings: must be one positive number"),
        (lambda: LazyRegression(made_up(1, sensing_range="far")), r"sensing_range='far' in its settings: must be one positive number"),
        (lambda: LazyRegression(without("awareness_range")), r"settings lack awareness_range; .*settings=\{'awareness_range': 1\.0\}\), or give inputs=8"),
        (lambda: LazyRegression(made_up(1), inputs=3), r"inputs=3: the memory has 8 components for targets"),
        (lambda: LazyRegression(made_up(1), lambda memory: 1e300 * memory.fact("lost").astype(float)), r"reward <lambda>: is up to 1e\+300, must be at most 1e\+30; give smaller rewards"),
    ],
)  # fmt: skip
def test_what_cannot_be_learned_from_is_refused_in_one_line(make: Any, message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message) as caught:
        make()
    assert "\n" not in str(caught.value)


def test_all_missing_settings_are_named_at_once_with_the_line_that_adds_them() -> None:
    memory = made_up(1)
    bare = LazyMemory(memory.table, memory.own, memory.added, memory.facts, {})
    with pytest.raises(ValueError, match="settings lack robot_speed, sensing_range, awareness_range, teammate_layout") as caught:
        LazyRegression(bare)
    added = eval(re.search(r"settings=(\{.*?\})\)", str(caught.value))[1])  # type: ignore[index]
    assert LazyRegression(LazyMemory(memory.table, memory.own, memory.added, memory.facts, added)).inputs == 14
    with pytest.raises(ValueError, match=r"lack robot_speed, sensing_range; .*or give stride"):
        LazyRegression(bare, inputs=8)
    with pytest.raises(ValueError, match=r"lack robot_speed; merge explorations that agree in them, or give stride"):
        LazyRegression(made_up(1).merge(made_up(2, robot_speed=0.3)))


def test_a_bandwidth_within_which_nothing_is_found_is_named() -> None:
    with pytest.warns(UserWarning, match=r"200 transitions are too few for a slope within bandwidth=1e-300; give a larger"):
        LazyRegression(made_up(1), bandwidth=1e-300)


def test_speed_and_ranges_are_needed_only_where_they_are_used() -> None:
    assert LazyRegression(without("robot_speed"), stride=0.2).learned == pytest.approx(LazyRegression(made_up(1)).learned)
    assert LazyRegression(without("awareness_range"), inputs=8).inputs == 8
    assert LazyRegression(without("teammate_layout"), inputs=8).inputs == 8


@pytest.mark.parametrize(
    ("memory", "reward", "message"),
    [
        (made_up(1), lambda memory: np.full(len(memory), 0.1), r"robots will go straight on, since <lambda> is 0\.1 for all 200 transitions; .*another reward"),
        (made_up(1, transitions=1), keep_reward, r"since keep_reward is (0|-1|-2) for all 1 transitions; explore longer"),
        (LazyMemory.of([[1.0], [1.0]], [[0.0, 1.0], [1.0, 1.0]], [[1.0], [1.0]], {"alone_lost": [0, 1]}, 1, SETTINGS), keep_reward, r"robots will go straight on, since 2 transitions are too few for a slope; explore longer"),
    ],
)  # fmt: skip
def test_without_a_slope_one_line_says_so_and_robots_go_straight_on(memory: LazyMemory, reward: Any, message: str) -> None:
    with pytest.warns(UserWarning, match=message) as caught:
        policy = LazyRegression(memory, reward)
    assert len(caught) == 1
    assert caught[0].filename == __file__
    assert "\n" not in str(caught[0].message)
    percept = percept_of(1, parts(1, 9, memory.own, memory.added, "sectors")[0])
    assert turns(policy, percept) == pytest.approx(np.ones(9))
