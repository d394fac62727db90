"""One direction of a picture: an axis of a study, or several that advance together, with its levels."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

# Characters of a value that a picture shows.
_LONGEST_TEXT = 26
# A logarithmic scale is used from this ratio of the largest to the smallest value on.
_LEAST_RATIO = 8.0


@dataclass(frozen=True, eq=False)
class Dimension:
    """An axis, or axes that advance together, as levels: numbers in ascending order, texts in that of the study.

    Attributes
    ----------
    names : tuple of str
        The axes.
    texts : tuple of str
        What is written at each level.
    numbers : ndarray of float64, shape (levels,), or None
        The value of the first axis at each level; None if these are texts, or not different.
    levels : ndarray of int64, shape (settings,)
        The level of each setting.
    values : tuple of tuple
        The values of all axes at each level.
    """

    names: tuple[str, ...]
    texts: tuple[str, ...]
    numbers: NDArray[np.float64] | None
    levels: NDArray[np.int64]
    values: tuple[tuple[object, ...], ...]

    def __len__(self) -> int:
        return len(self.texts)

    @property
    def label(self) -> str:
        """The names of the axes as a picture writes them."""
        return ", ".join(name.replace("_", " ") for name in self.names)

    @property
    def is_logarithmic(self) -> bool:
        """Whether the numbers are spread more evenly on a logarithmic scale."""
        numbers = self.numbers
        if numbers is None or len(numbers) < 3 or numbers[0] <= 0 or numbers[-1] < _LEAST_RATIO * numbers[0]:
            return False
        return _unevenness(np.log(numbers)) < 0.5 * _unevenness(numbers)

    @property
    def places(self) -> NDArray[np.float64]:
        """Where each level is drawn: its number, or for texts 0, 1, 2, …."""
        return np.arange(len(self), dtype=float) if self.numbers is None else self.numbers

    def among(self, settings: NDArray[np.bool_]) -> Dimension:
        """Return the dimension of some settings; levels that none of them has are left out."""
        kept, levels = np.unique(self.levels[settings], return_inverse=True)
        return replace(
            self,
            texts=tuple(self.texts[level] for level in kept),
            numbers=None if self.numbers is None else self.numbers[kept],
            levels=levels,
            values=tuple(self.values[level] for level in kept),
        )


def dimension_of(settings: pd.DataFrame, names: Sequence[str]) -> Dimension:
    """Return the dimension of some axes of a table with one row for each setting."""
    columns = [pd.factorize(settings[name]) for name in names]
    together = np.stack([codes for codes, _ in columns], axis=1)
    levels, first = pd.factorize(pd.MultiIndex.from_arrays(list(together.T)) if len(names) > 1 else together[:, 0])
    rows = [code if isinstance(code, tuple) else (code,) for code in first]
    values = [tuple(found[code] for code, (_, found) in zip(row, columns, strict=True)) for row in rows]
    numbers = _numbers([value[0] for value in values])
    if numbers is not None:
        order = np.argsort(numbers, kind="stable")
        numbers, values = numbers[order], [values[place] for place in order]
        levels = np.argsort(order)[levels]
        if len(np.unique(numbers)) < len(numbers):
            numbers = None
    return Dimension(tuple(names), _texts(values), numbers, np.asarray(levels, np.int64), tuple(values))


def text_of(value: object) -> str:
    """Return a value as a picture writes it: a number with four digits, a component by its name and its options."""
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, int | float | np.number):
        return _number(value)
    text = str(value)
    if text.startswith("{"):
        return _component(text)
    # A reference "package.module:Name".
    return text.rpartition(":")[2] if ":" in text and " " not in text else text


def _component(text: str) -> str:
    try:
        options = json.loads(text)
    except ValueError:
        return text
    name = text_of(str(options.pop("use", "")))
    return f"{name}({', '.join(f'{key}={text_of(value)}' for key, value in options.items())})"


def _numbers(values: Sequence[object]) -> NDArray[np.float64] | None:
    return np.array(values, float) if values and all(map(_is_number, values)) else None


def _is_number(value: object) -> bool:
    return isinstance(value, int | float | np.number) and not isinstance(value, bool)


def _number(value: Any) -> str:
    if float(value).is_integer() and abs(value) < 1e7:
        return str(int(value))
    return f"{value:.4g}"


def _texts(values: Sequence[tuple[object, ...]]) -> tuple[str, ...]:
    """Return different texts for different values, short ones where possible."""
    long = [", ".join(map(text_of, value)) for value in values]
    half = _LONGEST_TEXT // 2
    # The beginning is what values often have in common.
    short = [text if len(text) <= _LONGEST_TEXT else f"{text[: half - 1]}…{text[-half:]}" for text in long]
    exact = [", ".join(map(str, value)) for value in values]
    return tuple(next((texts for texts in (short, long) if len(set(texts)) == len(texts)), exact))


def _unevenness(numbers: NDArray[np.float64]) -> float:
    steps = np.diff(numbers)
    return float(steps.std() / steps.mean())
