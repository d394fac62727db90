"""Runs of guarded kernels: the names of their arrays, and the errors for accesses outside of them."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from teamsight.core.kernel import Entry, Packed
from teamsight.core.kernel.fences import Fences
from teamsight.core.kernel.guard import Access, watched


class Axis(NamedTuple):
    """An axis of an array: the name of its elements, and the cure for a wrong index."""

    what: str
    cure: str


class Named(NamedTuple):
    """An array of a guarded kernel: its name in the kernel, and its axes."""

    name: str
    axes: tuple[Axis, ...]


def run_guarded(
    owner: str, kernel: str, entry: Callable[[Packed[Any]], int], record: Packed[Any], arrays: Sequence[Named],
    fences: Fences | None = None,
) -> int:  # fmt: skip
    """Run the entry of a guarded kernel on a record; return its status.

    Parameters
    ----------
    owner : str
        The class of the kernel, for errors.
    kernel : str
        The kernel's name, for errors.
    entry : callable
        The entry.
    record : Packed
        The record.
    arrays : sequence of Named
        The arrays by number; see `GuardedRecord`.
    fences : Fences, optional
        The fences around these arrays.

    Raises
    ------
    ValueError
        If the kernel reads or writes outside of its arrays, writes into a read-only one, or raises an exception.
    """
    with watched() as watch:
        status = entry(record)
    if watch.accesses:
        access = watch.accesses[0]
        raise ValueError(f"{owner}: {access.place}: {kernel} {_account(access, arrays)}")
    if watch.raised:
        error = watch.raised[0]
        raise ValueError(
            f"{owner}: {kernel} raises {type(error).__name__}({str(error)[:80]!r}); exceptions of kernels are lost in "
            "a world: check indices and values where they are used"
        )
    if fences and (broken := fences.broken()):
        raise ValueError(
            f"{owner}: {kernel} writes next to {broken}, or into it although it is read-only; index arrays within "
            "their shape"
        )
    return status


def _account(access: Access, arrays: Sequence[Named]) -> str:
    named = arrays[access.array]
    if access.axis < 0:
        return f"writes into {named.name}, which is read-only; copy its numbers and change the copy"
    # Views have lost axes from the left.
    axis = len(named.axes) - access.dimensions + access.axis
    what, cure = named.axes[axis] if 0 <= axis < len(named.axes) else ("elements", "stay within its shape")
    if access.at < 0:
        cure = "indices count from 0, and negative ones do not count from the end"
    return f"uses index {access.at} of {named.name}, whose number of {what} is {access.size}; {cure}"


def machine_code(owner: str, kernel: str, entry: Entry, plain: Entry) -> Entry | None:
    """Return the entry of a guarded kernel once it is compiled.

    Parameters
    ----------
    owner, kernel : str
        The class and the name of the kernel, for the warning.
    entry : Entry
        The entry of the guarded kernel.
    plain : Entry
        The entry of the kernel as worlds run it.

    Returns
    -------
    Entry or None
        None, with a warning, if the kernel compiles for worlds but not on guarded arrays.

    Raises
    ------
    TypeError
        If the kernel cannot be compiled for worlds.
    """
    try:
        entry.address  # noqa: B018
    except TypeError as error:
        # Raises if the mistake is in the kernel.
        plain.address  # noqa: B018
        warnings.warn(
            f"{owner}: the memory accesses of {kernel} are not checked, since it uses arrays in a way that guarded "
            f"arrays do not support ({error}); use their elements one by one",
            stacklevel=2,
        )
        return None
    return entry
