"""The evolved policy against its slow twin, and the file of its constants."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from chance import generator
from naive.evolved import EvolvedRobot
from naive.watched import watch

from teamsight import CMOMMT
from teamsight.policies.evolved import SIZE, Evolved, beginning, silenced

RULES = [Evolved(), Evolved(tuple(beginning(3))), Evolved(tuple(np.random.default_rng(5).normal(0, 0.5, SIZE)))]


@pytest.mark.parametrize("awareness", ["ring", "pairwise"])
@pytest.mark.parametrize("policy", RULES, ids=["shipped", "beginning", "random"])
def test_the_rule_is_that_of_its_slow_twin(policy: Evolved, awareness: str) -> None:
    watch(policy, EvolvedRobot, awareness, 1e-6)


def test_the_file_brings_the_constants_back_to_the_last_bit(tmp_path: Path) -> None:
    constants = generator().normal(size=SIZE)
    path = tmp_path / "rule.json"
    path.write_text(json.dumps(Evolved(tuple(constants)).content({})), encoding="utf-8")
    assert Evolved.load(path).constants == tuple(constants)
    assert Evolved.load(path) == Evolved(tuple(constants)) != Evolved()


def test_what_is_shipped_is_the_default_and_says_what_made_it() -> None:
    assert Evolved().constants == Evolved.shipped()
    assert repr(Evolved()) == "Evolved()"
    assert repr(Evolved(tuple(beginning(1)))) != repr(Evolved(tuple(beginning(2))))
    assert pickle.loads(pickle.dumps(Evolved())) == Evolved()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda content: content.pop("constants"), "holds no constants"),
        (lambda content: content.update(schema=99), "has the schema 99, but this version reads 1"),
        (lambda content: content["constants"].pop("drives"), "holds no constants.*drives"),
        (lambda content: content["constants"]["teammate_law"].pop(), r"teammate_law has the shape \(5,\), not \(6,\)"),
        (lambda content: content["constants"]["scalars"].__setitem__(2, "fast"), "scalars: could not convert"),
        (lambda content: content["constants"]["scalars"].__setitem__(2, float("nan")), "is not finite"),
    ],
)
def test_a_bad_file_is_refused(change: Any, message: str, tmp_path: Path) -> None:
    content = Evolved(tuple(beginning(1))).content({})
    change(content)
    path = tmp_path / "rule.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(ValueError, match=message):
        Evolved.load(path)


def test_half_a_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "rule.json"
    path.write_text(json.dumps(Evolved(tuple(beginning(1))).content({}))[:500], encoding="utf-8")
    with pytest.raises(ValueError, match="holds no constants of Evolved"):
        Evolved.load(path)


@pytest.mark.parametrize(("constants", "message"), [((1.0,) * 5, r"the shape \(5,\)"), ((np.inf,) * SIZE, "number 0")])
def test_wrong_constants_are_refused(constants: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Evolved(constants)


def test_without_teammates_in_sight_it_is_refused() -> None:
    with pytest.raises(ValueError, match="needs 'teammates', which awareness 'none' does not deliver"):
        CMOMMT(policy="evolved", awareness="none")


def test_silenced_networks_say_nothing() -> None:
    rule = np.array(Evolved.shipped())
    assert np.count_nonzero(silenced(rule, "both networks") != rule) == 18 + 6
    assert np.count_nonzero(silenced(rule, "memory of area and trail") != rule) == 4 * 8
