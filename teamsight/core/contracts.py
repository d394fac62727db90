"""What the checks of components share: their declarations, their samples, and the neighbour lists that they write."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.component import check_options, declared
from teamsight.core.neighbour_list import NeighbourList, filled
from teamsight.core.registry import Registry

Floats = npt.NDArray[np.float64]

_UNWRITTEN = -7_777_777
_AMPLE = 10_000
# Nothing changes between two calls, so the room that the first call returns must suffice.
_MOST_CALLS = 3


def class_name(component: Any, base: type, example: str) -> str:
    """Return the name of a component's class; refuse what is no object of a subclass of `base`."""
    if isinstance(component, type):
        raise TypeError(f"{component.__name__}: is a class; give an object, such as {example}")
    if not isinstance(component, base):
        raise TypeError(
            f"{checks.shown(component)}: must be an object of a subclass of {base.__name__}, such as {example}"
        )
    return type(component).__name__


def object_of(parameter: str, value: Any, known: Registry[Any], base: type) -> Any:
    """Return the component that a user gives, as an object or by name.

    Parameters
    ----------
    parameter : str
        What errors call it.
    value : object
        An object, a name, or "module:Class".
    known : Registry
        The classes by name.
    base : type
        The class from which they derive.

    Raises
    ------
    TypeError, ValueError
        If the name is unknown, the class needs settings, or it is no object of a subclass of `base`.
    """
    if isinstance(value, str) and known.is_built_in(value):
        return _built_in(known, value)
    found = known[checks.choice(parameter, value, known)] if isinstance(value, str) else value
    if isinstance(value, str) and isinstance(found, type) and issubclass(found, base):
        check_options(parameter, value, (), declared(found))
        found = found()
    if not isinstance(found, base):
        shown = f"{value.__name__}: is a class; give an object" if isinstance(value, type) else checks.shown(value)
        raise TypeError(f"{parameter}={shown}: must be a {base.__name__}, or one of {', '.join(known)}")
    return found


def is_own(component: Any) -> bool:
    """Return whether a component is of a class of the user's own."""
    return not type(component).__module__.startswith("teamsight.")


@cache
def _built_in(known: Registry[Any], name: str) -> Any:
    """Return one of ours with its defaults: immutable, so that all worlds share it."""
    return known[name]()


def numbers(what: str, value: Any, dimensions: int = 1, *, are_finite: bool = True) -> npt.NDArray[Any]:
    """Return numbers as an array; refuse anything else, and, by default, numbers that are not finite.

    Raises
    ------
    TypeError, ValueError
        With `what` and the value.
    """
    try:
        # A table can be large; it is not copied.
        array = value if isinstance(value, np.ndarray) else np.asarray(value, float)
    except (TypeError, ValueError):
        array = np.array("")
    is_wrong = array.ndim != dimensions or array.dtype.kind not in "fiub"
    if is_wrong or (are_finite and not np.isfinite(array).all()):
        example = (1.0, 2.0) if dimensions == 1 else "np.zeros((3, 2))"
        raise (TypeError if is_wrong else ValueError)(
            f"{what}={checks.shown(value, 100)}: must be {'finite ' * are_finite}numbers in {dimensions} "
            f"dimension{'s' * (dimensions > 1)}, such as {example}"
        )
    return array


def check_names(what: str, names: Any, example: str) -> None:
    """Refuse what is not a tuple of names."""
    if not isinstance(names, tuple) or not all(isinstance(name, str) for name in names):
        example = f"({names!r},)" if isinstance(names, str) else example
        raise TypeError(f"{what}={checks.shown(names)}: must be a tuple of names, such as {example}")


def random_headings(size: int, rng: np.random.Generator) -> Floats:
    """Return unit vectors, shape (size, 2)."""
    angle = rng.uniform(0, 2 * np.pi, size)
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def are_equal(arrays: Iterable[Any], others: Iterable[Any]) -> bool:
    """Return whether arrays are equal, one by one; NaN equals NaN."""
    return all(
        np.array_equal(one, other, equal_nan=np.asarray(one).dtype.kind == "f")
        for one, other in zip(arrays, others, strict=True)
    )


def neighbours_of(rows: slice, graph: NeighbourList, identity: Any = None) -> NeighbourList:
    """Return the neighbours of some observers, with these identities in place of rows of what was searched."""
    start = graph.start[rows.start : rows.stop + 1]
    entries = slice(start[0], start[-1])
    place = graph.identity[entries]
    return NeighbourList(
        start - start[0], place if identity is None else identity[place], graph.offset[entries], graph.distance[entries]
    )


def unwritten_list(observers: int, room: int) -> NeighbourList:
    """Return a neighbour list filled with values that show what was not written."""
    return NeighbourList(
        np.full(observers + 1, _UNWRITTEN), np.full(room, _UNWRITTEN), np.full((room, 2), np.nan), np.full(room, np.nan)
    )


Lists = dict[str, NeighbourList]


def lists_written(what: str, run: Callable[[int], tuple[int, Lists]], room: int = _AMPLE) -> Lists:
    """Return the neighbour lists that a kernel writes, each with its beginnings checked.

    Parameters
    ----------
    what : str
        The kernel and its owner, for errors.
    run : callable
        Runs the kernel with this room for entries; returns its answer and, by name, the lists that it wrote.
    room : int
        The room of the first call; there is more on the next if the kernel asks for it.
    """
    for _ in range(_MOST_CALLS):
        need, lists = run(room)
        if need <= room:
            break
        room = max(need + need // 4, 16)
    else:
        raise ValueError(f"{what} asks for more room on every call, last for {need}; return what is needed")
    for kind, (start, *_, distance) in lists.items():
        if start[0] != 0 or (np.diff(start) < 0).any() or start[-1] > len(distance):
            raise ValueError(
                f"{what} writes {kind}.start = {checks.shown(start.tolist())}, with room for {len(distance)}; write "
                "all n + 1 elements: 0 first, then ascending, and the number of entries last"
            )
        if start[-1] > need:
            raise ValueError(
                f"{what} returns {need}, but writes {start[-1]} entries of {kind}; return how many the longest list "
                "needs"
            )
    return {kind: filled(seen) for kind, seen in lists.items()}


def lists_in_any_room(what: str, run: Callable[[int], tuple[int, Lists]], less: tuple[int, ...]) -> Lists:
    """Return the neighbour lists that a kernel writes; refuse others after a call with less room."""
    ample = lists_written(what, run)
    for room in less:
        for kind, seen in lists_written(what, run, room).items():
            if not are_equal(seen, ample[kind]):
                raise ValueError(
                    f"{what} writes different {kind} after a call with too little room; do not depend on the content "
                    "of the buffers"
                )
    return ample


def descends(row: npt.NDArray[np.int64], number: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
    """Return for each entry of neighbour lists whether its number does not exceed the one before in its row."""
    return np.array((np.diff(row, prepend=-1) == 0) & (np.diff(number, prepend=-1) <= 0))


def refuse_entries(what: str, row: npt.NDArray[np.int64], wrong: Any, text: str, *columns: Any) -> None:
    """Raise an error with the row of the first wrong entry, and the text filled with its elements of the columns."""
    if wrong.any():
        k = int(np.argmax(wrong))
        raise ValueError(f"{what} {row[k]}: {text.format(*(column[k] for column in columns))}")


def rows_of(seen: NeighbourList) -> npt.NDArray[np.int64]:
    """Return the observer of each entry."""
    return np.repeat(np.arange(len(seen.start) - 1), seen.degree)


def check_offsets(what: str, seen: NeighbourList) -> None:
    """Refuse offsets and distances that are not finite, or that differ in length."""
    row, length = rows_of(seen), np.hypot(*seen.offset.T)
    wrong = ~np.isfinite(length + seen.distance)
    refuse_entries(what, row, wrong, "an offset or a distance that is unwritten or not finite; write both")
    wrong = np.abs(length - seen.distance) > 1e-9 * (1.0 + length)
    text = "the distance {:g} and an offset of length {:g}; they must be equal"
    refuse_entries(what, row, wrong, text, seen.distance, length)


def parameters_of(component: Any, base: type) -> tuple[float, ...]:
    """Return the fields of a component that is a dataclass, in order; none for a class without attributes of its own.

    Parameters
    ----------
    component : object
        A policy, a degree of awareness or the like.
    base : type
        The base class of such components; fields with the names of its attributes are declarations, not constants.

    Raises
    ------
    TypeError
        If a field is not a number, or the component keeps attributes and is not a dataclass.
    """
    kind = type(component).__name__
    if not is_dataclass(component):
        own = [name for name in getattr(component, "__dict__", ()) if not hasattr(base, name)]
        if own:
            raise TypeError(
                f"{kind}: has the attribute {own[0]!r}, and no constants for its kernel; make {kind} a dataclass, "
                "whose fields are the constants, or define the property parameters"
            )
        return ()
    names = [field.name for field in fields(component) if not hasattr(base, field.name)]
    values = {name: getattr(component, name) for name in names}
    for name, value in values.items():
        if not isinstance(value, (int, float, np.number, np.bool_)):
            raise TypeError(
                f"{kind}.{name}={checks.shown(value)}: is not a number, which a kernel could read; define the property "
                f"parameters of {kind}, a tuple of floats"
            )
    return tuple(map(float, values.values()))
