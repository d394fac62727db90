"""Elementary functions: near the exact value over their whole range, and the same bits in machine code and in Python."""

from __future__ import annotations

import math
from collections.abc import Callable
from decimal import Decimal
from functools import cache
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from naive import elementary as slow

from teamsight.core.elementary import atan2, cos_sin, exp, log, modulo, power
from teamsight.core.kernel import Record, kernel, plain, specialise
from teamsight.core.kernel.guard import _as_python

pytestmark = pytest.mark.short

Floats = npt.NDArray[np.float64]
ANY = st.floats()


@kernel
def cos(angle: float) -> float:
    return cos_sin(angle)[0]


@kernel
def sin(angle: float) -> float:
    return cos_sin(angle)[1]


FUNCTIONS: dict[str, Any] = {"exp": exp, "log": log, "power": power, "atan2": atan2, "modulo": modulo, "cos": cos, "sin": sin}
OF_ONE = ("exp", "log", "cos", "sin")


class Call(NamedTuple):
    one: Annotated[Floats, "n"]
    two: Annotated[Floats, "n"]
    out: Annotated[Floats, "n"]


CALL = Record(Call)
call_at = CALL.at
function: Any = None


def _map_one(address: int) -> int:
    call = call_at(address)
    for i in range(call.out.shape[0]):
        call.out[i] = function(call.one[i])
    return 0


def _map_two(address: int) -> int:
    call = call_at(address)
    for i in range(call.out.shape[0]):
        call.out[i] = function(call.one[i], call.two[i])
    return 0


def compiled(name: str, one: Floats, two: Floats) -> Floats:
    entry = specialise(_map_one if name in OF_ONE else _map_two, name, function=FUNCTIONS[name])
    call = Call(one, two, np.empty(len(one)))
    entry(CALL.pack(call))
    return call.out


@cache
def in_python(name: str) -> Callable[..., float]:
    found: Callable[..., float] = _as_python(FUNCTIONS[name].py_func)
    return found


def machine(name: str, *numbers: float) -> float:
    """The value in machine code, after seeing that plain Python has the same."""
    found = compiled(name, *(np.array([number]) for number in (*numbers, 0.0)[:2]))[0]
    with np.errstate(all="ignore"):
        again = in_python(name)(*map(np.float64, numbers))
    assert np.float64(again).tobytes() == found.tobytes() or (again != again and found != found)
    return float(found)


def is_near(found: float, exact: Decimal, ulps: str) -> bool:
    """Whether a value is so many units in the last place from the exact one."""
    if exact >= Decimal(2) ** 1024 - Decimal(2) ** 970:
        return found == math.inf
    error = slow.PRECISION.subtract(Decimal(found), exact).copy_abs()
    return error <= Decimal(ulps) * Decimal(math.ulp(float(exact)))


@given(x=st.floats(-760, 720) | ANY)
@example(x=0.0)
@example(x=709.782712893384)
@example(x=709.7827128933841)
@example(x=-708.3964185322641)
@example(x=-708.3964185322642)
@example(x=-745.1332191019411)
@example(x=-745.1332191019412)
@example(x=5e-324)
def test_exp(x: float) -> None:
    if math.isfinite(x):
        assert is_near(machine("exp", x), slow.exp(min(max(x, -800.0), 800.0)), "0.5001")
    else:
        assert np.array_equal(machine("exp", x), np.exp(x), equal_nan=True)


@given(x=st.floats(0, exclude_min=True, allow_infinity=False) | st.floats(0.5, 2))
@example(x=1.0)
@example(x=math.nextafter(1, 0))
@example(x=math.nextafter(1, 2))
@example(x=math.sqrt(2))
@example(x=math.nextafter(math.sqrt(2), 2))
@example(x=5e-324)
def test_log(x: float) -> None:
    assert is_near(machine("log", x), slow.log(x), "0.5001")


@given(base=st.floats(0, exclude_min=True, allow_infinity=False) | st.floats(0.1, 10), exponent=st.floats(-2, 5) | ANY)
@example(base=5e-324, exponent=0.5)
@example(base=math.nextafter(1, 2), exponent=3e18)
@example(base=math.nextafter(1, 0), exponent=3e18)
def test_power(base: float, exponent: float) -> None:
    if math.isfinite(exponent) and abs(exponent * math.log(base)) < 800:
        assert is_near(machine("power", base, exponent), slow.power(base, exponent), "0.51")
    else:
        with np.errstate(over="ignore"):
            assert np.array_equal(machine("power", base, exponent), np.power(base, exponent), equal_nan=True)


@given(angle=ANY | st.floats(-7, 7) | st.floats(-40, 40))
@example(angle=0.0)
@example(angle=math.pi / 4)
@example(angle=math.pi / 2)
@example(angle=math.pi)
def test_cos_sin(angle: float) -> None:
    found = machine("cos", angle), machine("sin", angle)
    if not abs(angle) < 1e6:
        assert np.isnan(found).all()
    # The slow series loses too many digits beyond.
    elif abs(angle) < 50:
        for one, exact in zip(found, (slow.cos(angle), slow.sin(angle)), strict=True):
            assert abs(Decimal(one) - exact) < Decimal(2) ** -52
    else:
        assert found == pytest.approx((math.cos(angle), math.sin(angle)), abs=2.0**-52)


@given(y=ANY | st.floats(-3, 3), x=ANY | st.floats(-3, 3))
@example(y=1.0, x=1.0)
@example(y=5e-324, x=-5e-324)
@example(y=1e308, x=1.7e308)
@example(y=5e-324, x=1e308)
@example(y=1.7976931348623157e308, x=1.7976931348623157e308)
@example(y=1.7976931348623157e308, x=-1.7976931348623157e308)
@example(y=1.5e-308, x=0.75)
@example(y=2.0**-60, x=1.0)
@example(y=math.nextafter(2.0**-60, 0), x=-1.0)
@example(y=-2.0**-900, x=math.nextafter(2.0**-900, 1))
@example(y=2.0**900, x=math.nextafter(2.0**900, math.inf))
def test_atan2(y: float, x: float) -> None:
    if math.isfinite(y) and math.isfinite(x) and (y or x):
        found = machine("atan2", y, x)
        assert is_near(found, slow.atan2(y, x), "0.5001")
        assert math.copysign(1, found) == math.copysign(1, y)
    else:
        test_the_ends_of_the_range_are_those_of_ieee_754("atan2", y, x)


HALVES = np.arange(0.5, 64.0) / 64
# Where what the tables leave is largest, and where results are subnormal.
HARD = {
    "exp": [np.concatenate([np.arange(-80.5, 80) * math.log(2) / 128, np.linspace(-745.2, -708, 200)])],
    "log": [np.arange(90.5, 181) / 128],
    "power": [np.linspace(0.1, 9, 60), np.linspace(-3, 3, 60)],
    "atan2": [np.concatenate([HALVES, HALVES, np.ones(128)]), np.concatenate([np.ones(64), -np.ones(64), HALVES, -HALVES])],
}


@pytest.mark.parametrize("name", HARD)
def test_the_error_is_small_where_it_is_largest(name: str) -> None:
    found = compiled(name, HARD[name][0], HARD[name][-1])
    for numbers in zip(found.tolist(), *(array.tolist() for array in HARD[name]), strict=True):
        assert is_near(numbers[0], getattr(slow, name)(*numbers[1:]), "0.5001"), numbers


ENDS = (0.0, -0.0, 1.0, -1.0, 5e-324, -5e-324, math.inf, -math.inf, math.nan)


@pytest.mark.parametrize("two", ENDS)
@pytest.mark.parametrize("one", ENDS)
@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_ends_of_the_range_are_those_of_ieee_754(name: str, one: float, two: float) -> None:
    if (name == "power" and math.copysign(1, one) < 0) or (name == "modulo" and not 0 < two < math.inf):
        return
    numbers = (one,) if name in OF_ONE else (one, two)
    with np.errstate(all="ignore"):
        expected = {"atan2": np.arctan2, "modulo": np.mod}.get(name, getattr(np, name, None))(*numbers)
    found = machine(name, *numbers)
    assert np.array_equal(found, expected, equal_nan=True)
    assert math.copysign(1, found) == math.copysign(1, expected) or found != found


@given(number=ANY, period=st.floats(0, exclude_min=True, allow_infinity=False))
@example(number=-0.0, period=1.0)
@example(number=1.7e308, period=5e-324)
@example(number=-5e-324, period=1.5e-323)
def test_modulo(number: float, period: float) -> None:
    expected = number % period if math.isfinite(number) else math.nan
    assert np.array_equal(machine("modulo", number, period), expected, equal_nan=True)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_python_has_the_same_bits_everywhere(name: str) -> None:
    rng = np.random.default_rng(1)
    bits = rng.integers(0, 2**64, (2, 1000), dtype=np.uint64).view(np.float64)
    near = rng.uniform(-40, 40, (2, 1000))
    one, two = np.concatenate([bits, near, near * 2.0**-20], axis=1)
    if name == "modulo":
        two = abs(two)
    with np.errstate(all="ignore"):
        function = in_python(name)
        again = [function(*pair[: 1 if name in OF_ONE else 2]) for pair in zip(one, two, strict=True)]
    assert np.array_equal(compiled(name, one, two), again, equal_nan=True)


def test_python_needs_no_compiler_for_an_angle() -> None:
    angles = np.linspace(-4, 4, 500)
    found = compiled("atan2", np.sin(angles), np.cos(angles))
    assert found.tolist() == [plain(atan2)(y, x) for y, x in zip(np.sin(angles).tolist(), np.cos(angles).tolist(), strict=True)]
