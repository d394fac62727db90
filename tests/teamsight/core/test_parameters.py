"""The constants of a component, by default the fields of a dataclass."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from teamsight.core.contracts import parameters_of


class Base:
    draws: int = 0


@dataclass
class Rule(Base):
    gain: float
    is_fast: bool
    count: int
    draws: int = 2


def test_fields_are_constants_in_their_order_and_declarations_are_not() -> None:
    assert parameters_of(Rule(0.5, True, 3), Base) == (0.5, 1.0, 3.0)


def test_a_class_without_attributes_has_no_constants() -> None:
    class Plain(Base):
        draws = 1

    plain = Plain()
    plain.draws = 3
    assert parameters_of(plain, Base) == ()


def test_attributes_that_a_kernel_would_not_get_are_named() -> None:
    class Plain(Base):
        def __init__(self) -> None:
            self.gain = 0.5

    with pytest.raises(TypeError, match=r"Plain: has the attribute 'gain'.*dataclass.*parameters"):
        parameters_of(Plain(), Base)


def test_a_field_that_is_not_a_number_is_named() -> None:
    with pytest.raises(TypeError, match=r"Rule\.gain='high': is not a number.*parameters"):
        parameters_of(Rule("high", True, 3), Base)  # type: ignore[arg-type]
