"""Evolution: it can be interrupted anywhere and resumes with the same bits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from teamsight.analysis.evolution import cma, compare
from teamsight.analysis.evolution.cma import Evolution, checkpoint_in, evolve
from teamsight.analysis.runs import checkpoint
from teamsight.analysis.runs.experiment import Grid
from teamsight.analysis.runs.processes import WorkerPool

SMALL = Evolution(population=4)


@pytest.fixture(autouse=True)
def few_worlds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cma, "GRID", Grid((5,), (2.0, 3.0)))
    monkeypatch.setattr(cma, "STEPS", 30)


@pytest.fixture
def tried(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Numbers of the generations that are tried."""
    numbers: list[int] = []

    def fitness(candidates: list[np.ndarray], generation: int, pool: WorkerPool | None, *, root: int) -> list[float]:
        numbers.append(generation)
        return original(candidates, generation, pool, root=root)

    original = cma.fitness
    monkeypatch.setattr(cma, "fitness", fitness)
    return numbers


def run(generations: int, folder: Path, what: Evolution = SMALL) -> list[np.ndarray]:
    return [found.mean for found in evolve(what, generations, checkpoint_in(folder))]


def test_an_interrupted_evolution_resumes_with_the_same_bits(tmp_path: Path, tried: list[int]) -> None:
    whole, parts = tmp_path / "ints", tmp_path / "parts"
    whole.mkdir(), parts.mkdir()
    expected = run(4, whole)
    run(1, parts)
    with checkpoint_in(parts).path.open("a") as file:
        file.write('\n["half a li')
    run(3, parts)
    found = run(4, parts)
    assert np.array_equal(expected, found)
    assert tried == 2 * [0, 1, 2, 3]
    assert np.array_equal(run(2, whole), expected[:2])


def test_a_damaged_generation_is_tried_again(tmp_path: Path, tried: list[int]) -> None:
    expected = run(3, tmp_path)
    path = checkpoint_in(tmp_path).path
    lines = path.read_bytes().split(b"\n")
    # Lines: empty, header, content, header, content, …
    lines[4] = lines[4].replace(b"0.", b"1.", 1)
    path.write_bytes(b"\n".join(lines))
    assert np.array_equal(run(3, tmp_path), expected)
    assert tried == [0, 1, 2, 1]


def test_another_evolution_is_not_mixed_in(tmp_path: Path, tried: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    run(1, tmp_path)
    run(1, tmp_path, Evolution(population=4, seed=2))
    run(1, tmp_path, Evolution(population=5))
    monkeypatch.setattr(cma, "STEPS", 31)
    run(1, tmp_path)
    monkeypatch.setattr(checkpoint, "code_digest", lambda *modules: "0123456789abcdef")
    run(1, tmp_path)
    assert tried == 5 * [0]


def test_a_generation_has_the_same_worlds_for_all_and_the_next_has_others() -> None:
    constants = cma.beginning(1)
    (alone,) = cma.fitness([constants], 0)
    assert cma.fitness([0.9 * constants, constants], 0)[1] == alone
    assert cma.fitness([constants], 1) != [alone]


def test_the_interval_rests_on_the_replicates() -> None:
    table = pd.DataFrame(
        {
            "robots": [5, 9] * 3, "radius": 2.0, "replicate": [0, 0, 1, 1, 2, 2],
            "difference": [0.0, 0.02, 0.01, 0.03, 0.02, 0.04],
        }
    )  # fmt: skip
    gain = compare.overall(table)
    assert gain.mean == pytest.approx(2.0)
    # Student's t with two degrees of freedom: 4.303 times the standard error of 1, 2, 3.
    assert gain.high - gain.mean == pytest.approx(4.3027 / 3**0.5, rel=1e-4)
    assert str(gain) == "+2.00 (-0.48 to +4.48)"
