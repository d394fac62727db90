"""Runs of guarded kernels: the names of their arrays, and the errors for accesses outside of them."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from teamsight.core.kernel import Entry, Packed
from teamsight.core.kernel.guard import Access, watched


class Axis(NamedTuple):
    """An axis of an array: what its elements are, and the cure for an index that does not exist."""

    what: str
    cure: str


class Named(NamedTuple):
    """An array of a guarded kernel: its name as the kernel writes it, and its axes."""

    name: str
    axes: tuple[Axis, ...]


OWN = Named("an array of its own", ())


def run_guarded(
    owner: str, kernel: str, entry: Callable[[Packed[Any]], int], record: Packed[Any], arrays: Sequence[Named]
) -> int:
    """Run the entry of a guarded kernel on a record; return its status.

    Parameters
    ----------
    owner : str
        Whose kernel it is, for errors.
    kernel : str
        What the kernel is called, for errors.
    entry : callable
        The entry.
    record : Packed
        The record.
    arrays : sequence of Named
        The arrays by number; see `GuardedRecord`.

    Raises
    ------
    ValueError
        If the kernel reads or writes outside of its arrays, writes into one that it may only read, or raises.
    """
    with watched() as watch:
        status = entry(record)
    if watch.accesses:
        access = watch.accesses[0]
        raise ValueError(f"{owner}: {access.place}: {kernel} {_account(access, arrays)}")
    if watch.raised:
        error = watch.raised[0]
        raise ValueError(
            f"{owner}: {kernel} raises {type(error).__name__}({str(error)[:80]!r}); a world cannot see exceptions of "
            "kernels: check indices and values where they are used"
        )
    return status


def _account(access: Access, arrays: Sequence[Named]) -> str:
    named = arrays[access.array] if access.array else OWN
    if access.axis < 0:
        return f"writes into {named.name}, which it may only read; copy its numbers and change the copy"
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
        Whose kernel it is and what it is called, for the warning.
    entry : Entry
        The entry of the guarded kernel.
    plain : Entry
        That of the kernel as worlds run it.

    Returns
    -------
    Entry or None
        None, and a warning, where guarded arrays cannot do what the kernel does with its own.

    Raises
    ------
    TypeError
        If the kernel cannot be compiled for worlds either.
    """
    try:
        entry.address  # noqa: B018
    except TypeError as error:
        # A mistake in the kernel is named by what worlds run. If there is none, the guard is to blame.
        plain.address  # noqa: B018
        warnings.warn(
            f"{owner}: the accesses of {kernel} to memory are not checked, since guarded arrays cannot do what it does "
            f"with arrays ({error}); take their elements one by one",
            stacklevel=2,
        )
        return None
    return entry
