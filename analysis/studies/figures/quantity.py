"""How a measure is written: its label, its unit, and as many decimals as its intervals justify."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from teamsight.analysis.plot.style import superscript

# Digits of a quantity whose intervals are unknown.
_DIGITS = 3
_MOST_DECIMALS = 6
# Largest values that are written without a power of ten.
_SMALLEST, _LARGEST = 1e-4, 1e7
# Relative to the mean.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Quantity:
    """A measure, or the difference of a measure in two studies.

    Attributes
    ----------
    name : str
        Name of the measure; a fraction, whose name ends so, is written in percent.
    is_difference : bool
        Whether it is a difference, in which 0 is special.
    decimals : int
        Decimals of its numbers.
    power : int
        The power of ten by which its numbers are divided.
    """

    name: str
    is_difference: bool = False
    decimals: int = 1
    power: int = 0

    @property
    def is_percent(self) -> bool:
        """Whether it is written in percent."""
        return self.name.endswith("fraction")

    @property
    def factor(self) -> float:
        """What values are multiplied by before they are written."""
        return 100.0 if self.is_percent else 10.0**-self.power

    @property
    def title(self) -> str:
        """The name in words."""
        words = self.name.replace("_", " ")
        return f"difference in {words}" if self.is_difference else words

    @property
    def label(self) -> str:
        """The name in words with its unit; of a difference, which is long, without the name of the measure."""
        if self.is_difference:
            return "difference" + ("  [percentage points]" if self.is_percent else self._unit)
        return self.title + ("  [%]" if self.is_percent else self._unit)

    @property
    def _unit(self) -> str:
        return f"  [10{superscript(str(self.power))}]" if self.power else ""

    def of_size(self, values: NDArray[np.float64]) -> Quantity:
        """Return the quantity with a power of ten by which very large and very small values are divided.

        Parameters
        ----------
        values : ndarray of float64, shape (n,)
            Values of the measure.
        """
        sizes = np.abs(values[np.isfinite(values)])
        largest = float(sizes.max()) if len(sizes) else 0.0
        if self.is_percent or largest == 0.0 or _SMALLEST <= largest < _LARGEST:
            return self
        # Powers of a thousand, but no further than a float goes.
        return replace(self, power=int(np.clip(3 * np.floor(np.log10(largest) / 3), -300, 300)))

    def write(self, value: float) -> str:
        """Return a value in the unit of the quantity; a difference has a sign."""
        text = f"{value:{'+' if self.is_difference else ''}.{self.decimals}f}"
        # What rounds to 0 has no sign.
        text = text.lstrip("+-") if _is_zero(text) else text
        return text.replace("-", "−")

    def finer(self, wide: float, mean: float) -> Quantity:
        """Return the quantity with one more decimal where the half width of an interval would be written as 0."""
        text = f"{wide:.{self.decimals}f}"
        # The half width of equal values is 0 or a rounding error.
        is_hidden = np.isfinite(wide) and _is_zero(text) and wide > _ROUNDING * abs(mean)
        return replace(self, decimals=self.decimals + 1) if is_hidden else self

    def write_width(self, wide: float, mean: float) -> str:
        """Return the half width of an interval around a mean; see `finer`. What would still be 0 is "<" a limit."""
        own = self.finer(wide, mean)
        text = f"{wide:.{own.decimals}f}"
        return f"<{10.0**-own.decimals:.{own.decimals}f}" if own is not self and _is_zero(text) else text

    def fitted(self, mean: NDArray[np.float64], half_width: NDArray[np.float64]) -> Quantity:
        """Return the quantity with the decimals that half widths of intervals justify.

        Parameters
        ----------
        mean, half_width : ndarray of float64, shape (n,)
            Means and half widths in the unit of the quantity.
        """
        known = half_width[np.isfinite(half_width) & (half_width > _ROUNDING * np.abs(mean))]
        means = np.abs(mean[np.isfinite(mean)])
        if len(known):
            decimals = -np.floor(np.log10(np.median(known) / 2))
        elif len(means) and means.max() > 0 and (means % 1).any():
            decimals = _DIGITS - 1 - np.floor(np.log10(means.max()))
        else:
            decimals = 0
        return replace(self, decimals=int(np.clip(decimals, 0, _MOST_DECIMALS)))


def _is_zero(text: str) -> bool:
    return not any(digit in "123456789" for digit in text)
