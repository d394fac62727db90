"""Many worlds whose states are rows of one block of memory give the same bits as worlds with arrays of their own."""

from __future__ import annotations

import gc
import os
import pickle
import signal
import warnings
import weakref
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT, Cycle, DifferentialDrive, Failures, Lidar, Sensor
from teamsight.agents.awareness import RelayedAwareness
from teamsight.core.kernel import kernel
from teamsight.env import TeamVectorEnv, parallel_env, vector_env
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.interface import PolicyState
from teamsight.world import search
from tests.env.test_same_bits import assert_same_world, collected

GAINS = {"gain": 1.0, "team-gain": 0.5, "alone-gain": 0.25}
KINDS: list[dict[str, Any]] = [
    {"target_policy": "evasive"},
    {"cycle": Cycle(4, jitter=1.5, delay=3), "uniform_target_speed": True, "observation": "shared"},
    {"sensor": Sensor(range_noise=0.2, missed=0.1, false_positives=0.3), "observation": "pairwise", "reward": GAINS},
    {"sensor": Sensor(occluded="bodies"), "robot_radius": 0.6, "target_radius": 0.4},
    {"drive": DifferentialDrive(0.1, 0.02), "observation": "pairwise"},
    {"lidar": Lidar(8, 2.0, 3.0, range_noise=0.1), "robot_radius": 0.3},
    {"observation": "relayed"},
]
# Worlds of their own.
ALONE: list[dict[str, Any]] = [{"observation": RelayedAwareness(2, delay=1, loss=0.2)}]


def still(percept: Any, rng: np.random.Generator) -> tuple[float, float]:
    return 0.0, 0.0


@kernel
def wait(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    for i in range(percept.heading.shape[0]):
        action.heading[i, 0] = 0.0
        action.heading[i, 1] = 0.0
        action.distance[i] = 0.0 if arrays.state.ints[i, 0, 0] % 3 else percept.speed[i]
        arrays.state.ints[i, 0, 0] += 1


@dataclass(frozen=True)
class Waits(CompiledPolicy):
    """A component of the user's own: its targets move at every third step."""

    kernel = wait

    def start(self, size: int) -> PolicyState:
        return PolicyState(np.zeros((size, 0, 0)), np.zeros((size, 1, 1), np.int64))


class Alone:
    """Worlds that are made and stepped one by one, as a `TeamVectorEnv` with autoreset "same-step" does."""

    def __init__(self, worlds: int, lengths: list[int], **settings: Any) -> None:
        self.worlds = [parallel_env(max_cycles=1_000_000, **settings) for _ in range(worlds)]
        self._lengths, self._left = lengths, [0] * worlds

    def reset(self, seed: int, first: list[int]) -> np.ndarray:
        self._left = list(first)
        return np.array([[*env.reset(seed=seed + w)[0].values()] for w, env in enumerate(self.worlds)])

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, ...]:
        made = []
        for w, env in enumerate(self.worlds):
            shown, rewards, *_ = env.step(dict(zip(env.agents, actions[w], strict=True)))
            self._left[w] -= 1
            final = [*shown.values()]
            if has_ended := self._left[w] == 0:
                shown, self._left[w] = env.reset()[0], self._lengths[w]
            made.append(([*shown.values()], [*rewards.values()], has_ended, final))
        return tuple(map(np.array, zip(*made, strict=True)))


def assert_same_steps(env: TeamVectorEnv, alone: Alone, steps: int, seed: int = 1) -> None:
    rng = np.random.default_rng(seed)
    for _ in range(steps):
        actions = rng.uniform(-1, 1, (env.worlds, env.robots, 2))
        made, (observations, rewards, has_ended, final) = env.step(actions), alone.step(actions)
        assert np.array_equal(made.observations, observations)
        assert np.array_equal(made.rewards, rewards)
        assert np.array_equal(made.truncated, has_ended)
        if has_ended.any():
            assert np.array_equal(made.info["final_observations"], final)


def is_in_block(env: TeamVectorEnv, world: int) -> bool:
    return env._batch._block is not None and world not in env._batch._own


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("kind", [*KINDS, *ALONE, {"target_policy": Waits()}], ids=lambda kind: ",".join(kind))
def test_episodes_that_end_at_different_steps(kind: dict[str, Any], threads: int) -> None:
    env = vector_env(5, robots=4, targets=6, max_cycles=12, stagger=True, threads=threads, **kind)
    alone = Alone(5, [12] * 5, robots=4, targets=6, **kind)
    assert np.array_equal(env.reset(seed=3)[0], alone.reset(3, [3, 5, 8, 10, 12]))
    # The user's own components may do in a constructor what a reset does not repeat.
    assert all(is_in_block(env, world) == (kind in KINDS) for world in range(5))
    assert_same_steps(env, alone, 30)
    assert np.array_equal(env.reset(seed=9)[0], alone.reset(9, [3, 5, 8, 10, 12]))
    assert_same_steps(env, alone, 15)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: ",".join(kind))
def test_a_world_in_the_middle_of_an_episode(kind: dict[str, Any]) -> None:
    env = vector_env(3, robots=4, targets=6, max_cycles=20, **kind)
    alone = Alone(3, [20] * 3, robots=4, targets=6, **kind)
    env.reset(seed=3)
    alone.reset(3, [20] * 3)
    assert_same_steps(env, alone, 27)
    for world in (0, 2):
        mine, other = env.world(world), alone.worlds[world].world
        assert mine.seed_used == other.seed_used
        assert mine.steps == mine.tick == 7
        assert mine.observed == other.observed
        assert_same_world(mine, other)
        assert np.array_equal(mine.groups[0].action.heading, other.groups[0].action.heading)
        assert collected(mine).equals(collected(other))
    assert [is_in_block(env, world) for world in range(3)] == [False, True, False]
    # Its steps are made in Python now, and the user may change it.
    for one in (env.world(2), alone.worlds[2].world):
        one.groups[0][1].active = False
    assert_same_steps(env, alone, 5, seed=2)
    assert collected(env.world(2)).equals(collected(alone.worlds[2].world))
    assert_same_steps(env, alone, 30, seed=3)
    assert all(is_in_block(env, world) for world in range(3)), "the next episode is a row again"


def test_a_world_before_its_first_step() -> None:
    env = vector_env(2, robots=3)
    env.reset(seed=[5, 8])
    model = CMOMMT(robots=3, policy="random-walk", seed=8)
    assert collected(env.world(1)).equals(collected(model))
    assert np.array_equal(env.world(1).robots.position, model.robots.position)


def test_states_and_pictures() -> None:
    env = vector_env(3, robots=4, targets=6)
    alone = Alone(3, [600] * 3, robots=4, targets=6)
    env.reset(seed=3)
    alone.reset(3, [600] * 3)
    shown = [parallel_env(robots=4, targets=6, render_mode="rgb_array") for _ in range(3)]
    for world, other in enumerate(shown):
        other.reset(seed=3 + world)
    for seed in range(3):
        assert_same_steps(env, alone, 4, seed)
        actions = np.random.default_rng(seed).uniform(-1, 1, (4, 3, 4, 2))
        for one in actions:
            for world, other in enumerate(shown):
                other.step(dict(zip(other.agents, one[world], strict=True)))
        assert np.array_equal(env.state().reshape(3, -1), [other.state() for other in shown])
        for world, other in enumerate(shown):
            assert np.array_equal(env.render(world), other.render())


def test_a_reward_that_fails_in_the_middle() -> None:
    fails = False

    def reward(facts: Any) -> Any:
        if fails:
            raise ZeroDivisionError
        return facts.sensed

    env, alone = vector_env(3, robots=4, max_cycles=20, reward=reward), Alone(3, [20] * 3, robots=4, reward=reward)
    env.reset(seed=1)
    alone.reset(1, [20] * 3)
    assert_same_steps(env, alone, 6)
    actions, fails = np.full((3, 4, 2), 0.5), True
    with pytest.raises(ZeroDivisionError):
        env.step(actions)
    fails = False
    alone.step(actions)
    assert_same_steps(env, alone, 20, seed=2)


def test_a_wrong_action_changes_nothing_for_any_thread() -> None:
    env, alone = vector_env(4, robots=3, threads=2), Alone(4, [600] * 4, robots=3)
    env.reset(seed=1)
    alone.reset(1, [600] * 4)
    wrong = np.zeros((4, 3, 2))
    wrong[3, 1, 0] = 1.5
    with pytest.raises(ValueError, match=r"actions\[3, 1\]=\[1.5, 0.0\]"):
        env.step(wrong)
    assert_same_steps(env, alone, 5)


def test_where_percepts_grow_sensors_have_the_noise_of_their_tick() -> None:
    kind: dict[str, Any] = {
        "observation": "shared", "layout": "nearest", "targets": 60, "radius": 2.0, "reward": "sensed",
        "sensor": Sensor(range_noise=0.2, missed=0.2),
    }  # fmt: skip
    for seed in range(12):
        env, alone = vector_env(2, max_cycles=4, **kind), Alone(2, [4] * 2, **kind)
        env.reset(seed=seed)
        alone.reset(seed, [4] * 2)
        assert_same_steps(env, alone, 6)


@pytest.mark.parametrize("threads", [1, 2])
def test_buffers_grow_in_the_middle(threads: int, monkeypatch: pytest.MonkeyPatch) -> None:
    kind: dict[str, Any] = {"robots": 12, "targets": 15, "observation": "shared", "target_policy": "evasive"}
    alone = Alone(4, [20] * 4, **kind)
    alone.reset(1, [5, 10, 15, 20])
    # With room for one neighbour at first, so that starts and steps of most worlds stop for more.
    monkeypatch.setattr(search, "first_room", lambda observers, observed: 1)
    env = vector_env(4, max_cycles=20, stagger=True, threads=threads, **kind)
    words = [one._live.words for one in env._batch._block.built]  # type: ignore[union-attr]
    env.reset(seed=1)
    assert_same_steps(env, alone, 60)
    built = env._batch._block.built  # type: ignore[union-attr]
    assert all(one._live.words > before for one, before in zip(built, words, strict=True))
    for world in range(4):
        assert_same_world(env.world(world), alone.worlds[world].world)
        assert collected(env.world(world)).equals(collected(alone.worlds[world].world))


@pytest.mark.parametrize("robots", [2, 260])
def test_long_histories_and_those_of_many_bodies(robots: int) -> None:
    steps = 1200 if robots == 2 else 3
    kind: dict[str, Any] = {"robots": robots, "targets": 2, "radius": 3.0, "awareness_range": 6.0}
    env, alone = vector_env(2, max_cycles=2_000, **kind), parallel_env(max_cycles=2_000, **kind)
    env.reset(seed=1)
    alone.reset(seed=2)
    still = np.zeros((2, robots, 2))
    for _ in range(steps):
        env.step(still)
        alone.step(dict(zip(alone.agents, still[1], strict=True)))
    assert env.world(1).recording.history.equals(alone.world.recording.history)
    # More edges than 16 bits hold, for many.
    assert (env.world(1).recording.history.mean_neighbours == robots - 1).all()


def test_after_an_error_the_worlds_can_be_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    from teamsight.env import batch

    env, still = vector_env(3, robots=2), np.zeros((3, 2, 2))
    env.reset(seed=1)
    step_all = batch.STEP_ALL

    def interrupted(record: Any) -> int:
        step_all(record)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(batch, "STEP_ALL", interrupted)
        with pytest.raises(KeyboardInterrupt):
            env.step(still)
    assert env.world(1).tick == len(env.world(1).recording.history) == 1
    env.reset(seed=1)
    env.step(still)
    assert env.world(1).tick == 1


def test_after_close_it_takes_a_reset() -> None:
    env = vector_env(2, robots=3, threads=2)
    first = env.reset(seed=1)[0]
    env.close()
    with pytest.raises(RuntimeError, match=r"has not begun an episode; call reset\(\) first"):
        env.step(np.zeros((2, 3, 2)))
    with pytest.raises(RuntimeError, match="no episode has begun"):
        env.world(0)
    assert np.array_equal(env.reset(seed=1)[0], first)
    env.step(np.zeros((2, 3, 2)))
    assert env.world(0).running


def test_worlds_of_earlier_episodes_are_released() -> None:
    env = vector_env(2, robots=3, max_cycles=3)
    env.reset(seed=1)
    worlds = []
    for _ in range(12):
        worlds.append(weakref.ref(env.world(1)))
        env.step(np.zeros((2, 3, 2)))
    gc.collect()
    assert sum(world() is not None for world in worlds) == 0, "the last episode has just ended"
    assert env.world(1).tick == 0


def test_an_environment_with_threads_goes_on_in_a_process_that_is_forked() -> None:
    if not hasattr(os, "fork"):
        pytest.skip("this system cannot fork")
    env, actions = vector_env(2, robots=3, threads=2), np.full((2, 3, 2), 0.5)
    env.reset(seed=1)
    env.step(actions)
    reading, writing = os.pipe()
    with warnings.catch_warnings():
        # Python 3.12 warns of what this is to test.
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if not child:
        # Ends it, should it wait for ever.
        signal.alarm(60)
        os.write(writing, env.step(actions).observations.tobytes())
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading, "rb") as file:
        found = file.read()
    assert os.waitpid(child, 0)[1] == 0
    assert found == env.step(actions).observations.tobytes()


def test_what_needs_python_has_worlds_of_its_own() -> None:
    kinds: list[dict[str, Any]] = [
        {"sensor": Sensor(delay=2)}, {"events": Failures(20, 10)}, {"model": "pursuit"}, {"target_policy": still},
        {"target_policy": Waits(), "robots": 3},
    ]  # fmt: skip
    for kind in kinds:
        assert vector_env(2, **kind)._batch._block is None
    assert vector_env(1, robots=3)._batch._block is None


def test_threads_step_worlds_that_need_python_too() -> None:
    def rolled(threads: int) -> list[np.ndarray]:
        env = vector_env(3, robots=3, max_cycles=15, threads=threads, events=Failures(10, 5))
        return [env.reset(seed=1)[0], *(env.step(np.full((3, 3, 2), 0.3)).observations for _ in range(40))]

    assert np.array_equal(rolled(1), rolled(3))


def test_more_threads_than_worlds_are_refused() -> None:
    with pytest.raises(ValueError, match=r"threads=3: must be .*2"):
        vector_env(2, threads=3)


def test_copies_keep_threads_and_staggered_ends() -> None:
    env = pickle.loads(pickle.dumps(vector_env(4, robots=2, max_cycles=8, threads=2, stagger=True)))
    assert len(env._batch._parts) == 2
    env.reset(seed=1)
    ends = [env.step(np.zeros((4, 2, 2))).truncated.tolist() for _ in range(8)]
    assert [end.index(True) for end in ends if any(end)] == [0, 1, 2, 3]
