"""``teamsight plot``: pictures of complete and partial studies, and what is refused."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from teamsight.analysis.studies.study import Study
from teamsight.cli import main

STUDIES = Path(__file__).parent.parent / "analysis" / "studies"
sys.path.insert(0, str(STUDIES))
from made_up_results import filled  # noqa: E402

AXES = {"robots": [2, 4, 8], "radius": [1.0, 2.0, 3.0]}
AWARE, UNAWARE = (Study(fixed={"policy": policy}, axes=AXES, replicates=3) for policy in ("a-cmommt", "centroid"))
STARTS = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}


def call(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as left:
        main(["plot", *arguments])
    return int(left.value.code or 0), *capsys.readouterr()


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of a partial study, below the current folder."""
    monkeypatch.chdir(tmp_path)
    filled(tmp_path / "study", AWARE, share=0.5)
    return tmp_path / "study"


def test_the_picture_is_named_after_the_folder(capsys: pytest.CaptureFixture[str], study: Path) -> None:
    assert call(capsys, "study") == (0, "study.png: partial: 14 of 27 runs\n", "")
    assert (study.parent / "study.png").read_bytes().startswith(STARTS["png"])


@pytest.mark.parametrize("suffix", STARTS)
def test_the_suffix_is_the_format(capsys: pytest.CaptureFixture[str], study: Path, suffix: str) -> None:
    filled(study, AWARE)
    out = study.parent / f"p.{suffix}"
    assert call(capsys, str(study), "--out", str(out)) == (0, f"{out}: all 27 runs\n", "")
    first = out.read_bytes()
    assert first.startswith(STARTS[suffix])
    # The same study gives the same bytes, and replaces its own picture.
    assert call(capsys, str(study), "--out", str(out))[0] == 0
    assert out.read_bytes() == first


def test_files_of_others_are_kept(capsys: pytest.CaptureFixture[str], study: Path) -> None:
    out = study.parent / "mine.png"
    out.write_bytes(b"a photograph")
    status, _, err = call(capsys, str(study), "--out", str(out))
    assert (status, "mine.png: holds something else" in err, "--force" in err) == (2, True, True)
    assert out.read_bytes() == b"a photograph"
    assert call(capsys, str(study), "--out", str(out), "--force")[0] == 0
    assert out.read_bytes().startswith(STARTS["png"])


def test_two_studies_are_subtracted(capsys: pytest.CaptureFixture[str], study: Path) -> None:
    filled(study.parent / "other", UNAWARE)
    line = [str(study), "--minus", str(study.parent / "other"), "--kind", "lines", "--where", "radius=2"]
    assert call(capsys, *line)[0] == 0
    filled(study.parent / "unpaired", Study(axes=AXES, replicates=3, seed=5))
    status, _, err = call(capsys, str(study), "--minus", str(study.parent / "unpaired"))
    assert (status, "seeds differ" in err, err.count("\n")) == (2, True, 1)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (["--kind", "heatmap"], "kind='heatmap': unknown; did you mean 'heat-map'?"),
        (["--out", "p.jpg"], "out=p.jpg: must be a file that ends with one of .png, .svg, .pdf"),
        (["--x", "robot"], "x='robot': unknown; did you mean 'robots'?"),
        (["--measure", "observed"], "measure='observed': unknown; did you mean 'observed_fraction'?"),
        (["--where", "radius"], "where=radius: must be NAME=VALUE"),
        (["--where", "radius=9"], "where=radius='9': is no value of the study; give one of 1.0, 2.0, 3.0"),
        (["--where", "radius=2", "--where", "radius=3"], "radius is given twice"),
        (["--minus", "nowhere"], "nowhere: "),
    ],
)
def test_wrong_options_are_named(
    capsys: pytest.CaptureFixture[str], study: Path, line: list[str], message: str
) -> None:
    status, _, err = call(capsys, str(study), *line)
    assert (status, message in err, err.count("\n")) == (2, True, 1), err
    assert not list(study.parent.glob("*.png"))


def test_damaged_parts_are_named_with_the_cure(capsys: pytest.CaptureFixture[str], study: Path) -> None:
    part = sorted((study / "runs").iterdir())[0]
    part.write_bytes(part.read_bytes()[:-9])
    status, _, err = call(capsys, str(study))
    assert (status, part.name in err, "teamsight verify" in err, err.count("\n")) == (2, True, True, 1)


def test_a_study_without_runs_is_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    filled(tmp_path / "empty", AWARE, share=0.0)
    status, _, err = call(capsys, str(tmp_path / "empty"), "--out", str(tmp_path / "p.png"))
    assert (status, "no run is done yet" in err) == (2, True)
