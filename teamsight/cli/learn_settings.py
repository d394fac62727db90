"""The settings of ``teamsight learn``: texts from the command line, checked, all that is wrong reported at once."""

from __future__ import annotations

from typing import Any, Self

from pydantic import ValidationInfo, field_validator, model_validator

from teamsight.cli import limits
from teamsight.cli.paths import FilePath, FolderPath
from teamsight.cli.settings import RingSettings, Settings, lengths, number_in, processes, seeds, whole
from teamsight.core import checks

# Numbers of samples of one figure.
_MOST_SAMPLES = 100
# Steps of a world that is explored for learning curves, as in the paper.
_EXPLORED_STEPS = 120
# As many numbers, and as large, as there are where none are given.
_SAMPLES = (38_400,) * 9


def _among(field: str, registry: str) -> Any:
    """Return a validator of names in a registry of `learners.py`: one, or with commas between them."""

    def check(value: Any, info: ValidationInfo) -> Any:
        from teamsight.analysis.learning import learners

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
            told = f"{info.field_name}={checks.shown(value)}: must be a number"
            raise ValueError(str(error) if "must be" in str(error) else told) from None

    return field_validator(*fields, mode="before")(check)


class ExploreSettings(RingSettings):
    """Settings of ``teamsight learn explore``."""

    out: FilePath
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
    merge: tuple[FilePath, ...]
    append: bool
    force: bool

    _agents = whole("robots", "targets", most=limits.MOST_AGENTS)
    _steps = whole("steps", most=limits.MOST_STEPS, cure=limits.STEPS_CURE)
    _runs = whole("runs", most=limits.MOST_RUNS)
    _workers = processes("workers")
    _lengths = lengths("radius", "robot_speed")
    _seed = seeds("seed")

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

    @model_validator(mode="after")
    def _possible(self) -> Self:
        limits.check_work(self.robots, self.targets, self.steps, self.runs)
        limits.check_sightings(self.robots, self.targets, self.radius, 1.0, self.awareness == "shared")
        added = limits.added_inputs(self.awareness, self.delta, self.robots)
        limits.check_pairs(self.robots, self.steps, self.runs, added)
        return self


class EvaluateSettings(Settings):
    """Settings of ``teamsight learn evaluate``."""

    memory: FilePath
    learner: str
    reward: str
    k: int | None
    discount: float
    robots: int | None
    targets: int
    radius: float
    runs: int
    steps: int
    seed: int
    workers: int
    sample: int | None
    save: FilePath | None
    force: bool

    _counts = whole("k", "sample")
    _agents = whole("robots", "targets", most=limits.MOST_AGENTS)
    _steps = whole("steps", most=limits.MOST_STEPS, cure=limits.STEPS_CURE)
    _runs = whole("runs", most=limits.MOST_RUNS)
    _workers = processes("workers")
    _lengths = lengths("radius")
    _discount = _share("discount")
    _seed = seeds("seed")
    _learner = _among("learner", "LEARNERS")
    _reward = _among("reward", "REWARDS")

    @model_validator(mode="after")
    def _possible(self) -> Self:
        robots = self.robots or 1
        limits.check_work(robots, self.targets, self.steps, self.runs)
        limits.check_sightings(robots, self.targets, self.radius, 1.0)
        return self


class FigureSettings(Settings):
    """Settings of ``teamsight learn figure``."""

    out: FolderPath
    learners: tuple[str, ...]
    samples: tuple[int, ...] | None
    memories: int | None
    worlds: int | None
    reward: str
    k: int | None
    discount: float
    robots: int
    targets: int
    radius: float
    steps: int
    seed: int
    workers: int | None
    quick: bool
    force: bool

    _k = whole("k")
    _agents = whole("robots", "targets", most=limits.MOST_AGENTS)
    _steps = whole("steps", most=limits.MOST_STEPS, cure=limits.STEPS_CURE)
    _runs = whole("memories", "worlds", most=limits.MOST_RUNS)
    _workers = processes("workers")
    _lengths = lengths("radius")
    _discount = _share("discount")
    _seed = seeds("seed")
    _learners = _among("learners", "LEARNERS")
    _reward = _among("reward", "REWARDS")

    @field_validator("samples", mode="before")
    @classmethod
    def _numbers(cls, value: Any) -> Any:
        if value is None:
            return None
        found = set()
        for text in str(value).split(","):
            try:
                found.add(checks.count("samples", number_in(text)))
            except TypeError:
                told = f"samples={checks.shown(value)}: must be whole numbers, as in 150,600"
                raise ValueError(told) from None
        if len(found) > _MOST_SAMPLES:
            raise ValueError(f"samples: are {len(found)} numbers, at most {_MOST_SAMPLES}; leave some out")
        return tuple(sorted(found))

    @model_validator(mode="after")
    def _possible(self) -> Self:
        memories, worlds, samples = self.memories or 10, self.worlds or 4, self.samples or _SAMPLES
        limits.check_sightings(self.robots, self.targets, self.radius, 1.0, shared=True)
        explored = -(-max(samples) // (self.robots * _EXPLORED_STEPS))
        limits.check_pairs(self.robots, _EXPLORED_STEPS, explored, limits.added_inputs("shared", None, self.robots))
        tests = float(memories) * worlds * (4 * len(self.learners) * len(samples) + 2)
        limits.check_rows(tests, f"memories={memories}, worlds={worlds}, {len(samples)} samples")
        limits.check_work(self.robots, self.targets, self.steps, int(tests))
        return self
