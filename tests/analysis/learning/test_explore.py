"""Explorations of many worlds depend on their settings alone; what was made of one is kept."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from teamsight.agents.recording.explore import explore as explore_one
from teamsight.analysis.learning import explore as module
from teamsight.analysis.learning.explore import Exploration, explore
from teamsight.analysis.runs.workers import WorkerPool
from teamsight.policies.memory import LazyMemory

SMALL = Exploration(robots=3, targets=4, radius=2.0, steps=10, runs=7, seed=3)


def bits(memory: LazyMemory) -> bytes:
    return memory.table.tobytes()


@pytest.fixture
def small_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_NUMBERS_A_PART", 70 * 75)


@pytest.mark.short
def test_the_papers_exploration_gives_exactly_600_pairs() -> None:
    memory = explore()
    assert (len(memory), memory.own, memory.added) == (600, 16, 16)
    told = memory.settings
    assert (told["robots"], told["targets"], told["steps"], told["runs"]) == (5, 10, 120, 1)
    assert (told["radius"], told["awareness"], told["seed"]) == (3.0, "RingAwareness(delta=16)", 0)
    # Any direction and any distance are equally likely: their means lie within 5 standard errors.
    assert abs(memory.action[:, 0].mean()) < 5 * np.pi / np.sqrt(3 * 600)
    assert abs(memory.action[:, 1].mean() - 0.5) < 5 / np.sqrt(12 * 600)


def test_one_run_is_one_world() -> None:
    alone = replace(SMALL, runs=1)
    assert bits(explore(alone)) == bits(explore_one(alone.model(0), alone.steps))


@pytest.mark.usefixtures("small_parts")
def test_parts_and_workers_change_nothing(tmp_path: Path) -> None:
    seen: list[tuple[float, float]] = []
    memory = explore(SMALL, progress=lambda done, total: seen.append((done, total)))
    assert len(memory) == SMALL.pairs == 210
    assert seen == [(0, 210), (60, 210), (120, 210), (180, 210), (210, 210)]
    with WorkerPool(2) as pool:
        # Workers import the module anew, and make larger parts of it; what they are sent are these parts.
        assert bits(explore(SMALL, pool=pool)) == bits(memory)
        assert bits(explore(SMALL, folder=tmp_path / "parts", pool=pool)) == bits(memory)
    worlds = [explore_one(SMALL.model(run), SMALL.steps) for run in range(SMALL.runs)]
    assert bits(worlds[0].merge(*worlds[1:])) == bits(memory)


@pytest.mark.usefixtures("small_parts")
def test_what_was_made_before_an_interruption_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    memory, folder = explore(SMALL), tmp_path / "parts"

    def stop(done: float, total: float) -> None:
        if done >= 120:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        explore(SMALL, folder=folder, progress=stop)
    names = [f"{SMALL.key}-0-2.safetensors", f"{SMALL.key}-2-4.safetensors"]
    assert sorted(path.name for path in folder.iterdir()) == names
    assert module.kept_pairs(SMALL, folder) == 120
    made: list[int] = []
    meet = module.meet
    monkeypatch.setattr(module, "meet", lambda *given: (made.append(1), meet(*given))[1])
    assert bits(explore(SMALL, folder=folder)) == bits(memory)
    assert len(made) == 3
    # A part that was altered is made again, and another exploration has parts of its own.
    (folder / names[0]).write_bytes(b"nonsense")
    assert bits(explore(SMALL, folder=folder)) == bits(memory)
    assert len(made) == 5
    other = replace(SMALL, seed=4)
    assert bits(explore(other, folder=folder)) == bits(explore(other)) != bits(memory)
    assert module.kept_pairs(SMALL, folder) == module.kept_pairs(other, folder) == 210
    # Only an exploration's own parts are forgotten, and what a killed process left of them.
    (folder / f".{SMALL.key}-0-2.safetensors.77.part").touch()
    module.forget_parts(SMALL, folder)
    assert module.kept_pairs(other, folder) == 210
    assert len(list(folder.iterdir())) == 4
    (folder / "notes.txt").write_text("my own")
    module.forget_parts(other, folder)
    assert [path.name for path in folder.iterdir()] == ["notes.txt"]
    (folder / "notes.txt").unlink()
    module.forget_parts(other, folder)
    assert not folder.exists()


def test_parts_are_kept_from_the_second_on() -> None:
    # 300,000 pairs of 32 inputs are a part.
    assert not Exploration(runs=500).is_long
    assert Exploration(runs=501).is_long


def test_the_treatment_does_not_change_the_stage() -> None:
    one, other = SMALL, replace(SMALL, awareness="none", world={"robot_speed": 0.05})
    assert one.run_seed(2) == other.run_seed(2)
    assert np.array_equal(one.model(2).targets.position, other.model(2).targets.position)


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"runs": 0}, "runs=0: must be at least 1"),
        ({"steps": 1.5}, "steps=1.5: must be a whole"),
        ({"seed": -1}, "seed=-1"),
        ({"runs": 10**12}, "runs=1000000000000: must be at most 1000000; give fewer"),
        ({"steps": 10**12}, "steps=1000000000000: must be at most 10000000; make more runs"),
        ({"steps": 10**6, "runs": 10**6}, r"makes 5.0e.12 pairs, at most 1e.08 fit in memory; give less"),
    ],
)
def test_bad_numbers_are_refused(settings: dict[str, float], told: str) -> None:
    with pytest.raises((TypeError, ValueError), match=told):
        Exploration(**settings)  # type: ignore[arg-type]
