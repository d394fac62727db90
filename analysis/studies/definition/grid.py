"""The settings of a study as a product: axes, zipped axes, points and samples, crossed with each other."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from teamsight.analysis.studies.definition.axes import MOST_SETTINGS, Values, large
from teamsight.analysis.studies.definition.values import text_of
from teamsight.core import checks


class Block(NamedTuple):
    """Parameters that advance together: one axis, a group of zipped axes, points or a sample.

    Attributes
    ----------
    where : str
        Its name in errors.
    columns : mapping of str to tuple
        Values of each parameter, of equal lengths.
    """

    where: str
    columns: Mapping[str, Values]

    @property
    def size(self) -> int:
        """How many values each parameter has."""
        return len(next(iter(self.columns.values())))


def blocks_of(
    axes: Mapping[str, Values],
    zipped: Sequence[Sequence[str]],
    points: Mapping[str, Values] | None,
    sample: Mapping[str, Values] | None,
) -> tuple[Block, ...]:
    """Return what is crossed, in order: the last varies fastest. A group of zipped axes has the place of its first.

    Raises
    ------
    ValueError
        If a group names an unknown axis, or axes of unequal lengths.
    """
    group_of = _groups(axes, zipped)
    blocks, seen = [], set[str]()
    for name in axes:
        if name not in seen:
            group = group_of.get(name, (name,))
            seen.update(group)
            blocks.append(Block(f"axes.{'+'.join(group)}", {one: axes[one] for one in group}))
    blocks += [Block(where, each) for where, each in (("points", points), ("sample", sample)) if each is not None]
    return tuple(blocks)


def _groups(axes: Mapping[str, Values], zipped: Sequence[Sequence[str]]) -> dict[str, Sequence[str]]:
    """Return the group of each zipped axis."""
    group_of: dict[str, Sequence[str]] = {}
    for group in zipped:
        for name in group:
            if not axes:
                raise ValueError(f"zip={checks.shown(group)}: there are no axes; give some, or remove zip")
            checks.choice("zip", name, axes)
            if name in group_of or group.count(name) > 1:
                raise ValueError(f"zip: {name!r} occurs twice; keep it in one group")
        group_of |= dict.fromkeys(group, group)
        lengths = {name: len(axes[name]) for name in group}
        if len(set(lengths.values())) > 1:
            text = ", ".join(f"{name} has {length}" for name, length in lengths.items())
            raise ValueError(f"zip: {text} values; axes that advance together must have equally many")
    return group_of


def check_blocks(blocks: Sequence[Block], fixed: Mapping[str, object]) -> int:
    """Return the number of settings, which are not built.

    Raises
    ------
    ValueError
        If a parameter is given twice, there are too many settings, or two are equal.
    """
    places = dict.fromkeys(fixed, "fixed")
    for block in blocks:
        for name in block.columns:
            if name in places:
                raise ValueError(f"{block.where}: {name!r} is also in {places[name]}; give it in one of them")
            places[name] = block.where
    settings = math.prod(block.size for block in blocks)
    if settings > MOST_SETTINGS:
        sizes = " × ".join(str(block.size) for block in blocks)
        raise ValueError(f"axes: {sizes} = {large(settings)} settings, at most {MOST_SETTINGS:,}; give fewer values")
    for block in blocks:
        _check_distinct(block)
    return settings


def _check_distinct(block: Block) -> None:
    columns = tuple(block.columns.values())
    try:
        # Quickly, for millions of rows; True and 1 are one value here and two below.
        if any(len(set(column)) == block.size for column in columns):
            return
        if len(set(zip(*columns, strict=True))) == block.size:
            return
    except TypeError:  # tables cannot be in sets
        pass
    first: dict[tuple[str, ...], int] = {}
    for row, texts in enumerate(zip(*([text_of(value) for value in one] for one in columns), strict=True)):
        if first.setdefault(texts, row) != row:
            shown = {name: column[row] for name, column in block.columns.items()}
            raise ValueError(
                f"{block.where}: {checks.shown(shown)} occurs twice (as value {first[texts] + 1} and {row + 1}); keep "
                "one, and raise replicates if more runs are wanted"
            )
