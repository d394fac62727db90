"""Evolution: it can be interrupted anywhere and resumes with the same bits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from teamsight.analysis.evolution import cma, compare
from teamsight.analysis.evolution.cma import LOG, Evolution, LogError, evolve
from teamsight.analysis.runs.experiment import Grid
from teamsight.analysis.runs.workers import WorkerPool

SMALL = Evolution(population=4)


@pytest.fixture(autouse=True)
def few_worlds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cma, "GRID", Grid((5,), (2.0, 3.0)))
    monkeypatch.setattr(cma, "STEPS", 30)


def run(generations: int, folder: Path, what: Evolution = SMALL) -> list[np.ndarray]:
    with WorkerPool(1) as pool:
        return [found.mean for found in evolve(what, generations, folder, pool)]


def test_an_interrupted_evolution_resumes_with_the_same_bits(tmp_path: Path) -> None:
    whole, parts = tmp_path / "ints", tmp_path / "parts"
    whole.mkdir(), parts.mkdir()
    expected = run(4, whole)
    run(1, parts)
    with (parts / LOG).open("a") as log:
        log.write("[0.5, 0.4")
    run(3, parts)
    found = run(4, parts)
    assert np.array_equal(expected, found)
    assert (whole / LOG).read_bytes() == (parts / LOG).read_bytes()
    assert np.array_equal(run(2, whole), expected[:2])


def test_another_evolution_is_not_mixed_in(tmp_path: Path) -> None:
    run(1, tmp_path)
    before = (tmp_path / LOG).read_bytes()
    with pytest.raises(LogError, match=r'"seed": 1.*"seed": 2.*give another folder'):
        run(2, tmp_path, Evolution(population=4, seed=2))
    assert (tmp_path / LOG).read_bytes() == before


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
