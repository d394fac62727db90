"""What a study names is imported where runs are made, and nowhere else."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

import teamsight
from teamsight.analysis.studies.folder.study_folder import verify
from teamsight.analysis.studies.standing import status

_MODEL = """
from teamsight import CMOMMT

def team(robots, policy, rng):
    return CMOMMT(robots=robots, targets=3, radius=5.0, policy=policy, rng=rng)

def measure(world, steps):
    world.run(steps)
    return {"score": world.observed_fraction}
"""
_STUDY = """
model = "odd_trust:team"
replicates = 2
steps = 3
record = { measure = "odd_trust:measure" }
fixed = { policy = { use = "teamsight.policies:ACmommt", gain = 0.5 } }
axes = { robots = [2, 3] }
"""


@pytest.mark.short
def test_reading_a_folder_imports_nothing_that_its_study_names(tmp_path: Path) -> None:
    module, out = tmp_path / "odd_trust.py", tmp_path / "out"
    module.write_text(_MODEL)
    (tmp_path / "study.toml").write_text(_STUDY)
    try:
        teamsight.Study.from_file(tmp_path / "study.toml").run(out)
        del sys.modules["odd_trust"]
        module.write_text("raise SystemExit('imported')\n")
        assert status(out).done == 4
        assert verify(out).damaged == ()
        results = teamsight.open_study(out)
        assert len(results.frame) == 4
        assert len(results.summary("score")) == 2
        results.plot(tmp_path / "figure.png")
        assert "odd_trust" not in sys.modules
        with pytest.raises((SystemExit, ValueError), match="imported"):
            teamsight.Study.from_file(tmp_path / "study.toml").run(tmp_path / "again")
    finally:
        sys.modules.pop("odd_trust", None)
