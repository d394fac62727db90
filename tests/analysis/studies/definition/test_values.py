"""Values of a study: immutable, JSON-like, with one text for equal values."""

from __future__ import annotations

import copy
import json
import math
import pickle
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teamsight.analysis.studies.definition.values import Table, are_equal, frozen, stored, text_of, thawed

NUMBERS = st.integers(-(2**63) + 1, 2**63 - 1) | st.floats(allow_nan=False, allow_infinity=False)
TEXTS = st.text(st.characters(codec="utf-8"), max_size=8)
VALUES = st.recursive(
    st.none() | st.booleans() | NUMBERS | TEXTS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(TEXTS, inner, max_size=4),
    max_leaves=12,
)


@given(VALUES)
def test_values_return_from_json_to_the_last_bit(value: Any) -> None:
    held = frozen("x", value)
    assert thawed(held) == value
    again = frozen("x", json.loads(json.dumps(thawed(held))))
    assert repr(again) == repr(held)
    assert are_equal(again, held)
    assert repr(pickle.loads(pickle.dumps(held))) == repr(copy.deepcopy(held)) == repr(held)


@given(VALUES, VALUES)
def test_texts_are_equal_where_values_are(one: Any, other: Any) -> None:
    one, other = frozen("x", one), frozen("x", other)
    if text_of(one) == text_of(other):
        assert one == other
    assert are_equal(one, other) == (text_of(one) == text_of(other))


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (2, 2.0), (np.int32(2), 2), (np.float32(0.5), 0.5), (0.0, -0.0), ([1, 2.0], (1.0, 2)), (np.arange(3), [0, 1, 2]),
        ({"a": 1, "b": [2]}, {"b": [2.0], "a": 1}), (np.True_, True), (np.str_("a"), "a"), (range(2), [0, 1]),
    ],
)  # fmt: skip
def test_equal_values(one: Any, other: Any) -> None:
    one, other = frozen("x", one), frozen("x", other)
    assert are_equal(one, other)
    assert text_of(one) == text_of(other)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (1, True),
        (0, False),
        ("1", 1),
        ("True", True),
        ([1], 1),
        ([[]], []),
        ({"a": 1}, ["a", 1]),
        ("[1]", [1]),
        (None, "None"),
    ],
)
def test_unequal_values(one: Any, other: Any) -> None:
    one, other = frozen("x", one), frozen("x", other)
    assert not are_equal(one, other)
    assert text_of(one) != text_of(other)


def test_tables_cannot_be_changed() -> None:
    table = frozen("x", {"a": [1]})
    with pytest.raises(TypeError, match=r"dataclasses.replace"):
        table["b"] = 1
    for change in (
        table.clear,
        table.popitem,
        lambda: table.update(b=1),
        lambda: table.pop("a"),
        lambda: table.setdefault("b"),
    ):
        with pytest.raises(TypeError, match="cannot be changed"):
            change()
    with pytest.raises(TypeError, match="cannot be changed"):
        table |= {"b": 1}
    with pytest.raises(TypeError, match="cannot be changed"):
        del table["a"]
    assert table == Table({"a": (1,)})


def test_a_list_that_is_changed_later_changes_nothing() -> None:
    given = [1, {"a": [2]}]
    held = frozen("x", given)
    given[1]["a"].append(3)  # type: ignore[index]
    assert thawed(held) == [1, {"a": [2]}]
    thawed(held)[1]["a"].append(3)
    assert thawed(held) == [1, {"a": [2]}]


def deep(levels: int) -> Any:
    value: Any = 1
    for _ in range(levels):
        value = [value]
    return value


@pytest.mark.short
@pytest.mark.parametrize(
    ("value", "words"),
    [
        (math.nan, ["x=nan", "finite"]),
        ([1.0, -math.inf], ["x[1]=-inf", "finite"]),
        ({"a": {"b": math.inf}}, ["x.a.b=inf", "finite"]),
        (np.float32("nan"), ["x=np.float32(nan)", "finite"]),
        (Fraction(10**400), ["x=Fraction(1", "finite"]),
        (2**63, ["x=9223372036854775808", "2^63 - 1"]),
        ([1, -(10**999)], ["x[1]=-(about 10^999)", "2^63 - 1"]),
        (deep(20), ["more than 16 lists", "flatter"]),
        (deep(5000), ["more than 16 lists", "flatter"]),
        ({1: 2}, ["key 1", "text"]),
        ("a" * 20_000, ["20000 characters", "at most 10000"]),
        ("\ud800", ["no valid text"]),
    ],
    ids=["nan", "inf", "deep", "numpy", "fraction", "integer", "huge", "nested", "far", "key", "text", "surrogate"],
)
def test_what_no_study_can_hold(value: Any, words: list[str]) -> None:
    with pytest.raises((TypeError, ValueError), match="^x") as error:
        frozen("x", value)
    assert len(str(error.value)) < 300
    for word in words:
        assert word in str(error.value)


@pytest.mark.parametrize(
    ("value", "kind", "cell"),
    [
        (5, "int", 5), (5.0, "int", 5), (5, "number", 5.0), (True, "flag", True), ("a b", "text", "a b"),
        (1.5, "text", "1.5"), (None, "text", "null"), ({"b": 1, "a": ["ü"]}, "text", '{"a": ["ü"], "b": 1}'),
    ],
)  # fmt: skip
def test_cells_of_columns(value: Any, kind: str, cell: Any) -> None:
    found = stored(value, kind)
    assert found == cell
    assert type(found) is type(cell)
