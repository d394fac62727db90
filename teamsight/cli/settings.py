"""The settings of each command: texts from the command line, checked, all that is wrong reported at once."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Self

from pydantic import BaseModel, ConfigDict, ValidationInfo, field_validator, model_validator

from teamsight import checks

LEDGER = "ledger"

# Sectors of a ring: finer than a degree of arc is no use, and costs memory for every pair.
_MOST_SECTORS = 360


def _number_in(value: Any) -> Any:
    """Return the number that a text spells, or the text itself for the check to refuse."""
    if not isinstance(value, str):
        return value
    for kind in (int, float):
        try:
            return kind(value)
        except ValueError:
            continue
    return value


class Settings(BaseModel):
    """Settings that cannot change once they are checked."""

    model_config = ConfigDict(frozen=True, extra="forbid")


def whole(*fields: str, least: int = 1, most: int | None = None) -> Any:
    """Return a validator of whole numbers of at least `least` and at most `most`; None stays None."""

    def check(value: Any, info: ValidationInfo) -> int | None:
        if value is None:
            return None
        try:
            return checks.count(str(info.field_name), _number_in(value), least=least, most=most)
        except TypeError as error:
            raise ValueError(str(error)) from None

    return field_validator(*fields, mode="before")(check)


def real(*fields: str, above: float = 0.0, most: float | None = None) -> Any:
    """Return a validator of finite numbers above `above`; None stays None."""

    def check(value: Any, info: ValidationInfo) -> float | None:
        if value is None:
            return None
        try:
            return checks.number(str(info.field_name), _number_in(value), above=above, most=most)
        except TypeError as error:
            raise ValueError(str(error)) from None

    return field_validator(*fields, mode="before")(check)


class RingSettings(Settings):
    """What robots perceive of teammates; `delta` is None where it was not given."""

    awareness: str
    delta: int | None

    _delta = whole("delta", most=_MOST_SECTORS)

    @model_validator(mode="after")
    def _ring_alone(self) -> Self:
        if self.delta is not None and self.awareness != "ring":
            raise ValueError(
                f"delta={self.delta}: is for awareness 'ring', and this is {self.awareness!r}; leave it out, or give "
                "--awareness ring"
            )
        return self


class ReproduceSettings(Settings):
    """Settings of ``teamsight reproduce``."""

    figures: tuple[str, ...]
    out: Path
    runs: int
    steps: int
    workers: int | None
    seed: int
    preset: str
    quick: bool

    _counts = whole("runs", "steps", "workers")
    _seed = whole("seed", least=0)

    @field_validator("figures")
    @classmethod
    def _known(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        from teamsight.analysis.figures import FIGURES

        return tuple(dict.fromkeys(checks.choice("figure", name, (*FIGURES, LEDGER)) for name in names))

    @field_validator("preset")
    @classmethod
    def _preset(cls, name: str) -> str:
        from teamsight.agents.presets import PRESETS
        from teamsight.analysis.reproduce import DEFAULTS

        return checks.choice("preset", name, (*PRESETS, DEFAULTS))


class RunSettings(RingSettings):
    """Settings of ``teamsight run``; names are checked by the model."""

    robots: int
    targets: int
    radius: float
    policy: str
    awareness_range: float
    steps: int
    seed: int
    preset: str | None
    save: Path | None

    _counts = whole("robots", "targets", "steps")
    _lengths = real("radius", "awareness_range")
    _seed = whole("seed", least=0)


class SimulatedDeltaSettings(Settings):
    """Settings of ``teamsight delta`` for a world that is described."""

    robots: int = 30
    targets: int = 15
    radius: float = 5.0
    policy: str = "random-walk"
    awareness_range: float = 1.0
    preset: str | None = None
    risk: float = 0.01
    runs: int | None = None
    steps: int = 600
    seed: int = 0
    out: Path | None = None

    _counts = whole("robots", "targets", "runs", "steps")
    _lengths = real("radius", "awareness_range")
    _risk = real("risk", most=1.0)
    _seed = whole("seed", least=0)


class TracksDeltaSettings(Settings):
    """Settings of ``teamsight delta`` for recorded positions."""

    tracks: Path
    awareness_range: float
    window: float | None = None
    sort: bool = False
    risk: float = 0.01
    out: Path | None = None

    _lengths = real("awareness_range", "window")
    _risk = real("risk", most=1.0)

    @model_validator(mode="before")
    @classmethod
    def _range_given(cls, given: dict[str, Any]) -> dict[str, Any]:
        if given.get("awareness_range") is None:
            raise ValueError("awareness_range: missing; give --awareness-range in the unit of the recorded positions")
        return given
