"""The settings of ``teamsight learn``: texts from the command line, checked, all that is wrong reported at once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import ValidationInfo, field_validator

from teamsight import checks
from teamsight.cli.settings import RingSettings, Settings, real, whole


def _among(field: str, registry: str) -> Any:
    """Return a validator of names in a registry of `teamsight.analysis.learners`: one, or with commas between them."""

    def check(value: Any, info: ValidationInfo) -> Any:
        from teamsight.analysis import learners

        names = value.split(",") if isinstance(value, str) else value
        found = tuple(
            checks.choice(field.removesuffix("s"), name.strip(), getattr(learners, registry)) for name in names
        )
        found = tuple(dict.fromkeys(found))
        return found if field.endswith("s") else found[0]

    return field_validator(field, mode="before")(check)


def _share(*fields: str) -> Any:
    """Return a validator of numbers from 0 to 1."""

    def check(value: Any, info: ValidationInfo) -> float:
        try:
            return checks.number(str(info.field_name), float(value), least=0, most=1)
        except ValueError as error:
            told = str(error) if "must be" in str(error) else f"{info.field_name}={value!r}: must be a number"
            raise ValueError(told) from None

    return field_validator(*fields, mode="before")(check)


class ExploreSettings(RingSettings):
    """Settings of ``teamsight learn explore``."""

    out: Path
    robots: int
    targets: int
    radius: float
    steps: int
    runs: int
    policy: str
    distance: str
    robot_speed: float
    seed: int
    workers: int
    merge: tuple[Path, ...]
    append: bool
    force: bool

    _counts = whole("robots", "targets", "steps", "runs", "workers")
    _lengths = real("radius", "robot_speed")
    _seed = whole("seed", least=0)

    @field_validator("distance")
    @classmethod
    def _distance(cls, name: str) -> str:
        return checks.choice("distance", name, ("random", "full"))

    @field_validator("awareness")
    @classmethod
    def _degree(cls, name: str) -> str:
        from teamsight.agents.awareness import AWARENESS

        return checks.choice("awareness", name, AWARENESS)

    @field_validator("policy")
    @classmethod
    def _policy(cls, name: str) -> str:
        from teamsight.policies import POLICIES

        return checks.choice("policy", name, POLICIES)


class EvaluateSettings(Settings):
    """Settings of ``teamsight learn evaluate``."""

    memory: Path
    learner: str
    reward: str
    k: int | None
    gamma: float
    robots: int | None
    targets: int
    radius: float
    runs: int
    steps: int
    seed: int
    workers: int
    sample: int | None
    save: Path | None
    force: bool

    _counts = whole("k", "sample", "robots", "targets", "runs", "steps", "workers")
    _lengths = real("radius")
    _gamma = _share("gamma")
    _seed = whole("seed", least=0)
    _learner = _among("learner", "LEARNERS")
    _reward = _among("reward", "REWARDS")


class FigureSettings(Settings):
    """Settings of ``teamsight learn figure``."""

    out: Path
    learners: tuple[str, ...]
    samples: tuple[int, ...] | None
    memories: int | None
    worlds: int | None
    reward: str
    k: int | None
    gamma: float
    robots: int
    targets: int
    radius: float
    steps: int
    seed: int
    workers: int | None
    quick: bool
    force: bool

    _counts = whole("memories", "worlds", "k", "robots", "targets", "steps", "workers")
    _lengths = real("radius")
    _gamma = _share("gamma")
    _seed = whole("seed", least=0)
    _learners = _among("learners", "LEARNERS")
    _reward = _among("reward", "REWARDS")

    @field_validator("samples", mode="before")
    @classmethod
    def _numbers(cls, value: Any) -> Any:
        if value is None:
            return None
        try:
            return tuple(sorted({checks.count("samples", int(number)) for number in str(value).split(",")}))
        except ValueError as error:
            told = str(error) if "must be" in str(error) else f"samples={value!r}: must be whole numbers, as in 150,600"
            raise ValueError(told) from None
