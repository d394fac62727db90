"""Episodes of many worlds: their ends, their seeds, and Gymnasium's interface."""

from __future__ import annotations

import copy
import gc
import sys
import weakref
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers.vector import (
    ClipAction,
    DictInfoToList,
    NormalizeObservation,
    NormalizeReward,
    RecordEpisodeStatistics,
)

from teamsight import CMOMMT, Failures
from teamsight.env import TeamVectorEnv, gymnasium_env, vector_env
from teamsight.env.batch import episode_seed
from teamsight.env.vector import Observations
from teamsight.tasks import TASKS

ZERO = np.zeros((2, 3, 2))


def test_same_step_returns_the_first_observations_of_the_next_episode() -> None:
    env = vector_env(2, robots=3, max_cycles=4)
    first, _ = env.reset(seed=1)
    for _ in range(3):
        made = env.step(ZERO)
        assert "final_observations" not in made.info
    last = env.step(ZERO)
    assert last.truncated.all()
    assert not last.terminated.any()
    assert not np.array_equal(last.info["final_observations"], last.observations)
    assert [env.world(place).seed_used for place in range(2)] == [episode_seed(1, 1), episode_seed(2, 1)]
    assert not np.array_equal(first, last.observations)


def test_next_step_begins_an_episode_with_rewards_of_0() -> None:
    one, other = (
        vector_env(2, robots=3, max_cycles=4, autoreset=mode, reward=lambda facts: facts.active)
        for mode in ("same-step", "next-step")
    )
    for env in (one, other):
        env.reset(seed=1)
    ahead = [one.step(ZERO) for _ in range(8)]
    behind = [other.step(ZERO) for _ in range(10)]
    assert [made.truncated.all() for made in behind] == [False] * 3 + [True] + [False] * 4 + [True, False]
    assert np.array_equal(behind[3].observations, ahead[3].info["final_observations"])
    assert np.array_equal(behind[4].observations, ahead[3].observations)
    assert [made.rewards.all() for made in behind] == [True] * 4 + [False] + [True] * 4 + [False]
    assert not behind[4].rewards.any()
    assert np.array_equal(behind[5].observations, ahead[4].observations)


def test_disabled_needs_a_reset_of_the_worlds_that_ended() -> None:
    env = vector_env(2, robots=3, max_cycles=4, autoreset="disabled")
    env.reset(seed=1)
    env.step(ZERO)
    env.reset(worlds=[1])
    for _ in range(3):
        made = env.step(ZERO)
    assert made.truncated.tolist() == [True, False]
    with pytest.raises(RuntimeError, match=r"the episode of world 0 has ended.*reset\(worlds=terminated \| truncated\)"):
        env.step(ZERO)
    env.reset(worlds=made.terminated | made.truncated)
    assert env.step(ZERO).truncated.tolist() == [False, True]


def test_seeds_are_those_of_worlds() -> None:
    env = vector_env(3, robots=4)
    env.reset(seed=5)
    for place in range(3):
        expected = CMOMMT(robots=4, policy="random-walk", seed=5 + place)
        assert np.array_equal(env.world(place).robots.position, expected.robots.position)
    env.reset(seed=[9, 9, 11])
    assert [env.world(place).seed_used for place in range(3)] == [9, 9, 11]
    env.reset(seed=3, worlds=[2])
    assert [env.world(place).seed_used for place in range(3)] == [9, 9, 5]
    other = vector_env(3, robots=4)
    other.reset(seed=[9, 9, 5])
    for one in (env, other):
        one.reset()
    assert np.array_equal(env.state(), other.state())


def test_a_new_seed_is_drawn_without_one() -> None:
    env = vector_env(2, robots=3)
    env.reset()
    assert env.world(0).seed_used != env.world(1).seed_used


@pytest.mark.parametrize("copy", [True, False])
def test_observations_are_copied_unless_asked_otherwise(copy: bool) -> None:
    env = vector_env(2, robots=3, copy=copy)
    env.reset(seed=1)
    first = env.step(ZERO).observations
    kept = first.copy()
    for _ in range(20):
        env.step(ZERO + 0.5)
    assert np.array_equal(first, kept) == copy


def test_long_episodes_make_room_for_their_history() -> None:
    env = vector_env(1, robots=2, targets=2, max_cycles=3000)
    env.reset(seed=1)
    for _ in range(2999):
        made = env.step(np.zeros((1, 2, 2)))
    assert not made.truncated.any()
    assert env.world(0).tick == 2999
    assert len(env.world(0).recording.history) == 2999


def test_many_worlds_of_pictures() -> None:
    env = vector_env(2, robots=3)
    env.reset(seed=1)
    assert env.render(1).shape == (600, 600, 3)
    assert not np.array_equal(env.render(0), env.render(1))
    assert repr(env) == "<TeamVectorEnv: 2 worlds of 3 robots>"
    env.close()


def test_gymnasium_wraps_robots_as_sub_environments() -> None:
    env = gymnasium_env(4, robots=3, max_cycles=10)
    assert env.num_envs == 12
    assert isinstance(env, gymnasium.vector.VectorEnv)
    wrapped = ClipAction(RecordEpisodeStatistics(env))
    observations, _ = wrapped.reset(seed=1)
    assert wrapped.observation_space.contains(observations)
    rng, total = np.random.default_rng(1), np.zeros(12)
    for step in range(10):
        observations, rewards, terminations, truncations, infos = wrapped.step(rng.normal(0, 2, (12, 2)))
        total += rewards
        assert truncations.all() == (step == 9)
        assert terminations.shape == rewards.shape == (12,)
    assert infos["episode"]["r"] == pytest.approx(total, abs=1e-5)
    assert infos["episode"]["l"].tolist() == [10] * 12
    wrapped.close()


def test_gymnasiums_other_wrappers_take_it() -> None:
    plain, wrapped = (gymnasium_env(2, robots=3, max_cycles=4) for _ in range(2))
    normal = NormalizeReward(DictInfoToList(NormalizeObservation(wrapped)))
    plain.reset(seed=1)
    normal.reset(seed=1)
    for _ in range(9):
        expected, (observations, rewards, *_, infos) = plain.step(np.zeros((6, 2))), normal.step(np.zeros((6, 2)))
        assert observations.shape == expected[0].shape
        assert rewards.shape == (6,)
        assert [one["sensed"] for one in infos] == expected[4]["sensed"].tolist()
    normal.close()
    normal.close()


def rolled(env: TeamVectorEnv, steps: int, seed: int) -> Iterator[Observations]:
    actions = np.random.default_rng(seed).uniform(-1.0, 1.0, (2, 3, 2))
    env.reset(seed=seed)
    for _ in range(steps):
        yield env.step(actions).observations


@pytest.mark.parametrize("kind", [{}, {"events": Failures(20, 10)}, {"threads": 2}], ids=str)
def test_environments_in_turn_and_in_threads_do_not_disturb_each_other(kind: dict[str, Any]) -> None:
    def alone(seed: int) -> list[Observations]:
        return list(rolled(vector_env(2, robots=3, max_cycles=20, **kind), 50, seed))

    expected = list(map(alone, range(3)))
    with ThreadPoolExecutor(3) as threads:
        assert np.array_equal(list(threads.map(alone, range(3))), expected)
    several = [vector_env(2, robots=3, max_cycles=20, **kind) for _ in range(3)]
    in_turn = zip(*(rolled(env, 50, seed) for seed, env in enumerate(several)), strict=True)
    assert np.array_equal(list(zip(*in_turn, strict=True)), expected)


def test_gymnasium_gets_final_observations() -> None:
    env = gymnasium_env(2, robots=3, max_cycles=2, autoreset="same-step")
    # Gymnasium 1.0 has no modes.
    modes = getattr(gymnasium.vector, "AutoresetMode", None)
    assert env.metadata.get("autoreset_mode") == (modes and modes.SAME_STEP)
    env.reset(seed=1)
    env.step(np.zeros((6, 2)))
    observations, *_, infos = env.step(np.zeros((6, 2)))
    assert infos["_final_obs"].all()
    assert infos["final_obs"][5].shape == observations[5].shape
    assert not np.array_equal(infos["final_obs"][5], observations[5])
    env.reset(options={"reset_mask": np.repeat([True, False], 3)})


def test_each_task_has_an_id() -> None:
    assert sorted(name for name in gymnasium.registry if name.startswith("teamsight/")) == sorted(
        f"teamsight/{'CMOMMT' if task == 'cmommt' else task.capitalize()}-v0" for task in TASKS
    )
    pursuit = gymnasium.make_vec("teamsight.env:teamsight/Pursuit-v0", num_envs=2, max_cycles=3)
    assert pursuit.num_envs == 2 * gymnasium_env(1, model="pursuit").num_envs
    made = gymnasium.make_vec("teamsight/CMOMMT-v0", num_envs=2, robots=3, render_mode="rgb_array")
    assert str(made) == "SharedPolicyEnv(teamsight/CMOMMT-v0, num_envs=6)"
    again, copied = gymnasium.make_vec(made.spec), copy.deepcopy(made)
    assert (again.spec, again.num_envs, again.render_mode) == (made.spec, 6, "rgb_array")
    assert (copied.spec, copied.num_envs, copied.render_mode) == (made.spec, 6, "rgb_array")
    first = gymnasium_env(2, robots=3).reset(seed=1)[0]
    assert np.array_equal(made.reset(seed=1)[0], first)
    assert made.np_random_seed == 1
    with pytest.raises(ValueError, match=r"one for each robot; use gymnasium.make_vec\(id, num_envs=WORLDS\)"):
        gymnasium.make("teamsight/CMOMMT-v0")


class Clip:
    """Stands for moviepy's clip, which writes a video."""

    frames: ClassVar[list[Any]] = []

    def __init__(self, frames: list[Any], fps: int) -> None:
        Clip.frames = frames
        assert fps == 30

    def write_videofile(self, path: str, logger: Any) -> None:
        Path(path).touch()


def test_gymnasium_records_videos(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("moviepy", "moviepy.video", "moviepy.video.io", "moviepy.video.io.ImageSequenceClip"):
        module: Any = ModuleType(name)
        module.ImageSequenceClip = Clip
        monkeypatch.setitem(sys.modules, name, module)
    record: Any = getattr(gymnasium.wrappers.vector, "RecordVideo", None)
    if record is None:
        pytest.skip("this Gymnasium records no videos of several environments")
    env = gymnasium_env(2, robots=2, max_cycles=3, render_mode="rgb_array")
    recorder = record(env, str(tmp_path / "videos"), record_first_only=True, episode_trigger=lambda number: True)
    recorder.reset(seed=1)
    first, _, third, last = env.render()
    for _ in range(4):
        recorder.step(np.zeros((4, 2)))
    assert len(Clip.frames) == 4
    assert np.array_equal(Clip.frames[0], first)
    assert np.array_equal(third, last)
    assert not np.array_equal(first, last)
    recorder.close()
    with pytest.raises(RuntimeError, match="has no render_mode; make it with render_mode='rgb_array'"):
        gymnasium_env(1).render()
    with pytest.raises(ValueError, match="render_mode='human'.*rgb_array"):
        gymnasium_env(1, render_mode="human")


def test_worlds_of_a_forgotten_environment_are_released() -> None:
    env = vector_env(2, robots=2)
    env.reset(seed=1)
    worlds = [weakref.ref(env.world(place)) for place in range(2)]
    del env
    gc.collect()
    assert [world() for world in worlds] == [None, None]
