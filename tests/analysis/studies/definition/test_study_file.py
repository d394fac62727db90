"""Study files: what they hold, and one line for each thing that is wrong."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pandas as pd
import pytest

from teamsight import Study
from teamsight.analysis.studies.definition.model import Record, Until

TEN_LINES = """
replicates = 3
steps = 100
seed = 4
[fixed]
policy = "a-cmommt"
targets = 5
[axes]
robots = [5, 10]
radius = { from = 1, to = 2, step = 0.5 }
"""


def read(folder: Path, text: str | bytes, name: str = "study.toml") -> Study:
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return Study.from_file(path)


@pytest.mark.short
def test_ten_lines(tmp_path: Path) -> None:
    study = read(tmp_path, TEN_LINES)
    assert study == Study(
        replicates=3, steps=100, seed=4, fixed={"policy": "a-cmommt", "targets": 5}, name="study",
        axes={"robots": [5, 10], "radius": [1.0, 1.5, 2.0]},
    )  # fmt: skip
    assert study.path == str(tmp_path)
    assert (study.settings, study.runs) == (6, 18)
    assert read(tmp_path, "﻿" + TEN_LINES.replace("\n", "\r\n")) == study


def test_all_keys(tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_text("awareness,sensing_range\nnone,1\nring,2\n")
    study = read(
        tmp_path,
        """
        name = "All"
        model = "cmommt"
        zip = [["robots", "targets"]]
        points = "points.csv"
        replicates = 2
        steps = 50
        seed = 1
        pairing = "none"
        until = { interval = 0.5, limit = 90 }
        [fixed]
        cycle = { use = "teamsight:Cycle", period = 5 }
        [axes]
        robots = [1, 2]
        targets = [3, 4]
        [sample]
        method = "sobol"
        count = 4
        seed = 9
        axes.radius = { from = 1, to = 5 }
        [record]
        steps = true
        trajectories = 10
        """,
    )
    assert study.settings == 2 * 2 * 4
    assert study.name == "All"
    assert study.points == {"awareness": ("none", "ring"), "sensing_range": (1, 2)}
    assert study.until == Until(0.5, "observed_fraction", 90)
    assert study.record == Record("summary", True, 10, False)
    plan = study.plan()
    assert plan.swept == ("robots", "targets", "awareness", "sensing_range", "radius")
    assert {tuple(plan.parameters(k)[name] for name in ("robots", "targets")) for k in range(16)} == {(1, 3), (2, 4)}


def test_modules_beside_the_study_file_are_found(tmp_path: Path) -> None:
    (tmp_path / "beside_a_study.py").write_text(
        "from teamsight import CMOMMT\n"
        "def model(size, rng=None): return CMOMMT(robots=size, rng=rng)\n"
        "def measure(world, steps): world.run(steps); return {'x': 1.0}\n"
    )
    text = 'model = "beside_a_study:model"\nrecord.measure = "beside_a_study:measure"\naxes.{} = [1, 2]\n'
    assert read(tmp_path, text.format("size")).plan().components(1) == {"size": 2}
    with pytest.raises(ValueError, match=r"sise: is no parameter of beside_a_study:model; did you mean 'size'\?"):
        read(tmp_path, text.format("sise"))
    with pytest.raises(ValueError, match=r"module 'beside_a_study' has no 'modell'; did you mean 'model'\?"):
        read(tmp_path, text.format("size").replace(":model", ":modell"))


def test_a_component_that_raises_is_one_line_with_its_place(tmp_path: Path) -> None:
    (tmp_path / "raising_component.py").write_text("class Raising:\n    def __init__(self):\n        {}['a']\n")
    with pytest.raises(ValueError, match=r"policy: KeyError: 'a' \(raising_component.py, line 3\); correct"):
        read(tmp_path, "fixed.policy = 'raising_component:Raising'")
    (tmp_path / "ending_component.py").write_text("class End:\n    def __init__(self):\n        raise SystemExit\n")
    with pytest.raises(ValueError, match=r"policy: SystemExit.*; correct"):
        read(tmp_path, "fixed.policy = 'ending_component:End'")
    with pytest.raises(ValueError, match=r"policy: KeyError: 'a'"):
        read(tmp_path, "fixed.policy = {use = 'teamsight.policies:ACmommt', option = 'raising_component:Raising'}")


BAD = {
    "unknown key": ("axis = 1", ["key='axis'", "did you mean 'axes'?"]),
    "path": ("path = '.'", ["key='path'", "unknown"]),
    "unknown parameter": ("axes.robot = [1]", ["robot: is no parameter of cmommt", "did you mean 'robots'?"]),
    "unknown key of record": ("record.mesure = 'a'", ["key='mesure'", "did you mean 'measure'?"]),
    "unknown key of until": ("until = {interval = 1, limt = 3}", ["key='limt'", "did you mean 'limit'?"]),
    "unknown key of an axis": ("axes.robots = {form = 1, to = 2, step = 1}", ["'form'", "did you mean 'from'?"]),
    "type of steps": ("steps = 'a'", ["steps='a'", "whole number"]),
    "type of axes": ("axes = 5", ["axes=5", "table"]),
    "type of fixed": ("fixed = [1]", ["fixed=[1]", "table"]),
    "type of an axis": ("axes.robots = 5", ["axes.robots=5", "list", "fixed"]),
    "type of record": ("record = 'summary'", ["record='summary'", "table"]),
    "type of a flag": ("record.steps = 1", ["record.steps=1", "True or False"]),
    "type of zip": ("zip = ['robots']", ["zip=['robots']", "[['robots', 'targets']]"]),
    "a date": ("fixed.radius = 2020-01-01", ["fixed.radius=datetime.date(2020, 1, 1)", "cannot hold this date"]),
    "empty axis": ("axes.robots = []", ["axes.robots=[]", "at least one"]),
    "axis and fixed": ("fixed.robots = 1\naxes.robots = [2]", ["axes.robots", "also in fixed"]),
    "axis and points": ("axes.robots = [1]\npoints = {robots = [2]}", ["points", "'robots'", "also in axes.robots"]),
    "duplicates": ("axes.robots = [3, 4, 3.0]", ["'robots': 3.0", "value 1 and 3", "replicates"]),
    "lengths": ("zip = [['robots', 'targets']]\naxes = {robots = [1, 2], targets = [1]}", ["robots has 2", "targets has 1"]),
    "zip of no axis": ("zip = [['robots', 'radius']]\naxes = {robots = [1]}", ["zip='radius'", "known are robots"]),
    "zip twice": ("zip = [['robots', 'robots']]\naxes = {robots = [1]}", ["'robots' occurs twice"]),
    "replicates": ("replicates = 0", ["replicates=0", "at least 1"]),
    "runs": ("replicates = 100000000\naxes.robots = {from = 1, to = 10000, step = 1}", ["1,000,000,000,000 runs", "100,000,000"]),
    "settings": (
        "axes.robots = {from = 1, to = 10000, step = 1}\naxes.radius = {from = 1, to = 2, count = 10000}\n"
        "axes.targets = {from = 1, to = 10000, step = 1}",
        ["10000 × 10000 × 10000 = 1,000,000,000,000 settings", "10,000,000"],
    ),
    "limit of until": ("until.interval = 1\naxes.robots = {from = 1, to = 200000, step = 1}", ["until.limit=1000", "200,000,000 runs"]),
    "until without": ("until = {limit = 5}", ["until: has no 'interval'; give interval"]),
    "interval": ("until.interval = 0", ["until.interval=0", "above 0"]),
    "limit": ("until = {interval = 1, limit = 3}\nreplicates = 5", ["until.limit=3", "replicates=5"]),
    "model": ("model = 'cmomt'", ["model='cmomt'", "did you mean 'cmommt'?"]),
    "module": ("model = 'no_such_module:X'", ["no module 'no_such_module'", "install it"]),
    "not callable": ("model = 'teamsight:__version__'", ["cannot be called"]),
    "no rng": ("model = 'math:floor'", ["takes no rng"]),
    "measure": ("record.measure = 'sumary'", ["record.measure='sumary'", "did you mean 'summary'?"]),
    "component": ("fixed.policy = 'no_such_module:X'", ["policy='no_such_module:X'", "no module"]),
    "policy": ("axes.policy = ['a-cmommt', 'centroi']", ["policy='centroi'", "did you mean 'centroid'?"]),
    "value of the model": ("axes.radius = [1, 2, -1]", ["radius=-1", "above 0", "setting radius=-1"]),
    "option": ("fixed.policy_options = {idl = 'stay'}", ["idl"]),
    "cycle": ("steps = 5\nfixed.cycle = 10", ["longer than the run of 5 steps"]),
    "pairing": ("pairing = 'scenarios'", ["'scenarios'", "did you mean 'scenario'?"]),
    "own column": ("axes.replicate = [1]", ["'replicate'", "key replicates"]),
    "seed as an axis": ("axes.seed = [1]", ["'seed'", "key seed"]),
    "name": ("axes.'a b' = [1]", ["'a b'", "no name of a parameter"]),
    "huge seed": (f"seed = {2**70}", ["seed=1180591620717411303424", "at most"]),
    "huge integer": (f"fixed.robots = {10**99}", ["fixed.robots=", "2^63"]),
    "more digits than Python reads": (f"seed = {'9' * 5000}", ["not TOML", "4300"]),
    "one text of two values": ("axes.cycle = [1, '1']", ["cycle: has 1 and the text '1'", "same in results"]),
    "one text of a flag and a text": ("axes.a = [true, 'true']", ["a: has True and the text 'true'"]),
    "one text of a list and a text": ("axes.a = [[1], '[1]']", ["a: has", "the text '[1]'"]),
    "long word": ("a" * 900_000, ["not TOML"]),
    "long words": (("a" * 9_000 + " ") * 90, ["not TOML"]),
    "more agents than there may be": ("fixed.targets = 1\naxes.robots = [1, 1000000000]", ["robots=1000000000", "at most 10000000"]),
    "NaN": ("axes.radius = [1.0, nan]", ["axes.radius[1]=nan", "finite"]),
    "infinity": ("fixed.radius = inf", ["fixed.radius=inf", "finite"]),
    "deep lists": ("a = " + "[" * 90_000, ["lists and tables within each other", "flatter"]),
    "deep tables": ("fixed.a = " + "{a = " * 900 + "1" + "}" * 900, ["within each other", "flatter"]),
    "deep keys": ("fixed" + ".a" * 400_000 + " = 1", ["line 1", "more than 64 parts"]),
    "deep value": ("fixed.a = " + "[" * 40 + "]" * 40, ["more than 16", "flatter"]),
    "not TOML": ("steps = 5\naxes = \n", ["not TOML", "line 2, column"]),
    "twice": ("steps = 5\nsteps = 6\nseed = 1", ["not TOML", "line 2, column"]),
    "not UTF-8": (b"name = '\xff'", ["not UTF-8", "byte 8"]),
    "UTF-16": ("steps = 5".encode("utf-16"), ["not UTF-8"]),
    "null": (b"steps = 5\0", ["not TOML"]),
}  # fmt: skip


@pytest.mark.short
@pytest.mark.parametrize("case", BAD)
def test_each_error_is_one_line_with_value_limit_and_cure(tmp_path: Path, case: str) -> None:
    text, words = BAD[case]
    with pytest.raises((TypeError, ValueError)) as error:
        read(tmp_path, text)
    message = str(error.value)
    assert message.startswith(f"{tmp_path / 'study.toml'}: ")
    assert "\n" not in message
    assert len(message) - len(str(tmp_path)) < 600
    for word in words:
        assert word in message


def test_a_large_file_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "study.toml"
    with path.open("wb") as file:
        file.truncate(100_000_000)
    monkeypatch.setattr("tomllib.loads", lambda text: pytest.fail("parsed"))
    with pytest.raises(ValueError, match=r"has 100,000,000 bytes, at most 1,000,000; .*points"):
        Study.from_file(path)


def test_what_is_no_file(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"none.toml: cannot be read \(No such file"):
        Study.from_file(tmp_path / "none.toml")
    with pytest.raises(ValueError, match="cannot be read"):
        Study.from_file(tmp_path)
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(ValueError, match="cannot be read"):
        Study.from_file(tmp_path / "pipe")


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_points_are_read_from_a_table(tmp_path: Path, suffix: str) -> None:
    table = pd.DataFrame(
        {
            "robots": [1, 2, 3],
            "radius": [1.5, 0.1 + 0.2, 4.0],
            "awareness": ["none", "ring", "pairwise"],
            "uniform_target_speed": [True, False, True],
        }
    )
    (tmp_path / "in").mkdir()
    path = tmp_path / "in" / f"points.{suffix}"
    if suffix == "csv":
        table.to_csv(path, index=False)
    else:
        table.astype({"awareness": "category"}).to_parquet(path)
    study = read(tmp_path, f"points = 'in/points.{suffix}'")
    assert study.points == {name: tuple(table[name]) for name in table}
    assert study == Study(points=table, name="study")
    assert [type(column[0]) for column in study.points.values()] == [int, float, str, bool]


CSV = {
    "NaN": ("radius\n1.5\nnan\n", ["row 2 has no value for 'radius'"]),
    "an empty cell": ("robots,radius\n1,2\n2,\n", ["row 2 has no value for 'radius'"]),
    "no rows": ("robots,radius\n", ["points.robots=[]", "no values"]),
    "nothing": ("", ["cannot be read as a table"]),
    "a short row": ("robots,radius\n1,2\n3\n", ["cannot be read as a table"]),
    "a wrong column": ("robots,radus\n1,2\n", ["radus: is no parameter", "did you mean 'radius'?"]),
    "a column twice": ("robots,robots\n1,2\n", ["'robots' twice"]),
    "an unnamed column": ("robots,\n1,2\n", ["without a name"]),
    "dates": ("robots\n2020-01-01\n", ["column 'robots' has the type date32"]),
    "rows twice": ("robots,radius\n1,2\n3,4\n1,2\n", ["occurs twice", "value 1 and 3"]),
    "infinity": ("radius\ninf\n", ["radius[0]=inf", "finite"]),
    "names of another encoding": (b"gr\xf6\xdfe\n1\n", ["points='p.csv'", "name of a column is not UTF-8; save it as UTF-8"]),
    "another encoding": (b"policy\n\xff\xfe\n", ["points='p.csv'", "UTF-8"]),
}


@pytest.mark.parametrize("case", CSV)
def test_wrong_points(tmp_path: Path, case: str) -> None:
    text, words = CSV[case]
    (tmp_path / "p.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises((TypeError, ValueError)) as error:
        read(tmp_path, "points = 'p.csv'")
    assert "\n" not in str(error.value)
    for word in words:
        assert word in str(error.value)


def test_too_few_replicates_are_not_to_be_fewer() -> None:
    with pytest.raises(ValueError, match="replicates=0: must be at least 1$"):
        Study(replicates=0)


def test_points_are_in_the_folder_of_the_study(tmp_path: Path) -> None:
    inside, outside = tmp_path / "inside", tmp_path / "outside"
    inside.mkdir()
    outside.mkdir()
    (outside / "p.csv").write_text("robots\n1\n")
    (inside / "link.csv").symlink_to(outside / "p.csv")
    (inside / "folder").symlink_to(outside)
    (inside / "loop.csv").symlink_to(inside / "loop.csv")
    (inside / "own.csv").write_text("robots\n1\n")
    (inside / "ok.csv").symlink_to("own.csv")
    (inside / "p.txt").write_text("robots\n1\n")
    (inside / "dir.csv").mkdir()
    os.mkfifo(inside / "pipe.csv")
    assert read(inside, "points = 'ok.csv'").points == {"robots": (1,)}
    assert read(inside, f"points = '{inside / 'own.csv'}'").points == {"robots": (1,)}
    for name in ("../outside/p.csv", "link.csv", "folder/p.csv", str(outside / "p.csv"), "/etc/passwd"):
        with pytest.raises(ValueError, match=rf"points='{re.escape(name)}': is outside .*; move it there"):
            read(inside, f"points = '{name}'")
    for name, why in (
        ("none.csv", "No such file"),
        ("loop.csv", "cannot be read|loop"),
        ("p.txt", "must end in"),
        ("dir.csv", "Is a directory"),
        ("pipe.csv", "Not a regular file"),
    ):
        with pytest.raises(ValueError, match=why):
            read(inside, f"points = '{name}'")
