"""Kernels have no machine code of their own, and can be called from entries, other kernels and Python."""

from __future__ import annotations

import pickle
from pathlib import Path

import numba
import pytest

from teamsight.core.kernel import Entry, kernel


@kernel
def power(base, exponent=2):
    """A kernel that calls itself."""
    if exponent == 0:
        return 1
    return base * power(base, exponent - 1)


@kernel
def is_even(number):
    if number == 0:
        return True
    return is_odd(number - 1)


@kernel
def is_odd(number):
    if number == 0:
        return False
    return is_even(number - 1)


@kernel
def twice(number):
    return 2 * number


@numba.njit
def of_a_user(base, exponent):
    return power(base, exponent) + 1


def by_address(address):
    return twice(power(2, address)) + of_a_user(3, address)


def in_a_circle(address):
    return 1 if is_even(address) else 0


@pytest.fixture(autouse=True)
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TEAMSIGHT_CACHE_DIR", str(tmp_path))


def test_an_entry_holds_the_code_of_its_parts() -> None:
    compiled, loaded = Entry(by_address), Entry(by_address)
    assert [compiled(4), loaded(4), loaded(0)] == [114, 114, 4]
    for part in twice.dispatcher.overloads.values():
        assert not part.library.codegen._engine.is_symbol_defined(part.fndesc.llvm_func_name)


def test_python_calls_a_kernel_as_a_whole() -> None:
    assert (power(2, 10), power(3), of_a_user(2, 3)) == (1024, 9, 9)
    assert pickle.loads(pickle.dumps(power))(2, exponent=3) == 8
    with pytest.raises(TypeError, match="missing a required argument: 'base'"):
        power()


def test_where_numba_compiles_nothing_kernels_are_python_and_entries_say_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numba.config, "DISABLE_JIT", 1)
    twice.__dict__.pop("_whole", None)
    assert twice(4) == 8
    twice.__dict__.pop("_whole", None)
    with pytest.raises(TypeError, match="because NUMBA_DISABLE_JIT is set; unset it"):
        Entry(by_address)(4)


def test_kernels_in_a_circle_are_refused() -> None:
    """Their code would crash when it is loaded from the cache."""
    for _ in range(2):
        with pytest.raises(TypeError, match=r"call each other in a circle, by way of is_(even|odd)\(\); use a loop"):
            Entry(in_a_circle)(3)
