"""Evolution: it can be interrupted anywhere, and goes on as if it had not been."""

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


def test_an_interrupted_evolution_goes_on_as_if_it_had_not_been(tmp_path: Path) -> None:
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


def test_every_candidate_of_a_generation_meets_the_same_worlds_and_the_next_meets_others() -> None:
    first = cma.Job(cma.beginning(1), 0)
    assert cma.worth(first) == cma.worth(first) != cma.worth(first._replace(generation=1))


def test_no_command_accepts_a_seed_of_the_evolution_and_none_is_used_twice() -> None:
    roots = [cma.TRAIN, cma.VALIDATE, cma.SCREEN, cma.TEST]
    assert max(roots) < 0
    assert len(set(roots)) == 4


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
