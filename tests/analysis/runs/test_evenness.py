"""The measure "evenness", in `run_many`, in studies and on the command line."""

from __future__ import annotations

from pathlib import Path

import pytest

from teamsight import CMOMMT, Study, run_many
from teamsight.analysis.runs.run_many import evenness
from teamsight.cli.main import main

SETTINGS = {"robots": [3, 6], "targets": 5, "radius": 2.0, "policy": ["random-walk", "a-cmommt"]}


@pytest.mark.short
def test_run_many_measures_it_in_worlds_that_are_used_again() -> None:
    table = run_many(SETTINGS, steps=40, replicates=3, rng=1, measure=evenness)
    plain = run_many(SETTINGS, steps=40, replicates=3, rng=1)
    for name in ("observed_fraction", "max_neighbours", "mean_neighbours"):
        assert table[name].equals(plain[name])
    for row in table.itertuples():
        model = CMOMMT(robots=row.robots, targets=5, radius=2.0, policy=row.policy, rng=row.seed)
        counts = model.count_observations()
        model.run(40)
        assert (row.spread, row.entropy, row.redundancy) == (counts.spread, counts.entropy, counts.redundancy)


def test_a_world_that_counts_already_goes_on_counting() -> None:
    model = CMOMMT(robots=3, rng=1)
    counts = model.count_observations()
    evenness(model, 10)
    found = evenness(model, 10)
    assert set(counts.table["steps"]) == {20}
    assert found.spread == counts.spread


def test_a_study_records_it(tmp_path: Path) -> None:
    study = Study(
        axes={"policy": ["random-walk", "a-cmommt"]}, fixed={"robots": 4, "targets": 4, "radius": 2.0}, replicates=2,
        steps=30, record={"measure": "evenness"},
    )  # fmt: skip
    study.check()
    frame = study.run(tmp_path / "out").frame
    assert (frame["redundancy"] >= 1).all()
    assert {"spread", "entropy", "observed_fraction"} <= set(frame.columns)
    wrong = Study(record={"measure": "eveness"})
    with pytest.raises(ValueError, match=r"record\.measure='eveness'.*evenness"):
        wrong.check()


def test_run_prints_it(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        main(["run", "--robots", "4", "--targets", "4", "--radius", "2", "--steps", "50", "--evenness"])
    assert not left.value.code
    out = capsys.readouterr().out
    model = CMOMMT(robots=4, targets=4, radius=2.0, rng=0)
    counts = model.count_observations()
    model.run(50)
    assert f"{100 * counts.spread:.1f} %" in out
    assert f"{counts.entropy:.3f}, 1.386 nat" in out
    assert f"{counts.redundancy:.2f}" in out
