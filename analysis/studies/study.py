"""`Study`: what a researcher wants to know, as a value: model, settings, replicates, steps, what to record."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Annotated, Any, Literal, Protocol, Self

from teamsight.analysis.runs.limits import Steps
from teamsight.analysis.runs.seeds import Pairing
from teamsight.analysis.studies.definition.check import MOST_RUNS, check_plan, resolved
from teamsight.analysis.studies.definition.model import Record, Until
from teamsight.analysis.studies.definition.settings import Block, blocks_of
from teamsight.analysis.studies.definition.values import are_equal, thawed
from teamsight.analysis.studies.plan import Plan
from teamsight.core import checks, references
from teamsight.core.component import Allowed, Component, Seed

if TYPE_CHECKING:
    import pandas as pd
    import xarray

    from teamsight.agents.world import World
    from teamsight.analysis.runs.executor import Executor

__all__ = ["Record", "Results", "Study", "Until"]

Values = Mapping[str, Any]

_SUMMARY = Record()


class Results(Protocol):
    """What `Study.run` returns: the `StudyResults` of its folder."""

    @property
    def frame(self) -> pd.DataFrame:
        """One row for each run."""

    @property
    def is_complete(self) -> bool:
        """Whether no run is missing."""

    def summary(self, measure: str | None = None) -> pd.DataFrame:
        """Return mean, interval and maximum of a measure for each setting."""

    def to_xarray(self) -> xarray.Dataset:
        """Return them on the axes."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Study(Component):
    """A study: settings of a model, times replicates.

    All settings are crossed: each axis with each other, with the points and with the sample. Axes that are zipped
    advance together. A study is a value: it cannot be changed, its lists are tuples, and two studies of equal values
    are equal.

    Parameters
    ----------
    model : str or callable
        "cmommt", the name of a plug-in, or "package.module:Name": a class or function that is called as
        ``model(**setting, rng=seed)``. Or "task:NAME", such as "task:cmommt": then settings have values of the scenario
        of this task, ``treatment``, and other parameters of its world.
    fixed : mapping
        Parameters of the model that all settings share.
    axes : mapping
        For each swept parameter a list of values, or a table ``{"from": 1, "to": 5, "step": 1}``; in place of the step
        a ``count``, and optionally ``"scale": "log"``.
    zip : sequence of sequence of str
        Groups of axes that advance together.
    points : mapping or DataFrame, optional
        Settings that are listed one by one: the values of each parameter.
    sample : mapping, optional
        ``{"method": "sobol", "count": 64, "seed": 0, "axes": {"radius": {"from": 2, "to": 9}}}``, or "latin-hypercube";
        an axis may have ``"scale": "log"`` or ``"integer": True``. It is kept as the columns that were drawn.
    replicates : int
        Runs of each setting; with `until`, the first ones, and it adds more: at least 38 in all, or its limit.
    steps : int
        Steps of each run.
    seed : int
        The root seed.
    pairing : "scenario" or "none"
        Which values enter the seed of a run. By default those of the scenario: that of a task, or robots, targets and
        radius of `CMOMMT`, so that treatments of one scenario meet the same noise, as in `run_many`. With "none", all.
    record : Record or mapping
        What is recorded of each run.
    until : Until or mapping, optional
        Add replicates to each setting until its interval is narrow enough with two of 30, 38, 48, 60, … replicates in
        succession. See `teamsight.analysis.studies.standing`.
    name : str, optional
        A name for titles.
    path : path, optional
        The folder of the study file, where its modules are found. It is not compared.

    Raises
    ------
    TypeError, ValueError
        If a value is wrong; the model and its components are not imported before `check`.
    """

    model: str = "cmommt"
    fixed: Values = field(default_factory=dict)
    axes: Values = field(default_factory=dict)
    zip: Sequence[Sequence[str]] = ()
    points: Values | None = None
    sample: Values | None = None
    replicates: Annotated[int, Allowed(least=1, most=MOST_RUNS, cure=("", "give fewer"))] = 1
    steps: Steps = 600
    seed: Seed = 0
    pairing: Pairing = "scenario"
    record: Record = _SUMMARY
    until: Until | None = None
    name: str | None = None
    path: str | os.PathLike[str] | None = None

    if TYPE_CHECKING:
        # What may be given; the attributes are what it is turned into.
        def __init__(
            self,
            *,
            model: str | Callable[..., World] = ...,
            fixed: Mapping[str, object] = ...,
            axes: Mapping[str, object] = ...,
            zip: Sequence[Sequence[str]] = ...,
            points: Mapping[str, Sequence[object]] | pd.DataFrame | None = ...,
            sample: Mapping[str, object] | None = ...,
            replicates: int = ...,
            steps: int = ...,
            seed: int = ...,
            pairing: Pairing = ...,
            record: Record | Mapping[str, object] = ...,
            until: Until | Mapping[str, object] | None = ...,
            name: str | None = ...,
            path: str | os.PathLike[str] | None = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, value in resolved(vars(self)).items():
            object.__setattr__(self, name, value)

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> Self:
        """Read a study file, and check it; see `check`.

        Raises
        ------
        TypeError, ValueError
            If it is not a study.
        """
        from teamsight.analysis.studies.definition.study_file import read_study_file

        values = read_study_file(Path(path), [one.name for one in fields(cls) if one.name != "path"])
        try:
            study = cls(**values)
            study.check()
        except (TypeError, ValueError) as error:
            kind = TypeError if isinstance(error, TypeError) else ValueError
            raise kind(f"{os.fspath(path)}: {error}") from error
        return study

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the study of which these are the values; see `as_dict`.

        Raises
        ------
        TypeError, ValueError
            If a key is unknown or a value is wrong.
        """
        for key in values:
            checks.choice("study: key", key, [one.name for one in fields(cls)])
        return cls(**values)

    def as_dict(self) -> dict[str, Any]:
        """Return JSON values: axes are listed, points and samples are columns."""
        found = {one.name: thawed(getattr(self, one.name)) for one in fields(self)}
        found["record"] = asdict(self.record)
        found["until"] = None if self.until is None else asdict(self.until)
        found["path"] = None if self.path is None else os.fspath(self.path)
        return found

    @property
    def blocks(self) -> tuple[Block, ...]:
        """What is crossed, in order; the last varies fastest."""
        return blocks_of(self.axes, self.zip, self.points, self.sample)

    @property
    def settings(self) -> int:
        """The number of settings."""
        return math.prod(block.size for block in self.blocks)

    @property
    def runs(self) -> int:
        """The number of runs; with `until`, of the first ones."""
        return self.settings * self.replicates

    def check(self) -> None:
        """Import the model, the measure and all components, and check the names of the parameters.

        Raises
        ------
        TypeError, ValueError
            If one does not load, the model does not have a parameter, or `CMOMMT` refuses a value.
        """
        references.search_in([] if self.path is None else [os.fspath(self.path)])
        check_plan(self.plan(), self.model, self.record.measure, self.steps, self.until)

    def plan(self) -> Plan:
        """Return all runs of this study. Nothing is imported and checked; see `check`."""
        return Plan(self)

    def run(
        self,
        out: str | os.PathLike[str],
        *,
        workers: int = 1,
        executor: Executor | None = None,
        on_error: Literal["continue", "stop"] = "continue",
        shard: tuple[int, int] | None = None,
        wait: bool = False,
        mixed_code: bool = False,
        retry_failed: bool = False,
        progress: Callable[[int, int, float | None], None] = lambda done, total, seconds_left: None,
    ) -> Results:
        """Make the runs that are missing in a folder, and return its results.

        Parameters
        ----------
        out : path
            The folder of the study; created if it does not exist.
        workers : int
            Number of processes; with 1 runs are made in this one.
        executor : Executor, optional
            What makes the runs, in place of `workers` processes.
        on_error : "continue" or "stop"
            Whether to go on after a run that fails. It is not made again unless `retry_failed` is set.
        shard : (int, int), optional
            Make shard i of n only, from 1: for a job array.
        wait : bool
            Wait until another sweep of the folder has ended, in place of refusing.
        mixed_code : bool
            Go on although runs in the folder were made by other code.
        retry_failed : bool
            Make failed runs again.
        progress : callable
            Called with the runs that are done, the runs in all and the seconds left, None if unknown.

        Returns
        -------
        StudyResults
            As of `teamsight.open_study`.

        Raises
        ------
        TypeError, ValueError
            If the study is wrong, see `check`, or the folder cannot be used.
        """
        # By name: a sweep reads studies from folders, and so imports this module.
        results: Results = resolve_name("teamsight.analysis.studies.sweep:run_study")(
            self, out, workers=workers, executor=executor, on_error=on_error, shard=shard, wait=wait,
            mixed_code=mixed_code, retry_failed=retry_failed, progress=progress,
        )  # fmt: skip
        return results

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Study):
            return NotImplemented
        mine, its = ({k: v for k, v in vars(one).items() if k != "path"} for one in (self, other))
        return all(are_equal(value, its[name]) for name, value in mine.items())

    def __hash__(self) -> int:
        return hash((self.model, self.replicates, self.steps, self.seed, *sorted(self.fixed), *sorted(self.axes)))

    def __repr__(self) -> str:
        plain = {one.name: _DEFAULTS[one.name] for one in fields(self)}
        shown = (f"{name}={value!r}" for name, value in vars(self).items() if value != plain[name])
        return f"Study({', '.join(shown)})"


_DEFAULTS: dict[str, Any] = vars(Study())
