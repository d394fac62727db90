"""The paper's formulas for the search space, worked out by hand here."""

from __future__ import annotations

import pytest

from teamsight.agents.awareness import AWARENESS
from teamsight.analysis import search_space


@pytest.mark.parametrize(
    ("degree", "one", "thirty"), [("none", 16, 16), ("ring", 32, 32), ("pairwise", 18, 76), ("shared", 32, 496), ("nearest", 48, 48)]
)
def test_inputs_are_those_of_figure_2(degree: str, one: int, thirty: int) -> None:
    assert search_space.inputs(degree, 1) == one
    assert search_space.inputs(degree, 30) == thirty


def test_other_constants_are_used() -> None:
    given = {"own": 3, "delta": 5, "sigma": 7}
    assert [search_space.inputs(degree, 2, **given) for degree in ("none", "ring", "pairwise", "shared")] == [
        3,
        8,
        17,
        9,
    ]


def test_the_size_of_the_largest_search_space_does_not_overflow() -> None:
    assert search_space.log10_size(496, 10) == pytest.approx(496.0)


def test_table_is_tidy_and_covers_the_figure() -> None:
    table = search_space.dimensions_table()
    assert len(table) == len(AWARENESS) * 30
    assert not table.duplicated(["degree", "team_size"]).any()
    assert (table["inputs"] == table["own"] + table["added"]).all()
    assert table.query("degree == 'shared'")["inputs"].diff().dropna().eq(16).all()  # linear in N: Θ(N), not o(N)


def test_table_takes_an_iterator() -> None:
    assert len(search_space.dimensions_table(iter((1, 2)))) == 2 * len(AWARENESS)
    assert set(search_space.dimensions_table([1], degrees=search_space.TOUZET)["degree"]) == {*AWARENESS} - {"nearest", "relayed"}


def test_bad_input_names_value_limit_and_cure() -> None:
    with pytest.raises(ValueError, match="degree='rign': unknown; did you mean 'ring'"):
        search_space.inputs("rign", 3)
    with pytest.raises(ValueError, match="team_size=0: must be at least 1"):
        search_space.inputs("ring", 0)
    with pytest.raises(ValueError, match="delta=0"):
        search_space.inputs("ring", 3, delta=0)
