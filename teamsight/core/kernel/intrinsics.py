"""Functions that numba lacks, such as arrays at an address and calls of other entries: in plain Python, what each does.

In kernels their machine code runs, which `teamsight.core.kernel.generators` writes; it checks no bounds of arrays.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterable
from typing import Any

import numpy as np

from teamsight.core.kernel.parts import inlined, intrinsic


@intrinsic
def array_at(address: Any, shape: Any, dtype: Any) -> Any:
    """Return the array of this shape and dtype, in C order, at an address.

    `shape` is an int or a tuple of int, `dtype` a constant: a type such as ``np.float64``, or a structured dtype.
    """
    size = int(np.prod(shape)) * np.dtype(dtype).itemsize
    return np.frombuffer((ctypes.c_char * size).from_address(int(address)), dtype).reshape(shape)


@intrinsic
def scratch(count: Any, dtype: Any) -> Any:
    """Return an uninitialised array of `count` numbers on the stack, valid until the present entry returns.

    `count` and `dtype` are constants. Each execution of the line in a call returns the same array: clear it before use.
    """
    return np.empty(count, dtype)


def _word(bits: Iterable[Any]) -> Any:
    return np.uint64(sum(1 << place for place, bit in enumerate(bits) if bit))


@intrinsic
def below_8(values: Any, first: Any, limit: Any) -> Any:
    """Return a word in which bit i is set if ``values[first + i] < limit``, for 8 float32 that lie side by side."""
    return _word(values[first + i] < limit for i in range(8))


@intrinsic
def below_64(values: Any, first: Any, limit: Any) -> Any:
    """Return a word in which bit i is set if ``values[first + i] < limit``, for 64 float32 that lie side by side."""
    return _word(values[first + i] < limit for i in range(64))


@intrinsic
def ones(word: Any) -> Any:
    """Return the number of bits of a word that are set."""
    return int(word).bit_count()


@intrinsic
def trailing_zeros(word: Any) -> Any:
    """Return the number of zeros below the lowest bit of a word of 64 bits that is set; 64 if none is."""
    return (int(word) & -int(word)).bit_length() - 1 if word else 64


@inlined
def lowest_bit(word: Any) -> tuple[Any, Any]:
    """Return the number of the lowest bit of a word of 64 bits that is set, unsigned, and the word without it."""
    return np.uint64(trailing_zeros(word)), word & (word - np.uint64(1))


@intrinsic
def bits_of(number: Any) -> Any:
    """Return the bits of a float64 as a word."""
    return np.float64(number).view(np.uint64)


@intrinsic
def float_of(word: Any) -> Any:
    """Return the float64 with these bits."""
    return np.uint64(word).view(np.float64)


@intrinsic
def near_eight(xs: Any, ys: Any, first: Any, x: Any, y: Any, limit: Any) -> Any:
    """Return a word in which bit i is set if point ``first + i`` is within the squared distance, for 8 points."""
    return _word((xs[first + i] - x) ** 2 + (ys[first + i] - y) ** 2 <= limit for i in range(8))


@intrinsic
def near_eight_in_square(xs: Any, ys: Any, first: Any, x: Any, y: Any, limit: Any) -> Any:
    """Return a word in which bit i is set if point ``first + i`` is within `limit` along both axes, for 8 points."""
    return _word(abs(xs[first + i] - x) <= limit and abs(ys[first + i] - y) <= limit for i in range(8))


@intrinsic
def put_eight_parts(values: Any, first: Any, low: Any, factor: Any, out: Any, at: Any) -> None:
    """Write the nearest whole numbers to ``(values - low) * factor``, minus 32,768, for 8 elements from `first` on.

    `values` is an array of float64, `out` one of int16; what is written must be in its range. `low` and `factor` are
    tuples of two float64: for every other element, from the first on, and for those after them.
    """
    for i in range(8):
        out[at + i] = int((values[first + i] - low[i % 2]) * factor[i % 2] + 0.5) - 32_768


@intrinsic
def put_eight_bytes(values: Any, first: Any, out: Any, at: Any) -> None:
    """Write the lowest bytes of 8 int64, from `first` on, into an array of uint8."""
    for i in range(8):
        out[at + i] = int(values[first + i]) & 0xFF


@intrinsic
def equal_eight(values: Any, first: Any, one: Any, other: Any) -> Any:
    """Return a word in which bit i is set if ``values[first + i]`` is one of two numbers, for 8 int64."""
    return _word(values[first + i] in (one, other) for i in range(8))


@intrinsic
def call(entry: Any, record: Any) -> Any:
    """Call the entry at address `entry` on the record at address `record`; return its status."""
    return ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)(entry)(record)
