"""Seeds come from the stage alone; runs are recognised whatever the types of their settings."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teamsight.analysis.runs.experiment import PAPER, QUICK, Experiment, Run, canonical, model_seed
from teamsight.policies import ACmommt

STAGE = st.tuples(st.integers(0, 2**70), st.integers(0, 50), st.integers(1, 60), st.integers(1, 60), st.floats(0.5, 20))


@given(STAGE)
def test_a_seed_depends_on_each_part_of_the_stage_and_survives_as_a_float(
    stage: tuple[int, int, int, int, float],
) -> None:
    seed = model_seed(*stage)
    assert 0 <= seed == int(float(seed)) < 2**53
    for position in range(len(stage)):
        moved = [value + (number == position) for number, value in enumerate(stage)]
        assert model_seed(*moved) != seed


def test_equal_numbers_give_equal_seeds_whatever_their_type() -> None:
    expected = model_seed(7, 1, 10, 15, 2)
    assert model_seed(7, 1, 10, 15, 2.0) == expected
    assert model_seed(np.int64(7), np.int8(1), np.int64(10), np.int32(15), np.float32(2)) == expected


def test_a_seed_is_the_same_on_every_machine() -> None:
    assert [model_seed(1, 0, 10, 15, 5.0), model_seed(1, 1, 10, 15, 2.5)] == [
        8424816379391833686 >> 10,
        347932142339432876 >> 10,
    ]


@pytest.mark.parametrize(("one", "other"), [(2, 2.0), (2, np.int64(2)), (0.1, np.float64(0.1))])
def test_canonical_text_joins_equals(one: object, other: object) -> None:
    assert canonical(one) == canonical(other)


@pytest.mark.parametrize(("one", "other"), [(0.1, 0.1 + 2**-56), (1, True), ("2", 2), (2**60, 2**60 + 1)])
def test_canonical_text_parts_unequals(one: object, other: object) -> None:
    assert canonical(one) != canonical(other)


def test_the_treatment_leaves_seeds_alone_and_a_new_setting_changes_no_other() -> None:
    cells = ((5, 2.0), (10, 3.0))
    one = Experiment("one", {"policy": "a-cmommt"}, cells)
    other = Experiment("other", {"policy": "centroid", "awareness": "ring", "delta": 4}, (*cells, (3, 1.0)))
    seeds = [[columns["seed"] for columns, _ in experiment.rows({}, 3, 2, 10)] for experiment in (one, other)]
    assert seeds[0] == seeds[1][: len(seeds[0])]
    more = [columns["seed"] for columns, _ in one.rows({"robot_speed": 0.3}, 3, 3, 99)]
    assert [more[0:2], more[3:5]] == [seeds[0][0:2], seeds[0][2:4]]


def test_a_policy_is_given_only_the_settings_that_it_listens_to() -> None:
    setting = {"robot_speed": 0.2, "policy_options": {"idle": "stay", "weights": "none"}}
    given_to = {
        name: Experiment("x", {"policy": name}, ((1, 1.0),)).parameters(setting)
        for name in ("a-cmommt", "centroid", "random-walk")
    }
    assert given_to["a-cmommt"]["policy_options"] == {"idle": "stay", "weights": "none"}
    assert given_to["centroid"]["policy_options"] == {"idle": "stay"}
    assert given_to["random-walk"] == {"policy": "random-walk", "robot_speed": 0.2}
    of_an_object = Experiment("x", {"policy": ACmommt()}, ((1, 1.0),)).parameters(setting)
    assert of_an_object == {"policy": ACmommt(), "robot_speed": 0.2}


def test_a_sweep_runs_every_combination_on_the_same_stage() -> None:
    experiment = Experiment(
        "x", {"policy": "a-cmommt"}, ((4, 2.0),), sweep={"delta": (1, 2), "awareness_range": (0.5, 1.0)}
    )
    rows = list(experiment.rows({}, 0, 1, 5))
    assert [(columns["delta"], columns["awareness_range"]) for columns, _ in rows] == [
        (1, 0.5),
        (1, 1.0),
        (2, 0.5),
        (2, 1.0),
    ]
    assert len({columns["seed"] for columns, _ in rows}) == 1
    assert len({run.key for _, run in rows}) == 4


def test_runs_are_the_same_when_their_settings_are_equal() -> None:
    assert Run({"robots": 2, "radius": 2}, 0, 10, 1).key == Run({"radius": 2.0, "robots": 2}, 0, 10, 1).key
    assert Run({"robots": 2}, 0, 10, 1).key != Run({"robots": 2}, 0, 11, 1).key
    one, other = ({"policy_options": options} for options in ({"a": 1, "b": 2}, {"b": 2.0, "a": 1.0}))
    assert Run(one, 0, 10, 1).key == Run(other, 0, 10, 1).key


def test_the_papers_grid_and_the_quick_one() -> None:
    assert len(PAPER.cells) == 270
    assert set(QUICK.cells) < set(PAPER.cells)
