"""Compiled kernels: rules written in Python become machine code that is built once per machine.

A *kernel* is a function that numba can compile: arrays in, arrays out. An *entry* is a compiled function with the
signature ``int64 (int64)``: it takes the address of a record, finds its arrays there and calls kernels on them. Because
all entries have one signature, a loop can call any policy, degree of awareness or arena; each is compiled once, and not
once per combination. Only this folder uses numba, and only to compile: what is in the cache runs without it.

Entries are cached on disk under a digest of all their code; see `teamsight.core.kernel.cache`.
"""

from __future__ import annotations

from teamsight.core.kernel.entry import Entry, specialise
from teamsight.core.kernel.intrinsics import (
    array_at,
    below_8,
    below_64,
    bits_of,
    call,
    equal_eight,
    float_of,
    lowest_bit,
    near_eight,
    near_eight_in_square,
    ones,
    put_eight_bytes,
    put_eight_parts,
    scratch,
    trailing_zeros,
)
from teamsight.core.kernel.parts import inlined, kernel, plain
from teamsight.core.kernel.record import Packed, Record

__all__ = [
    "Entry", "Packed", "Record", "array_at", "below_8", "below_64", "bits_of", "call", "equal_eight", "float_of",
    "inlined", "kernel", "lowest_bit", "near_eight", "near_eight_in_square", "ones", "plain", "put_eight_bytes",
    "put_eight_parts", "scratch", "specialise", "trailing_zeros",
]  # fmt: skip
