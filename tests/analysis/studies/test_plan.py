"""`Plan` against a naive twin: a dictionary for each setting, one after the other."""

from __future__ import annotations

import dataclasses
import hashlib
import sys
import tracemalloc
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teamsight import Study, run_many
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.seeds import canonical, model_seed, run_seed, seeds_of
from teamsight.analysis.studies.definition.values import frozen, hex_of, run_id, text_of, thawed

NUMBERS = st.integers(-50, 50) | st.floats(-50, 50)
VALUES = NUMBERS | st.booleans() | st.sampled_from(["a", "b", "ü,=x"]) | st.lists(NUMBERS, max_size=2)


def distinct(size: int) -> st.SearchStrategy[list[Any]]:
    return st.lists(VALUES, min_size=size, max_size=size, unique_by=lambda one: text_of(frozen("x", one)))


@st.composite
def studies(draw: st.DrawFn) -> Study:
    """Return a study of axes, of which two may be zipped, points and a sample."""
    sizes = draw(st.lists(st.integers(1, 3), min_size=0, max_size=3))
    axes = {name: draw(distinct(size)) for name, size in zip(("robots", "radius", "c"), sizes, strict=False)}
    zipped = []
    if draw(st.booleans()):
        axes |= {"y": draw(distinct(2)), "x": draw(distinct(2))}
        zipped = [["x", "y"]]
    points = draw(
        st.none() | st.fixed_dictionaries({"p": distinct(2), "targets": st.lists(VALUES, min_size=2, max_size=2)})
    )
    sample = draw(st.none() | st.fixed_dictionaries({"s": distinct(3)}))
    fixed = draw(st.dictionaries(st.sampled_from(["f", "policy"]), VALUES, max_size=2))
    seed, pairing = draw(st.integers(0, 10)), draw(st.sampled_from(["scenario", "none"]))
    return Study(
        fixed=fixed, axes=axes, zip=zipped, points=points, sample=sample, seed=seed, pairing=pairing, replicates=2
    )


def naive(study: Study) -> list[dict[str, Any]]:
    """Return the parameters of each setting, by the definition: a product of what advances together."""
    groups: list[list[dict[str, Any]]] = []
    together = {name: group for group in study.zip for name in group}
    for name in study.axes:
        group = together.get(name, (name,))
        if name == min(group, key=list(study.axes).index):
            groups.append(
                [dict(zip(group, row, strict=True)) for row in zip(*(study.axes[one] for one in group), strict=True)]
            )
    for columns in (study.points, study.sample):
        if columns is not None:
            groups.append([dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)])
    found = []
    for rows in product(*groups):
        setting = dict(study.fixed)
        for row in rows:
            setting.update(row)
        found.append({name: thawed(value) for name, value in setting.items()})
    return found


@given(studies())
def test_a_plan_is_that_of_its_naive_twin(study: Study) -> None:
    plan, listed = study.plan(), naive(study)
    assert plan.settings == len(listed)
    assert plan.runs == 2 * len(listed)
    assert set(plan.names) == set(listed[0])
    assert plan.names[: len(study.fixed)] == tuple(study.fixed)
    assert plan.names[len(study.fixed) :] == plan.swept
    for k, setting in enumerate(listed):
        assert plan.parameters(k) == setting
        assert {name: plan.values(name)[plan.places(name)[k]] for name in plan.names} == setting
        text = canonical(setting)
        assert f"{plan.ids[k]:016x}" == hashlib.blake2b(text.encode(), digest_size=8).hexdigest()
        for replicate in (0, 1):
            assert plan.seed(k, replicate) == naive_seed(study, setting, replicate)
    assert [hex_of(one) for one in plan.ids] == [f"{one:016x}" for one in plan.ids]
    assert (plan.index_of(plan.ids) == np.arange(plan.settings)).all()
    assert (plan.index_of(plan.ids ^ np.uint64(1)) == -1).all()
    assert plan.index_of(np.array([], np.uint64)).shape == (0,)


def naive_seed(study: Study, setting: dict[str, Any], replicate: int) -> int:
    if study.pairing == "none":
        return seeds_of(study.seed, setting, False, "none")(replicate)
    robots, targets, radius = setting.get("robots", 10), setting.get("targets", 15), setting.get("radius", 5.0)
    return model_seed(study.seed, replicate, robots, targets, radius)


@given(studies())
def test_the_order_puts_together_what_can_share_a_world(study: Study) -> None:
    plan = study.plan()
    assert sorted(plan.order) == list(range(plan.settings))
    likeness = [Run(plan.parameters(k), 0, 1).likeness for k in plan.order]
    groups = [one for one, before in zip(likeness, [None, *likeness], strict=False) if one != before]
    assert len(groups) == len(set(groups)) == len(set(likeness))


@given(studies(), st.randoms(use_true_random=False))
def test_ids_and_seeds_do_not_depend_on_how_a_setting_is_given(study: Study, random: Any) -> None:
    """Neither on the order of keys, nor on int or float, nor on whether a parameter is fixed or swept."""
    plan = study.plan()
    k = random.randrange(plan.settings)
    setting = plan.parameters(k)
    names = list(setting)
    random.shuffle(names)
    cut = random.randrange(len(names) + 1)
    other = {name: as_float(setting[name]) for name in names}
    again = dataclasses.replace(
        study, fixed={name: other[name] for name in names[:cut]}, axes={name: [other[name]] for name in names[cut:]}, zip=(),
        points=None, sample=None,
    ).plan()  # fmt: skip
    assert again.settings == 1
    assert again.ids[0] == plan.ids[k]
    assert [again.seed(0, replicate) for replicate in range(3)] == [plan.seed(k, replicate) for replicate in range(3)]


def as_float(value: Any) -> Any:
    if isinstance(value, list):
        return list(map(as_float, value))
    return float(value) if type(value) is int else value


@given(studies(), studies())
def test_settings_of_equal_ids_are_equal(one: Study, other: Study) -> None:
    first, second = one.plan(), other.plan()
    found = second.index_of(first.ids)
    for k in np.flatnonzero(found >= 0):
        assert canonical(first.parameters(k)) == canonical(second.parameters(int(found[k])))
    every = {canonical(setting) for setting in naive(other)}
    assert [canonical(first.parameters(k)) in every for k in range(first.settings)] == (found >= 0).tolist()


@pytest.mark.short
def test_ids_are_for_ever() -> None:
    """Folders of studies hold them; no change of the code may change them."""
    plan = Study(
        fixed={"policy": "a-cmommt", "uniform_target_speed": True}, axes={"robots": [5], "radius": [2.5]}, seed=7
    ).plan()
    assert [hex_of(one) for one in plan.ids] == [
        hashlib.blake2b(
            b"{policy='a-cmommt', radius=0x1.4000000000000p+1, robots=5, uniform_target_speed=True}", digest_size=8
        ).hexdigest()
    ]
    assert [hex_of(one) for one in plan.ids] == ["cd2ebc992b068c13"]
    assert plan.seed(0, 3) == 6036003758410580
    assert dataclasses.replace(plan.study, pairing="none").plan().seed(0, 3) == 3073094195331275  # type: ignore[type-var]
    assert run_id(int(plan.ids[0]), 3) == "cd2ebc992b068c13-3"


def test_seeds_are_those_of_run_many() -> None:
    study = Study(
        axes={"robots": [2, 3], "radius": [2.0, 3.0], "policy": ["a-cmommt", "centroid"]},
        fixed={"targets": 2},
        replicates=2,
        seed=9,
    )
    plan = study.plan()
    table = run_many([plan.parameters(k) for k in range(plan.settings)], steps=1, replicates=2, rng=9)
    assert table["seed"].tolist() == [plan.seed(k, replicate) for k in range(plan.settings) for replicate in (0, 1)]
    assert table["seed"].nunique() == 8
    own = dataclasses.replace(study, model="no_such_module:Model").plan()
    assert [own.seed(k, 1) for k in range(8)] == [run_seed(9, 1)] * 8
    alone = dataclasses.replace(study, pairing="none").plan()
    assert len({alone.seed(k, replicate) for k in range(8) for replicate in (0, 1)}) == 16


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    (tmp_path / "a_planned_model.py").write_text(
        "from __future__ import annotations\n"
        "def model(i: int, f: float, b: bool, anything=None, *, u: int | float = 1, rng=None): ...\n"
        "def plain(i, f, b, anything=None, u=1, rng=None): ...\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "a_planned_model", raising=False)
    return "a_planned_model"


def test_types_of_columns(module: str) -> None:
    fixed = {"i": 5, "f": 2, "b": True, "u": 3, "anything": [1]}
    study = Study(model=f"{module}:model", fixed=fixed)
    assert study.plan().types == {"i": "int", "f": "number", "b": "flag", "u": "number", "anything": "text"}
    plain = dataclasses.replace(study, model=f"{module}:plain").plan()
    assert plain.types == {"i": "number", "f": "number", "b": "flag", "u": "number", "anything": "text"}

    def of(*values: Any) -> str:
        return dataclasses.replace(study, fixed={}, axes={"i": values}).plan().types["i"]

    assert (of(1, 2.0), of(1, 2.5), of(1, "a"), of(True, False), of(1, True), of("a"), of([1])) == (
        "int", "number", "text", "flag", "text", "text", "text",
    )  # fmt: skip
    assert Study(axes={"robots": [5], "radius": [2], "policy": ["centroid"]}).plan().types == {
        "robots": "int", "radius": "number", "policy": "text",
    }  # fmt: skip


@pytest.mark.short
def test_a_plan_imports_nothing_of_the_user() -> None:
    plan = Study(model="no_such_module:Model", fixed={"policy": "no_such_module:Policy"}, axes={"a": [1, 2]}).plan()
    assert (plan.settings, len(plan.ids), plan.seed(1, 0), len(plan.order)) == (2, 2, run_seed(0, 0), 2)
    with pytest.raises(ValueError, match="no module 'no_such_module'"):
        plan.components(0)
    with pytest.raises(ValueError, match="no module 'no_such_module'"):
        _ = plan.types


def test_cost_is_that_of_a_run() -> None:
    plan = Study(axes={"robots": [5, 50]}, steps=100).plan()
    assert [plan.cost(k) for k in (0, 1)] == [Run({"robots": robots}, 0, 100).cost for robots in (5, 50)]


def test_replicates_cost_no_memory_and_settings_little() -> None:
    tracemalloc.start()
    many = Study(axes={"a": range(10)}, replicates=10**7).plan()
    assert (many.runs, len(many.ids), len(many.order)) == (10**8, 10, 10)
    assert many.seed(9, 10**7 - 1) == model_seed(0, 10**7 - 1, 10, 15, 5.0)
    assert tracemalloc.get_traced_memory()[1] < 3_000_000
    tracemalloc.reset_peak()
    wide = Study(axes={"a": range(300), "b": range(300)}).plan()
    assert len(wide.ids) == len(set(wide.ids)) == 90_000
    assert len(wide.order) == 90_000
    assert tracemalloc.get_traced_memory()[1] < 60_000_000
    tracemalloc.stop()


def test_settings_of_a_table_are_its_rows() -> None:
    table = pd.DataFrame({"robots": [5, 7, 7], "radius": [2.0, 2.0, 3.5]})
    plan = Study(points=table).plan()
    assert [plan.parameters(k) for k in range(3)] == table.to_dict("records")
