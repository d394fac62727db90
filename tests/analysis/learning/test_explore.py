"""Explorations of many worlds depend on their settings alone; finished runs are kept."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from teamsight.agents.recording.explore import explore as explore_one
from teamsight.analysis.learning import explore as module
from teamsight.analysis.learning.explore import TRANSITIONS, Exploration, explore
from teamsight.analysis.runs import simulate
from teamsight.analysis.runs.checkpoint import Checkpoint, Codec
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.policies.memory import LazyMemory

SMALL = Exploration(world={"robots": 3, "targets": 4, "radius": 2.0}, steps=10, runs=7, seed=3)


def archive(**arrays: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def bits(memory: LazyMemory) -> bytes:
    return memory.table.tobytes()


@pytest.fixture
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Put two runs into a chunk."""
    monkeypatch.setattr(simulate, "_CHUNK", 1.5 * SMALL.all_runs[0].cost)


@pytest.mark.short
def test_the_papers_exploration_gives_exactly_600_transitions() -> None:
    memory = explore()
    assert (len(memory), memory.own, memory.added) == (600, 16, 16)
    settings = memory.settings
    assert (settings["robots"], settings["targets"], settings["steps"], settings["runs"]) == (5, 10, 120, 1)
    assert (settings["radius"], settings["awareness"], settings["seed"]) == (3.0, "RingAwareness(delta=16)", 0)
    # Any direction and any distance are equally likely: their means lie within 5 standard errors.
    assert abs(memory.action[:, 0].mean()) < 5 * np.pi / np.sqrt(3 * 600)
    assert abs(memory.action[:, 1].mean() - 0.5) < 5 / np.sqrt(12 * 600)


def test_one_run_is_one_world() -> None:
    alone = replace(SMALL, runs=1)
    assert bits(explore(alone)) == bits(explore_one(alone.model(0), alone.steps))


@pytest.mark.usefixtures("small_chunks")
def test_chunks_and_workers_change_nothing(tmp_path: Path, two_workers: WorkerPool) -> None:
    seen: list[tuple[float, float]] = []
    memory = explore(SMALL, progress=lambda done, total: seen.append((done, total)))
    assert len(memory) == SMALL.transitions == 210
    assert seen == [(0, 210), (60, 210), (120, 210), (180, 210), (210, 210)]
    assert bits(explore(SMALL, pool=two_workers)) == bits(memory)
    assert bits(explore(SMALL, pool=two_workers, checkpoint=Checkpoint(tmp_path / "kept", TRANSITIONS))) == bits(memory)
    worlds = [explore_one(SMALL.model(run), SMALL.steps) for run in range(SMALL.runs)]
    assert bits(worlds[0].merge(*worlds[1:])) == bits(memory)


@pytest.mark.usefixtures("small_chunks")
def test_finished_runs_are_kept_after_an_interruption(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    memory, kept = explore(SMALL), Checkpoint(tmp_path / "kept", TRANSITIONS)

    def stop(done: float, total: float) -> None:
        if done >= 120:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        explore(SMALL, checkpoint=kept, progress=stop)
    assert kept.count(SMALL.keys) == 4
    made: list[int] = []
    record = module.record_run
    monkeypatch.setattr(module, "record_run", lambda *given: (made.append(1), record(*given))[1])
    assert bits(explore(SMALL, checkpoint=kept)) == bits(memory)
    assert len(made) == 3
    # A damaged entry is made again.
    content = bytearray(kept.path.read_bytes())
    content[200] ^= 1
    kept.path.write_bytes(content)
    assert bits(explore(SMALL, checkpoint=kept)) == bits(memory)
    assert len(made) == 4
    # Another exploration has entries of its own, and only these are deleted with it.
    other = replace(SMALL, seed=4)
    assert bits(explore(other, checkpoint=kept)) == bits(explore(other)) != bits(memory)
    assert kept.count(SMALL.keys) == kept.count(other.keys) == 7
    kept.forget(SMALL.keys)
    assert (kept.count(SMALL.keys), kept.count(other.keys)) == (0, 7)
    kept.forget(other.keys)
    assert not kept.path.exists()


def test_content_that_is_no_transitions_is_ignored(tmp_path: Path) -> None:
    kept = Checkpoint(tmp_path / "kept", TRANSITIONS)
    key = SMALL.all_runs[0].key
    for content in (b"", b"nonsense", archive(situation=np.zeros(3)), archive(situation=np.zeros(3))[:-9]):
        Checkpoint(kept.path, Codec(bytes, bytes)).add({key: content})
        assert kept.results([key]) == {}


def test_a_long_exploration_is_worth_a_checkpoint() -> None:
    assert not Exploration(runs=500).is_long
    assert Exploration(runs=501).is_long


def test_the_treatment_does_not_change_the_scenario() -> None:
    one, other = SMALL, replace(SMALL, awareness="none", world={**SMALL.world, "robot_speed": 0.05})
    assert one.run_seed(2) == other.run_seed(2)
    assert np.array_equal(one.model(2).targets.position, other.model(2).targets.position)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"world": {"awareness": "none"}}, "has 'awareness'.*; give it as awareness"),
        ({"world": {"robots": 0}}, "robots=0: must be at least 1"),
        ({"world": {"robts": 3}}, "robts: is no parameter of the task cmommt; did you mean 'robots'"),
        (
            {"steps": 10**6, "runs": 10**6},
            r"robots=5, .* makes 5.0e.12 transitions of 75 numbers, 1.5e.06 GB, at most 5 GB; reduce one of them",
        ),
    ],
)
def test_bad_numbers_are_refused(settings: dict[str, object], message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        Exploration(**settings)  # type: ignore[arg-type]
