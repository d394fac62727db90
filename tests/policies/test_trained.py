"""The policy of a trained network: its slow twin, its files, and what an environment makes of the same numbers."""

from __future__ import annotations

import contextlib
import pickle
import zipfile
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from chance import generator

from teamsight import CMOMMT, Robot, Target, World
from teamsight.env import vector_env
from teamsight.policies import Trained, check_policy
from teamsight.policies.interface import Policy, PolicyState
from teamsight.world.arena import Disc


def written(path: Path, sizes: tuple[int, ...] = (32, 9, 7, 2), degree: str = "ring", **change: Any) -> str:
    """Write a network of random weights, and return its path."""
    rng = generator()
    content: dict[str, Any] = {"degree": degree}
    for k, (inputs, outputs) in enumerate(pairwise(sizes)):
        content[f"weight_{k}"] = rng.normal(0, inputs**-0.5, (outputs, inputs)).astype(np.float32)
        content[f"bias_{k}"] = rng.normal(0, 0.3, outputs).astype(np.float32)
    np.savez(path, **{name: value for name, value in (content | change).items() if value is not None})
    return str(path)


def way(policy: Trained, found: Any) -> Any:
    """The slow twin: the forward pass in NumPy, shape (robots, 2)."""
    for k, (weight, bias) in enumerate(policy.layers):
        found = found @ weight.T.astype(float) + bias
        if k < len(policy.layers) - 1:
            found = np.maximum(found, 0.0)
    return found


class Watched(Policy):
    """Decides as the compiled policy, and compares with the slow twin."""

    inputs, degree = 32, "ring"

    def __init__(self, policy: Trained) -> None:
        self.policy = policy
        self.decisions = 0

    def decide(self, percept: Any, state: Any, noise: Any) -> Any:
        nothing = PolicyState(np.zeros((len(percept.heading), 0, 0)), np.zeros((len(percept.heading), 0, 0), np.int64))
        action, _ = self.policy.decide(percept, nothing, np.zeros((0, len(percept.heading))))
        distance = percept.situation.astype(float)
        ahead, left = way(self.policy, distance if self.policy.encoding == "distance" else 1.0 - distance).T
        x, y = percept.heading.T
        wanted = np.stack([ahead * x - left * y, ahead * y + left * x], axis=-1)
        length = np.hypot(*wanted.T)
        assert action.heading == pytest.approx(wanted / length[:, None], abs=1e-9)
        assert action.distance == pytest.approx(np.minimum(length, 1.0) * percept.speed, abs=1e-12)
        self.decisions += len(length)
        return action, state


@pytest.mark.parametrize("encoding", [None, "distance"])
@pytest.mark.parametrize("sizes", [None, (32, 2), (32, 9, 7, 2), (32, 5, 40, 2)])
def test_the_rule_is_that_of_its_slow_twin(sizes: Any, encoding: str | None, tmp_path: Path) -> None:
    policy = Trained(written(tmp_path / "one.npz", sizes, encoding=encoding) if sizes else "")
    check_policy(policy)
    watched = Watched(policy)
    model = CMOMMT(robots=6, targets=9, radius=2.0, policy=watched, awareness="ring", seed=3)
    with pytest.warns(UserWarning, match="Python"):
        model.run(20)
    assert watched.decisions == 120


@pytest.mark.parametrize("encoding", [None, "nearness", "distance"])
def test_both_paths_and_an_environment_have_the_same_bits(encoding: str | None, tmp_path: Path) -> None:
    policy = Trained(written(tmp_path / "one.npz", encoding=encoding))
    run, stepped = (CMOMMT(robots=4, targets=6, radius=2.0, policy=policy, awareness="ring", seed=5) for _ in range(2))
    run.run(30)
    with np.load(tmp_path / "one.npz") as content:
        np.savez(tmp_path / "old.npz", **{name: value for name, value in content.items() if name != "encoding"})
    assert (policy == Trained(str(tmp_path / "old.npz"))) == (encoding != "distance")
    env = vector_env(1, robots=4, targets=6, radius=2.0, max_cycles=40, encoding=encoding or "nearness")
    observations, _ = env.reset(seed=5)
    for _ in range(30):
        stepped.step()
        actions = way(policy, observations.astype(float))
        observations = env.step(actions / np.maximum(np.hypot(*actions.T).T[..., None], 1.0)).observations
    assert run.robots.position.tobytes() == stepped.robots.position.tobytes()
    # Rounded otherwise: the forward pass is NumPy's, and nearness is float32, by at most 2⁻²⁵ from 1 − the situation.
    assert env.world(0).groups[0].position == pytest.approx(run.robots.position, abs=1e-6)


def test_a_network_runs_in_any_world_and_is_known_by_its_weights(tmp_path: Path) -> None:
    path = written(tmp_path / "one.npz", (16, 4, 2), "none")
    policy = Trained(path)
    world = World(Disc(3.0), rng=1)
    robots = world.add(Robot, 3, policy=policy, awareness="none")
    world.senses(robots, world.add(Target, 5, policy="random-walk"))
    world.run(5)
    assert np.ptp(robots.position, axis=0).min() > 0
    CMOMMT(policy="ppo", policy_options={"file": path}, awareness="none", seed=1).run(2)
    Path(path).unlink()
    # A copy brings its weights along.
    assert pickle.loads(pickle.dumps(policy)) == policy != Trained()
    assert repr(policy) != repr(Trained()) == "Trained()"


def test_another_degree_of_awareness_is_refused() -> None:
    with pytest.raises(ValueError, match="ring"):
        CMOMMT(policy="ppo", awareness="pairwise")


def test_what_is_shipped_observes_more_than_a_random_walk() -> None:
    def observed(policy: str, awareness: str) -> list[float]:
        models = [CMOMMT(robots=5, targets=10, policy=policy, awareness=awareness, seed=seed) for seed in range(12)]
        for model in models:
            model.run(300)
        return [model.observed_fraction for model in models]

    # 0.17 and more than 0.4 over many seeds.
    assert np.mean(observed("ppo", "ring")) > 1.5 * np.mean(observed("random-walk", "none"))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"degree": None}, "holds no trained network"),
        ({"encoding": "far"}, "encoding='far' is unknown; give that of the environment, nearness or distance"),
        ({"weight_0": None}, "the last layer has 0 outputs"),
        ({"bias_1": None}, r"layer 1 has weights of the shape \(7, 9\) and a bias of \(\)"),
        ({"weight_1": np.zeros((7, 8))}, r"layer 1 has weights of the shape \(7, 8\)"),
        ({"weight_2": None}, "the last layer has 7 outputs; it must have 2"),
        ({"bias_2": np.array([0.0, np.nan])}, "bias_2 must hold finite numbers"),
        ({"bias_2": np.zeros(2, int)}, "bias_2 must hold finite numbers, and has the type int64"),
        ({"weight_0": np.zeros((600, 32)), "bias_0": np.zeros(600)}, "at most 512"),
        ({"degree": np.array([object()])}, "holds no trained network"),
        ({"bias_2": np.array([1e300, 0.0])}, "bias_2 must hold finite numbers"),
        ({"weight_4": np.zeros((2, 2))}, "'weight_4' is no part of its 3 layers"),
    ],
)
def test_a_file_that_is_no_network_is_refused(change: Any, message: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=message):
        Trained(written(tmp_path / "one.npz", **change))


def test_half_a_file_and_none_are_refused(tmp_path: Path) -> None:
    path = Path(written(tmp_path / "one.npz"))
    path.write_bytes(path.read_bytes()[:700])
    with pytest.raises(ValueError, match="holds no trained network"):
        Trained(str(path))
    with pytest.raises(FileNotFoundError):
        Trained(str(tmp_path / "none.npz"))
    np.save(tmp_path / "one.npy", np.zeros(3))
    with pytest.raises(ValueError, match="holds no trained network"):
        Trained(str(tmp_path / "one.npy"))


def test_an_array_whose_header_never_ends_is_refused(tmp_path: Path) -> None:
    path, damaged = written(tmp_path / "one.npz"), tmp_path / "damaged.npz"
    with zipfile.ZipFile(path) as whole, zipfile.ZipFile(damaged, "w") as file:
        for name in whole.namelist():
            file.writestr(name, whole.read(name).replace(b"}", b" "))
    with pytest.raises(ValueError, match="holds no trained network"):
        Trained(str(damaged))


def test_damaged_bytes_are_refused_or_harmless(tmp_path: Path) -> None:
    path = tmp_path / "one.npz"
    with np.load(written(path)) as found:
        np.savez_compressed(path, **dict(found))
    whole, rng = path.read_bytes(), generator()
    for _ in range(200):
        damaged = bytearray(whole)
        damaged[int(rng.integers(len(damaged)))] ^= int(rng.integers(1, 256))
        path.write_bytes(damaged)
        with contextlib.suppress(ValueError):
            Trained(str(path))
