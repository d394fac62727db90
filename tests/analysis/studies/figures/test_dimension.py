"""Levels of axes: their order, their texts, and their scale."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teamsight.analysis.studies.figures.cells import dimension_of, text_of

pytestmark = pytest.mark.short


@given(st.lists(st.integers(-50, 50) | st.floats(-1e3, 1e3), min_size=1, max_size=20))
def test_numbers_are_in_ascending_order(values: list[float]) -> None:
    found = dimension_of(pd.DataFrame({"axis": values}), ["axis"])
    assert found.numbers is not None
    assert found.numbers.tolist() == sorted(set(map(float, values)))
    assert found.numbers[found.levels].tolist() == [float(one) for one in values]
    assert len(set(found.texts)) == len(found.texts)


@given(st.lists(st.text(max_size=60), min_size=1, max_size=12))
def test_texts_keep_the_order_of_the_study_and_stay_different(values: list[str]) -> None:
    found = dimension_of(pd.DataFrame({"axis": pd.Series(values, dtype=object)}), ["axis"])
    assert found.numbers is None
    assert [one for (one,) in found.values] == list(dict.fromkeys(values))
    assert [found.values[level][0] for level in found.levels] == values
    assert len(set(found.texts)) == len(found.texts)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (3, "3"), (3.0, "3"), (0.123456, "0.1235"), (1e-7, "1e-07"), (123456, "123456"), (2.5e9, "2.5e+09"),
        (True, "true"), ("a-cmommt", "a-cmommt"), ("my.module:Nearest", "Nearest"), ("a note: with spaces", "a note: with spaces"),
        (json.dumps({"use": "my.module:Nearest", "gain": 0.5, "on": True}), "Nearest(gain=0.5, on=true)"), ("{broken", "{broken"),
    ],
)  # fmt: skip
def test_values_are_written_briefly(value: object, text: str) -> None:
    assert text_of(value) == text


def test_long_texts_keep_beginning_and_end() -> None:
    names = ["my.module:Follow_the_nearest_target_with_care", "my.module:Follow_the_nearest_target_in_haste"]
    found = dimension_of(pd.DataFrame({"policy": names}), ["policy"])
    assert [len(text) for text in found.texts] == [26, 26]
    assert [text[:5] + text[-5:] for text in found.texts] == ["Follo_care", "Follohaste"]


@pytest.mark.parametrize(
    ("values", "is_logarithmic"),
    [
        ([1, 2, 4, 8, 16], True), ([1, 2, 5, 10, 20, 50], True), (np.geomspace(0.01, 1, 7).tolist(), True),
        (list(range(1, 31)), False), ([1, 2, 4], False), ([0, 1, 10, 100], False), ([1, 100], False), (["a", "b", "c"], False),
    ],
)  # fmt: skip
def test_numbers_that_multiply_are_on_a_logarithmic_scale(values: list[Any], is_logarithmic: bool) -> None:
    assert dimension_of(pd.DataFrame({"axis": values}), ["axis"]).is_logarithmic == is_logarithmic


def test_axes_that_advance_together_are_numbers_only_if_the_first_differ() -> None:
    table = pd.DataFrame({"robots": [8, 2, 4], "targets": [1, 1, 9]})
    found = dimension_of(table, ["robots", "targets"])
    assert found.texts == ("2, 1", "4, 9", "8, 1")
    assert found.levels.tolist() == [2, 0, 1]
    assert dimension_of(table, ["targets", "robots"]).numbers is None


def test_levels_that_no_setting_has_are_left_out() -> None:
    found = dimension_of(pd.DataFrame({"robots": [2, 4, 8, 4]}), ["robots"]).among(np.array([False, True, True, True]))
    assert found.texts == ("4", "8")
    assert found.levels.tolist() == [0, 1, 0]
