"""Every root seed is in one table, and a world's seed depends on its scenario alone."""

from __future__ import annotations

import ast
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teamsight import analysis
from teamsight.analysis.runs.seeds import ROOTS, canonical, model_seed, root, run_seed

SCENARIO = st.tuples(
    st.integers(-(2**70), 2**70), st.integers(-50, 50), st.integers(1, 60), st.integers(1, 60), st.floats(0.5, 20)
)


def test_no_two_purposes_share_a_root() -> None:
    used = list(chain(*ROOTS.values()))
    assert len(used) == len(set(used))


def test_roots_that_choose_constants_are_refused_by_every_command() -> None:
    given = [purpose for purpose, roots in ROOTS.items() if max(roots) >= 0]
    assert given == [
        "reproduce", "learning curves", "unreliable", "hops", "ceilings", "pursuit", "pursuit: readings", "surround", "foraging",
        "foraging: loads", "pushing", "collecting",
    ]  # fmt: skip
    assert root("reproduce") == 2000


def test_no_other_file_has_a_root_of_its_own() -> None:
    for file in Path(analysis.__path__[0]).rglob("*.py"):
        if file.name == "seeds.py":
            continue
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.keyword) and node.arg in ("root", "roots"):
                assert not any(isinstance(part, ast.Constant) for part in ast.walk(node.value)), (file, node.lineno)


@given(SCENARIO)
def test_a_seed_depends_on_each_part_of_the_scenario_and_survives_as_a_float(
    scenario: tuple[int, int, int, int, float],
) -> None:
    seed = model_seed(*scenario)
    assert 0 <= seed == int(float(seed)) < 2**53
    for position in range(len(scenario)):
        moved = [value + (number == position) for number, value in enumerate(scenario)]
        assert model_seed(*moved) != seed


def test_equal_numbers_give_equal_seeds_whatever_their_type() -> None:
    expected = model_seed(7, 1, 10, 15, 2)
    assert model_seed(7, 1, 10, 15, 2.0) == expected
    assert model_seed(np.int64(7), np.int8(1), np.int64(10), np.int32(15), np.float32(2)) == expected


def test_seeds_are_the_same_on_every_machine() -> None:
    assert model_seed(1, 0, 10, 15, 5.0) == 8424816379391833686 >> 10
    assert model_seed(1, 1, 10, 15, 2.5) == 347932142339432876 >> 10
    assert run_seed(1, 0) == 213134892409397035


@pytest.mark.parametrize(("one", "other"), [(2, 2.0), (2, np.int64(2)), (0.1, np.float64(0.1))])
def test_canonical_text_joins_equals(one: object, other: object) -> None:
    assert canonical(one) == canonical(other)


@pytest.mark.parametrize(("one", "other"), [(0.1, 0.1 + 2**-56), (1, True), ("2", 2), (2**60, 2**60 + 1)])
def test_canonical_text_parts_unequals(one: object, other: object) -> None:
    assert canonical(one) != canonical(other)
