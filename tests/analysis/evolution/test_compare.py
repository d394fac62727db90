"""The screening of A-CMOMMT: which combinations it tries, and that it tries each once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd
import pytest

from teamsight.analysis.evolution import compare
from teamsight.analysis.runs.experiment import Grid
from teamsight.policies import ACmommt

USUAL = {"turn_probability": 0.05, "gain": 1.0}


@pytest.fixture
def tried(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """The options that are screened; wandering and a large gain are made to look best."""
    found: list[dict[str, Any]] = []

    def observed(options: Sequence[Mapping[str, Any]], *given: Any) -> pd.DataFrame:
        found.extend(map(dict, options))
        table = pd.DataFrame(options)
        value = table["gain"] + 10 * (table["idle"] == "wander") + 5 * (table["weights"] == "shared")
        return table.assign(observed=value).sort_values("observed", ascending=False, kind="stable")

    monkeypatch.setattr(compare, "_observed", observed)
    return found


def test_rules_are_screened_first_and_constants_under_the_best_three(tried: list[dict[str, Any]]) -> None:
    table = compare.screen(1)
    rules, constants = tried[:24], tried[24:]
    assert compare.default_constants() == USUAL == {name: getattr(ACmommt(), name) for name in USUAL}
    assert all(one | USUAL == one for one in rules)
    assert len({tuple(one.items()) for one in rules}) == 24
    # 5 gains and 4 turn probabilities without the default ones, which were screened with the rules.
    assert len(constants) == len({tuple(one.items()) for one in constants}) == 3 * 19
    assert {one["idle"] for one in constants} == {"wander"}
    assert len(table) == len(tried)
    best = compare.options_of(table)[0]
    assert (best["idle"], best["weights"], best["gain"]) == ("wander", "shared", 8.0)
    ACmommt(**best)


def test_robots_that_do_not_wander_have_no_turn_probability(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, values in (("idle", ("stay",)), ("idle_when", ("no-force",)), ("weights", ("none",))):
        monkeypatch.setitem(compare.RULES, name, values)  # type: ignore[arg-type]
    monkeypatch.setattr(compare, "GRID", Grid((2,), (2.0,)))
    monkeypatch.setattr(compare, "STEPS", 3)
    table = compare.screen(1)
    assert sorted(table["gain"]) == [0.5, 1.0, 2.0, 4.0, 8.0]
    assert set(table["turn_probability"]) == {0.05}
