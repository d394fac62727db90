"""The settings of a study as a product: axes, zipped axes, points and samples, crossed with each other."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from teamsight.analysis.studies.definition.axes import MOST_SETTINGS, Values, check_distinct, texts_of
from teamsight.core import checks


class Block(NamedTuple):
    """Parameters that advance together: one axis, a group of zipped axes, points or a sample.

    Attributes
    ----------
    where : str
        Its name in errors.
    columns : dict of str to tuple
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
        If a group names an unknown axis, or axes of unequal lengths; or a parameter is given twice.
    """
    group_of: dict[str, Sequence[str]] = {}
    for group in zipped:
        for name in group:
            checks.choice("zip", name, axes)
            if name in group_of:
                raise ValueError(f"zip: {name!r} is in two groups; keep it in one")
            group_of[name] = group
        lengths = {name: len(axes[name]) for name in group}
        if len(set(lengths.values())) > 1:
            text = ", ".join(f"{name} has {length}" for name, length in lengths.items())
            raise ValueError(f"zip: {text} values; axes that advance together need equally many")
    blocks, seen = [], set[str]()
    for name in axes:
        if name not in seen:
            group = group_of.get(name, (name,))
            seen.update(group)
            blocks.append(Block(f"axes.{'+'.join(group)}", {one: axes[one] for one in group}))
    blocks += [Block(where, each) for where, each in (("points", points), ("sample", sample)) if each is not None]
    return tuple(blocks)


def check_blocks(blocks: Sequence[Block], fixed: Mapping[str, object]) -> int:
    """Return the number of settings.

    Raises
    ------
    ValueError
        If a parameter is given twice, or there are too many settings, or two are equal.
    """
    places = dict.fromkeys(fixed, "fixed")
    for block in blocks:
        for name in block.columns:
            if name in places:
                raise ValueError(f"{block.where}: {name!r} is also in {places[name]}; give it in one of them")
            places[name] = block.where
    settings = math.prod(block.size for block in blocks)
    if settings > MOST_SETTINGS:
        raise ValueError(f"axes: {_count(settings)} settings, at most {_count(MOST_SETTINGS)}; give fewer values")
    for block in blocks:
        rows = zip(*map(texts_of, block.columns.values()), strict=True)
        columns = tuple(block.columns.values())
        check_distinct(
            block.where, map(", ".join, rows), lambda row, of=columns: of[0][row] if len(of) == 1 else tuple(one[row] for one in of)
        )
    return settings


def _count(number: int) -> str:
    return f"{number:,}" if number < 10**12 else f"{number:.1e}"
