"""`Study`: what a researcher wants to know, as a value: model, settings, replicates, steps, record; and its file."""

from __future__ import annotations

import math
import os
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from teamsight.analysis.runs.limits import Steps
from teamsight.analysis.runs.seeds import Pairing
from teamsight.analysis.studies.definition.check import MOST_RUNS, check_plan, resolved
from teamsight.analysis.studies.definition.model import Record, Until
from teamsight.analysis.studies.definition.settings import Block, blocks_of
from teamsight.analysis.studies.definition.values import are_equal, thawed
from teamsight.analysis.studies.plan import Plan
from teamsight.core import checks, references
from teamsight.core.component import Allowed, Component, Seed
from teamsight.core.files import open_regular

if TYPE_CHECKING:
    import pandas as pd

    from teamsight.agents.world import World
    from teamsight.analysis.runs.executor import Executor
    from teamsight.analysis.studies.results import StudyResults

__all__ = ["Record", "Study", "Until"]

Values = Mapping[str, Any]

_SUMMARY = Record()


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
        values = _read(Path(path), [one.name for one in fields(cls) if one.name != "path"])
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
        progress: Callable[[int, int, float | None], None] | bool = True,
    ) -> StudyResults:
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
        progress : callable or bool
            Called with the runs that are done, the runs in all and the seconds left, None if unknown. With True, a
            terminal or a notebook shows after two seconds how far it is; with False it does not.

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
        made = resolve_name("teamsight.analysis.studies.sweep:sweep")(
            self, out, workers=workers, executor=executor, on_error=on_error, shard=shard, wait=wait,
            mixed_code=mixed_code, retry_failed=retry_failed, progress=progress,
        )  # fmt: skip
        # A measure may have changed the current folder.
        results: StudyResults = resolve_name("teamsight.analysis.studies.results:open_study")(made.folder)
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


#: Bytes of a study file.
MOST_BYTES = 1_000_000

# Bytes of a file of points: ten million rows of 40 characters.
_MOST_BYTES_OF_POINTS = 400_000_000
# tomllib takes quadratic time for a key of very many parts. The search takes linear time: it begins at words only, and
# gives nothing back.
_LONG_KEY = re.compile(r"""(?<![\w"'-])(?:[\w"'-]++[ \t]*+\.[ \t]*+){64}""")


def _read(path: Path, known: Iterable[str]) -> dict[str, Any]:
    """Return the arguments of `Study` that a study file holds; points are read from their file.

    The file is TOML of at most 1 MB, whose keys are the parameters of `Study`, which are `known`. Its folder is where
    points and modules are.
    """
    values = _parsed(path)
    folder = path.resolve().parent
    try:
        for key in values:
            checks.choice("key", key, known)
        if isinstance(values.get("points"), str):
            values["points"] = _points(values["points"], folder)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    return {"name": path.stem, **values, "path": folder}


def _parsed(path: Path) -> dict[str, Any]:
    try:
        with open_regular(path) as file:
            size = file.seek(0, 2)
            file.seek(0)
            content = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise ValueError(
            f"{path}: cannot be read ({error.strerror}); give a study file (docs/studies.md begins with one), or on a "
            "command line --task"
        ) from error
    if max(size, len(content)) > MOST_BYTES:
        raise ValueError(
            f"{path}: has {size:,} bytes, at most {MOST_BYTES:,}; list many settings in a CSV or Parquet file of points"
        )
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: is not UTF-8 (byte {error.start}); save it as UTF-8") from error
    if found := _LONG_KEY.search(text):
        line = text.count("\n", 0, found.start()) + 1
        raise ValueError(f"{path}: line {line} has a key of more than 64 parts; make it flatter")
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        raise ValueError(f"{path}: has too many lists and tables within each other; make it flatter") from error
    except ValueError as error:
        is_syntax = isinstance(error, tomllib.TOMLDecodeError)
        # Else an integer has more digits than Python reads.
        cure = "see https://toml.io" if is_syntax else "give smaller numbers"
        raise ValueError(f"{path}: is not TOML: {error}; {cure}") from error


def _points(name: str, folder: Path) -> dict[str, list[Any]]:
    """Return the columns of a CSV or Parquet file, which is within the folder, also if it is a link."""
    import pyarrow as pa
    from pyarrow import csv, parquet, types

    given = f"points={checks.shown(name, 200)}"
    try:
        # No path has this character.
        path = (folder / name.replace("\0", "?")).resolve()
        if not path.is_relative_to(folder):
            raise ValueError(f"{given}: is outside the study file's folder, {folder}; move it there")
        if path.suffix.lower() not in (".csv", ".parquet"):
            raise ValueError(f"{given}: must end in .csv or .parquet; convert it")
        with open_regular(path) as file:
            if (size := file.seek(0, 2)) > _MOST_BYTES_OF_POINTS:
                raise ValueError(f"{given}: has {size:,} bytes, at most {_MOST_BYTES_OF_POINTS:,}; give fewer rows")
            file.seek(0)
            if path.suffix.lower() == ".parquet":
                table = parquet.read_table(file)
            else:
                # Only an empty cell is a missing value: "none" is a degree of awareness.
                options = csv.ConvertOptions(null_values=[""], strings_can_be_null=True, timestamp_parsers=[])
                table = csv.read_csv(file, convert_options=options)
        names = list(table.column_names)
    except UnicodeDecodeError as error:
        raise ValueError(f"{given}: the name of a column is not UTF-8; save it as UTF-8") from error
    except (pa.ArrowException, OSError, RuntimeError) as error:  # a loop of links
        why = getattr(error, "strerror", None) or " ".join(str(error).split())[:160]
        raise ValueError(f"{given}: cannot be read as a table ({why}); give a file beside the study file") from error
    columns = {}
    for name, column in zip(names, table.columns, strict=True):
        if name in columns:
            raise ValueError(f"{given}: has the column {checks.shown(name)} twice; keep one")
        if not name:
            raise ValueError(f"{given}: has a column without a name; the first line must name the parameters")
        kind = column.type.value_type if types.is_dictionary(column.type) else column.type
        is_known = (types.is_string, types.is_large_string, types.is_integer, types.is_floating, types.is_boolean)
        if not any(one(kind) for one in (*is_known, types.is_null)):
            raise ValueError(
                f"{given}: column {checks.shown(name)} has the type {kind}; a parameter is a number, a boolean, or a "
                "text in UTF-8"
            )
        columns[name] = column.to_pylist()
        row = next((row for row, value in enumerate(columns[name], 1) if value is None or value != value), None)
        if row is not None:
            raise ValueError(f"{given}: row {row} has no value for {checks.shown(name)}; give one, or remove the row")
    return columns
