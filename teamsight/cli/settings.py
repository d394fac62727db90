"""The settings of each command: texts from the command line, checked, all that is wrong reported at once."""

from __future__ import annotations

from typing import Any, Self

from pydantic import BaseModel, ConfigDict, ValidationInfo, field_validator, model_validator

from teamsight.cli import limits
from teamsight.cli.paths import FilePath, FolderPath
from teamsight.core import checks

LEDGER = "ledger"

# Sectors of a ring: finer than a degree of arc is no use, and costs memory for every pair.
_MOST_SECTORS = 360
_LONGEST_NUMBER = 500


def number_in(value: Any) -> Any:
    """Return the number that a text spells, or the text itself for the check to refuse."""
    # Longer ones are no number of anything, and Python would take long, or refuse, to read them.
    if not isinstance(value, str) or len(value) > _LONGEST_NUMBER:
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


def whole(*fields: str, least: int = 1, most: int | None = None, cure: str = "") -> Any:
    """Return a validator of whole numbers of at least `least` and at most `most`; None stays None."""

    def check(value: Any, info: ValidationInfo) -> int | None:
        if value is None:
            return None
        try:
            return checks.count(str(info.field_name), number_in(value), least=least, most=most, cure=cure)
        except TypeError as error:
            raise ValueError(str(error)) from None

    return field_validator(*fields, mode="before")(check)


def seeds(*fields: str) -> Any:
    """Return a validator of seeds."""
    return whole(*fields, least=0, most=checks.MOST_SEED)


def processes(*fields: str) -> Any:
    """Return a validator of numbers of processes; None stays None."""

    def check(value: Any) -> int | None:
        if value is None:
            return None
        from teamsight.analysis.runs.workers import check_workers

        try:
            return check_workers(number_in(value))
        except TypeError as error:
            raise ValueError(str(error)) from None

    return field_validator(*fields, mode="before")(check)


def lengths(*fields: str) -> Any:
    """Return a validator of lengths and speeds in the unit of the model; None stays None."""

    def check(value: Any, info: ValidationInfo) -> float | None:
        if value is None:
            return None
        from teamsight.world.limits import length

        try:
            return length(str(info.field_name), number_in(value))
        except TypeError as error:
            raise ValueError(str(error)) from None

    return field_validator(*fields, mode="before")(check)


def real(*fields: str, least: float, most: float) -> Any:
    """Return a validator of finite numbers of at least `least` and at most `most`; None stays None."""

    def check(value: Any, info: ValidationInfo) -> float | None:
        if value is None:
            return None
        try:
            return checks.number(str(info.field_name), number_in(value), least=least, most=most)
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
                f"delta={self.delta}: is for awareness 'ring', and this is {checks.shown(self.awareness)}; leave it "
                "out, or give --awareness ring"
            )
        return self


class ReproduceSettings(Settings):
    """Settings of ``teamsight reproduce``."""

    figures: tuple[str, ...]
    out: FolderPath
    runs: int
    steps: int
    workers: int | None
    seed: int
    preset: str
    quick: bool
    force: bool

    _runs = whole("runs", most=limits.MOST_CELL_RUNS)
    _steps = whole("steps", most=limits.MOST_STEPS, cure=limits.STEPS_CURE)
    _workers = processes("workers")
    _seed = seeds("seed")

    @field_validator("figures")
    @classmethod
    def _known(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        from teamsight.analysis.paper.figures import FIGURES

        return tuple(dict.fromkeys(checks.choice("figure", name, (*FIGURES, LEDGER)) for name in names))

    @field_validator("preset")
    @classmethod
    def _preset(cls, name: str) -> str:
        from teamsight.agents.presets import PRESETS
        from teamsight.analysis.paper.reproduce import DEFAULTS

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
    save: FilePath | None
    force: bool

    _agents = whole("robots", "targets", most=limits.MOST_AGENTS)
    _steps = whole("steps", most=limits.MOST_STEPS, cure=limits.STEPS_CURE)
    _lengths = lengths("radius", "awareness_range")
    _seed = seeds("seed")

    @model_validator(mode="after")
    def _possible(self) -> Self:
        limits.check_work(self.robots, self.targets, self.steps)
        shared = self.awareness == "shared"
        limits.check_sightings(self.robots, self.targets, self.radius, self.awareness_range, shared)
        return self


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
    out: FolderPath | None = None
    force: bool = False

    _agents = whole("robots", "targets", most=limits.MOST_AGENTS)
    _runs = whole("runs", most=limits.MOST_RUNS)
    _steps = whole("steps", most=limits.MOST_STEPS, cure=limits.STEPS_CURE)
    _lengths = lengths("radius", "awareness_range")
    _risk = real("risk", least=limits.LEAST_RISK, most=1.0)
    _seed = seeds("seed")

    @model_validator(mode="after")
    def _possible(self) -> Self:
        runs = limits.runs_within(self.risk, self.runs)
        limits.check_work(self.robots, self.targets, self.steps, runs)
        limits.check_sightings(self.robots, self.targets, self.radius, self.awareness_range)
        return self


class TracksDeltaSettings(Settings):
    """Settings of ``teamsight delta`` for recorded positions."""

    tracks: FilePath
    awareness_range: float
    window: float | None = None
    sort: bool = False
    risk: float = 0.01
    out: FolderPath | None = None
    force: bool = False

    # In the units of the record, of which anything may be one.
    _lengths = real("awareness_range", "window", least=1e-15, most=1e18)
    _risk = real("risk", least=limits.LEAST_RISK, most=1.0)

    @model_validator(mode="before")
    @classmethod
    def _range_given(cls, given: dict[str, Any]) -> dict[str, Any]:
        if given.get("awareness_range") is None:
            raise ValueError("awareness_range: missing; give --awareness-range in the unit of the recorded positions")
        return given
