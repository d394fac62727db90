"""The gathering index: does random exploration show how many neighbours a team with skill has? For any task.

For each task and team size N: δ by random exploration, δ of the team with skill, their ratio (the gathering index), and
where the objective saturates against δ. Judges whether exploration may be trusted (claims G1 to G4), and measures again
until δ holds. Writes a page, a picture, a table of all runs with their seeds, one of the index, and one of the rounds.
About the result: docs/tasks/gathering.md.

\b
Examples:
  teamsight reproduce gathering --task cmommt --out gathering
  teamsight reproduce gathering --sizes 4,8 --set radius=3 --runs 100
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamsight.analysis.papers.reproduction import Paper, PaperPlan, rows_of
from teamsight.analysis.plot import markdown
from teamsight.analysis.plot.kinds import draw_means, mark_values, panels
from teamsight.analysis.plot.style import COLOURS, FAINT, INK, ROBOTS_LABEL, minus
from teamsight.analysis.runs import limits
from teamsight.analysis.stats.paired import Interval, interval_of
from teamsight.analysis.stats.verdicts import FAILS, HOLDS, UNDECIDED
from teamsight.core import checks
from teamsight.core.component import Allowed, Count, Seed, assignments, value_in
from teamsight.tasks.registry import TASKS

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

    from teamsight.agents.awareness import Awareness
    from teamsight.agents.reused_worlds import ReusedWorlds
    from teamsight.agents.world import World
    from teamsight.analysis.runs.checkpoint import Checkpoint, Key
    from teamsight.analysis.runs.executor import Executor
    from teamsight.analysis.runs.simulate import Watch
    from teamsight.tasks.task import Named, Task

__all__ = ["Gathering", "GatheringPlan", "Iteration", "gather", "iterate_delta"]

Answer = Literal["yes", "no", "undecided"]

#: The δ of a team with a degree of awareness of its own.
OWN = -1
#: The confidence with which the bounds of a cell hold together.
CONFIDENCE = 0.95

# Bounds of two values of δ: each may fail with a quarter of the remaining probability.
_BOUND = 1 - (1 - CONFIDENCE) / 4
# The probability with which the bounds of a cell fail, and with which a verdict for all cells may.
_ERROR = 1 - CONFIDENCE
# Teams of at most so many robots are those of the classics; from so many on the method has something to decide.
_SMALL, _LARGE = 5, 8
_NOTHING = Interval(0.0, 0.0, 0.0)
# The series of a task: attribute, label, colour and mark.
_SERIES = (
    ("explore", "δ by exploration", COLOURS[1], "o"),
    ("skilled", "δ of the team with skill", COLOURS[2], "s"),
    ("saturation", "objective saturates", COLOURS[3], "^"),
)
_MARKS, _COLOURS = "os^Dv*PX", (*COLOURS, INK)
# By this share the marks of a series stand beside those of the one before, so that both are seen.
_BESIDE = 0.04
# Where an infinite bound of the index ends, over the largest finite number.
_BEYOND = 2.0
_TICKS = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
_GATHERS = {True: "yes", False: "no", None: "unknown"}
# The columns of the table of the index.
_COLUMNS = """
task gathers size explore_delta explore_low explore_high skilled_delta skilled_low skilled_high saturation_delta
saturation_low saturation_high ratio ratio_low ratio_high gain gain_low gain_high skill skill_low skill_high objective
tolerance censored too_few too_many crowded has_skill enough_at_explore enough_at_skilled
"""
_SIGNS = {HOLDS: HOLDS, FAILS: "**fails**", UNDECIDED: "?", "yes": "yes", "no": "**no**"}
_PAGE = """
# The gathering index

δ by random exploration, δ of the team with skill, and their ratio: above 1, exploration shows too few neighbours, if
the team with skill is the better one (by 95 %; ? is undecided). Intervals in brackets hold together, for each task and
N, with {confidence:.0%}.

| task | gathers | N | skilled is better | δ(explore) | δ(skilled) | gathering index | an exploration shows fewer | shows more | robot-steps with more than δ(explore) | saturates at δ |
| :--- | :--- | ---: | :--- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |
{index}

## Where the objective saturates

δ from which on the objective falls short of that with N − 1 teammates by at most the tolerance, whether it is shown to
be enough with the two δ above, and what all N − 1 teammates are worth.

| task | N | objective with N − 1 | gain of awareness | saturates at δ | enough at δ(explore) | enough at δ(skilled) | censored |
| :--- | ---: | ---: | ---: | ---: | :--- | :--- | ---: |
{saturation}

## Claims

| claim | statement | rule |
| --- | --- | --- |
{claims}

## Verdicts

For N from small to large; ? is undecided.

{summary}

## All verdicts

| claim | task | N | verdict | measured |
| --- | --- | --- | --- | --- |
{verdicts}

## Explore, act, measure again

The team with skill gets the δ of the exploration, then the one that it needed with that, until it holds. At last it is
compared with a team with N − 1.

| task | N | δ of the rounds | more runs | more trainings | enough | falls short by |
| :--- | ---: | :--- | ---: | ---: | :--- | ---: |
{rounds}

## Conditions

{conditions}
"""  # noqa: E501

_Share = Annotated[float, Allowed(above=0.0, most=1.0)]
_Size = Annotated[int, Allowed(least=2)]


def _values(texts: Iterable[str]) -> dict[str, Any]:
    """Return values by name, each given as NAME=VALUE; several with commas between them are a tuple."""
    found = {}
    for name, value in assignments("set", texts).items():
        parts = tuple(value_in(one.strip()) for one in value.split(",")) if isinstance(value, str) else (value,)
        found[name] = parts if len(parts) > 1 else parts[0]
    return found


@dataclass(frozen=True)
class GatheringPlan(PaperPlan):
    """What is simulated, and what counts as enough.

    Parameters
    ----------
    task : sequence of Task or str
        Tasks, with commas between them; each needs a team that explores and one with skill.
    sizes : sequence of int
        N, the sizes of the team, at least 2.
    runs : int
        Number of runs of each team and δ; a risk of 0.05 needs 86 for intervals that hold together with 95 %.
    steps : int, optional
        Number of steps of each run.
    risk : float
        Accepted probability that any robot has more than δ neighbours during a run.
    tolerance : float
        By which share of the objective a δ may fall short of all N − 1 teammates and be enough.
    degree : "nearest" or "ring"
        Degree of awareness with δ: a list of the δ nearest teammates, or a ring of δ sectors.
    trainings : int
        How often a team that learns does so anew for each δ. They share the runs, and the intervals of the objective
        are over trainings.
    set : mapping of str to object
        A value of the scenario of all tasks, or of one, as in forage.side=64; or, with commas between them, one for
        each N. May be given several times.
    seed : int
        Seed of all runs.
    deltas : sequence of int
        δ at which the objective is measured, beside 0, N − 1 and those of both teams. Fewer save trainings of a team
        that learns.

    Raises
    ------
    TypeError, ValueError
        If a value is of the wrong type or outside its limits, or a task has no team with skill.
    """

    task: Annotated[Sequence[Annotated[Task | str, Allowed(choices=TASKS)]], Allowed()] = ("cmommt",)
    sizes: Annotated[Sequence[_Size], Allowed(most=20)] = (4, 8, 16, 30)
    runs: Annotated[limits.Runs, Allowed(least=2, cure=("an interval needs two runs", "give fewer"))] = 200
    steps: Annotated[limits.Steps | None, Allowed(shown="that of each task")] = None
    risk: _Share = 0.05
    tolerance: _Share = 0.02
    degree: Annotated[str, Allowed(choices=("nearest", "ring"))] = "nearest"
    trainings: Count = 1
    set: Annotated[Mapping[str, Any], Allowed(parse=_values)] = field(default_factory=dict)
    seed: Seed = 0
    deltas: Annotated[Sequence[Count], Allowed(most=100, is_sorted=True)] = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64)

    def __post_init__(self) -> None:
        super().__post_init__()
        names = [task.name for task in self.tasks]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"task: {name!r} is the name of two; give each task once")
        if not names or not self.sizes:
            raise ValueError(f"{'sizes' if names else 'task'}: there are none; give at least one")
        checks.count("trainings", self.trainings, most=self.runs, cure="trainings share the runs, at least one each")
        for name, value in self.set.items():
            prefix, dot, _ = name.rpartition(".")
            if dot and prefix not in names:
                raise ValueError(
                    f"set: {name!r} is of the task {prefix!r}, which is not compared; "
                    f"{checks.suggestion(prefix, names)}the tasks are {', '.join(names)}"
                )
            if isinstance(value, (list, tuple)) and len(value) != len(self.sizes):
                raise ValueError(
                    f"set: {name}={checks.shown(value)} has {len(value)} values; give one, or one for each of the "
                    f"{len(self.sizes)} sizes"
                )
        for task in self.tasks:
            for treatment in ("explore", "skilled"):
                if task.teams[treatment] is None:
                    task.parameters(treatment)  # type: ignore[arg-type]
            if task.size in self._own(task):
                raise ValueError(f"set: {task.size} is N, the size of the team; give it as sizes")
            task.full_scenario(self._own(task))
        # From small to large, and what was given for each with it.
        order = np.argsort(self.sizes)
        sorted_values = {
            name: [value[at] for at in order] if isinstance(value, (list, tuple)) else value
            for name, value in self.set.items()
        }
        object.__setattr__(self, "set", sorted_values)
        object.__setattr__(self, "sizes", tuple(self.sizes[at] for at in order))

    @property
    def tasks(self) -> tuple[Task, ...]:
        """The tasks as objects."""
        from teamsight.tasks.named import task_of

        return tuple(map(task_of, self.task))

    @property
    def cells(self) -> list[tuple[Task, int]]:
        """Each task with each size."""
        return [(task, size) for task in self.tasks for size in self.sizes]

    def _own(self, task: Task) -> dict[str, Any]:
        """Return the values that are for a task; those for it alone go before those for all."""
        prefix = f"{task.name}."
        common = {name: value for name, value in self.set.items() if "." not in name}
        return common | {name.removeprefix(prefix): one for name, one in self.set.items() if name.startswith(prefix)}

    def steps_of(self, task: Task) -> int:
        """Return the steps of a run of a task."""
        return task.steps if self.steps is None else self.steps

    def scenario_of(self, task: Task, size: int) -> dict[str, Any]:
        """Return the whole scenario of a task with a team of this size."""
        at = list(self.sizes).index(size)
        own = {name: one[at] if isinstance(one, list) else one for name, one in self._own(task).items()}
        return task.full_scenario({**own, task.size: size})

    def awareness(self, delta: int) -> Awareness:
        """Return the degree of awareness with δ inputs, or places; without any it is none."""
        from teamsight.agents.awareness.registry import awareness_named

        return awareness_named("none") if delta == 0 else awareness_named(self.degree, {"delta": delta})

    def deltas_of(self, size: int, further: Iterable[int] = ()) -> list[int]:
        """Return the δ at which the objective of a team of N robots is measured, with those of both teams."""
        return sorted({delta for delta in (0, *self.deltas, *further, size - 1) if delta < size})

    def conditions(self) -> dict[str, Any]:
        """Return the conditions of all results, fit for JSON."""
        return {
            "tasks": [task.name for task in self.tasks],
            "sizes": list(self.sizes),
            "runs": self.runs,
            "steps": {task.name: self.steps_of(task) for task in self.tasks},
            "risk": self.risk,
            "tolerance": self.tolerance,
            "degree": self.degree,
            "trainings": self.trainings,
            "deltas": list(self.deltas),
            "scenario": dict(self.set),
            "seed": self.seed,
        }


class Team(NamedTuple):
    """One team whose runs are measured."""

    task: Task
    size: int
    treatment: Named
    delta: int = OWN

    @property
    def learns(self) -> bool:
        """Whether the team has to learn."""
        return callable(self.task.teams[self.treatment])


@dataclass(frozen=True)
class _Exposure:
    """Measures the task, and counts the robot-steps with 0, 1, 2 … neighbours."""

    task: Task

    def __call__(self, world: World, steps: int) -> dict[str, Any]:
        from teamsight.analysis.runs.run import TaskMeasure
        from teamsight.analysis.teams import active_team_graph

        counts, end = np.zeros(1, np.int64), world.tick + steps
        while world.tick < end and world.running:
            world.run(1)
            here = np.bincount(active_team_graph(world, self.task.team).degree, minlength=len(counts))
            here[: len(counts)] += counts
            counts = here
        return TaskMeasure(self.task).columns(world) | {"robot_steps": counts.tolist()}


@dataclass(frozen=True)
class _TeamRuns:
    """Runs of a team: a job that lets the team learn first, if it has to, so that workers train side by side."""

    plan: GatheringPlan
    team: Team
    training: int
    trainings: int

    @property
    def replicates(self) -> range:
        """The numbers of its runs; trainings share them."""
        return range(self.training, self.plan.runs, self.trainings)

    @property
    def seeds(self) -> list[int]:
        """The seeds of the runs."""
        from teamsight.analysis.runs.run import task_seed

        task, scenario = self.team.task, self.plan.scenario_of(self.team.task, self.team.size)
        return [task_seed(task, self.plan.seed, replicate, scenario) for replicate in self.replicates]

    @property
    def key(self) -> Key:
        from teamsight.analysis.runs.checkpoint import code_digest, modules_of
        from teamsight.analysis.runs.seeds import canonical

        task, size, treatment, delta = self.team
        # What a team has learned may have no text of its own, so it is known by how it was learned.
        return (
            task.name, canonical(self.plan.scenario_of(task, size)), treatment, f"{self.plan.degree} {delta}",
            f"training {self.plan.seed + self.training}", f"steps={self.plan.steps_of(task)}", *map(str, self.seeds),
            code_digest(__name__, *modules_of(task)),
        )  # fmt: skip

    @property
    def cost(self) -> float:
        return float(len(self.replicates) * self.plan.steps_of(self.team.task) * self.team.size / 15)

    def make(self, worlds: ReusedWorlds) -> list[dict[str, Any]]:
        """Let the team learn, if it has to, and return a row for each run; see `Runs`."""
        from teamsight.analysis.runs.run import NEIGHBOURS, TaskMeasure, task_run

        task, size, treatment, delta = self.team
        awareness = None if delta == OWN else self.plan.awareness(delta)
        scenario, rng = self.plan.scenario_of(task, size), self.plan.seed + self.training
        parameters = task.parameters(treatment, scenario, awareness=awareness, rng=rng)
        # δ of both teams comes from these runs, and so does what a robot meets beyond it.
        measure, steps = _Exposure(task) if delta == OWN else TaskMeasure(task), self.plan.steps_of(task)
        runs = [task_run(task, parameters, seed, steps, measure) for seed in self.seeds]
        worlds.expect((run.parameters, run.seed) for run in runs)
        rows = []
        for replicate, run in zip(self.replicates, runs, strict=True):
            found = run.make(worlds)
            value = found[task.objective.metric]
            rows.append({
                "task": task.name, "size": size, "treatment": treatment, "delta": delta, "training": self.training,
                "replicate": replicate, "seed": run.seed, "steps": steps, "value": value,
                "counted": task.objective.counted(value, steps), **{name: found[name] for name in NEIGHBOURS},
                "robot_steps": found.get("robot_steps"),
            })  # fmt: skip
        return rows

    def describe(self) -> str:
        """Return the job in words."""
        team = self.team
        degree = "its own degree" if team.delta == OWN else f"{self.plan.degree} δ={team.delta}"
        return f"{len(self.replicates)} runs of {team.task.name}, {team.treatment}, N={team.size}, {degree}"


class Runs:
    """The runs of a plan, each made once.

    Attributes
    ----------
    table : DataFrame
        One row for each run: task, size, treatment, delta (−1 for the degree of the team's own), training, replicate,
        seed, steps, value (of the objective; infinite for a censored run), counted, max_neighbours, mean_neighbours,
        and for teams with a degree of their own robot_steps: how many a robot had 0, 1, 2 … neighbours.
    """

    def __init__(
        self, plan: GatheringPlan, pool: Executor | None = None, watch: Watch = lambda phase, done, total: None,
        checkpoint: Checkpoint | None = None, table: pd.DataFrame | None = None,
    ) -> None:  # fmt: skip
        import pandas as pd

        self.plan, self.table = plan, pd.DataFrame() if table is None else table
        self._pool, self._watch, self._checkpoint = pool, watch, checkpoint

    def of(self, phase: str, *teams: Team) -> pd.DataFrame:
        """Return the runs of teams; make those that are missing."""
        import pandas as pd

        from teamsight.analysis.runs.simulate import run_all

        jobs = [
            _TeamRuns(self.plan, team, training, count)
            for team in teams
            if self._has(team).empty
            for count in (self.plan.trainings if team.learns else 1,)
            for training in range(count)
        ]
        if jobs:
            watch = self._watch
            measured = run_all(
                jobs, self._pool, progress=lambda done, total: watch(phase, done, total), checkpoint=self._checkpoint
            )
            made = pd.DataFrame([row for rows in measured for row in rows])
            self.table = pd.concat([self.table, made], ignore_index=True)
        return pd.concat([self._has(team) for team in teams], ignore_index=True)

    def _has(self, team: Team) -> pd.DataFrame:
        if self.table.empty:
            return self.table
        task, size, treatment, delta = team
        return rows_of(self.table, task=task.name, size=size, treatment=treatment, delta=delta)


class DeltaInterval(NamedTuple):
    """δ for the risk, and its bounds.

    Attributes
    ----------
    delta : int
        The smallest δ that at most the share `risk` of the runs exceeded.
    low, high : int
        The smallest δ that the runs do not refute, and the smallest that they support.
    """

    delta: int
    low: int
    high: int

    def __str__(self) -> str:
        return f"{self.delta} ({self.low} to {self.high})"


class Cell(NamedTuple):
    """A task and a team size.

    Attributes
    ----------
    task : str
        The name of the task.
    gathers : bool or None
        Whether success brings its team together.
    size : int
        N.
    explore, skilled : DeltaInterval
        δ of both teams.
    ratio : Interval
        The gathering index δ(skilled) / δ(explore) with its bounds; ``mean`` is the ratio of the point estimates.
    saturation : DeltaInterval
        The smallest δ from which on the objective is within the tolerance of that with all N − 1 teammates.
    shortfall : dict of int to Interval
        For each δ, by how much the objective falls short of that with N − 1; paired, positive is worse. The intervals
        hold together; they are infinite if all runs with N − 1 are censored.
    objective : float
        The mean of the objective with N − 1.
    tolerance : float
        The shortfall that is accepted, in the unit of the objective.
    gain : Interval
        The gain of awareness: the objective with N − 1 over that with 0; paired, positive is better.
    censored : float
        The share of runs of the team with skill in which what was to happen did not happen.
    explored : Interval, optional
        The shortfall at δ(explore), with bounds that hold together for all cells of the plan.
    too_few, too_many : float
        The shares of seeds under which the exploration shows a smaller, and a larger, largest number of neighbours than
        the team with skill has; without a difference between the teams both are alike.
    skill : Interval, optional
        The objective of the team with skill over that of the exploration, each with its own degree; paired, positive is
        better.
    crowded : float
        The share of the robot-steps of the team with skill in which a robot has more than δ(explore) neighbours.
    """

    task: str
    gathers: bool | None
    size: int
    explore: DeltaInterval
    skilled: DeltaInterval
    ratio: Interval
    saturation: DeltaInterval
    shortfall: dict[int, Interval]
    objective: float
    tolerance: float
    gain: Interval
    censored: float
    explored: Interval | None = None
    too_few: float = 0.0
    too_many: float = 0.0
    skill: Interval = Interval(math.inf, math.inf, math.inf)
    crowded: float = 0.0

    @property
    def has_skill(self) -> Answer:
        """Whether the team with skill is better than the one that explores, by the bounds of the difference."""
        return "yes" if self.skill.low > 0 else "no" if self.skill.high <= 0 else "undecided"

    def is_enough(self, delta: int) -> Answer:
        """Return whether the objective with δ is within the tolerance of that with all N − 1 teammates."""
        return is_enough(self.shortfall[delta], self.tolerance)

    @property
    def is_shown_short(self) -> bool:
        """Whether δ(explore) is shown not to be enough, by bounds that hold together for all cells of the plan."""
        return is_enough(self.explored or self.shortfall[self.explore.delta], self.tolerance) == "no"

    @property
    def row(self) -> dict[str, Any]:
        """The cell as a row of the table of the index."""
        found = self._asdict() | {"has_skill": self.has_skill}
        for name in ("explore", "skilled", "saturation"):
            found |= {f"{name}_{part}": one for part, one in found.pop(name)._asdict().items()}
        for name in ("ratio", "gain", "skill"):
            found[name], found[f"{name}_low"], found[f"{name}_high"] = found.pop(name)
        for name in ("explore", "skilled"):
            found[f"enough_at_{name}"] = self.is_enough(found[f"{name}_delta"])
        return {name: found[name] for name in _COLUMNS.split()}


def is_enough(shortfall: Interval, tolerance: float) -> Answer:
    """Return whether a shortfall is within the tolerance by its bounds."""
    return "yes" if shortfall.high <= tolerance else "no" if shortfall.low > tolerance else "undecided"


def delta_interval(maxima: NDArray[np.int64], size: int, risk: float) -> DeltaInterval:
    """Return δ for a risk from the largest number of neighbours in each run, shape (runs,)."""
    from teamsight.analysis.stats import exceedance

    curve = exceedance.curve(maxima, size, confidence=_BOUND)
    return DeltaInterval(*(exceedance.smallest_delta(curve, name, risk) for name in ("probability", "low", "high")))


def ratio(skilled: DeltaInterval, explore: DeltaInterval) -> Interval:
    """Return δ(skilled) / δ(explore) with bounds that hold together; 0 / 0 is 1."""

    def quotient(one: int, other: int) -> float:
        return one / other if other else math.inf if one else 1.0

    return Interval(
        quotient(skilled.delta, explore.delta), quotient(skilled.low, explore.high), quotient(skilled.high, explore.low)
    )  # fmt: skip


def values_of(rows: pd.DataFrame) -> NDArray[np.float64]:
    """Return the objective of a team, one value for each replicate, or for each training if there are several."""
    rows = rows.sort_values(["training", "replicate"])
    if rows["training"].nunique() > 1:
        return rows.groupby("training")["counted"].mean().to_numpy(np.float64)
    return rows["counted"].to_numpy(np.float64)


def cell_of(plan: GatheringPlan, table: pd.DataFrame, task: Task, size: int) -> Cell:
    """Return a cell from the runs of both teams, and of the team with skill under each δ; `table` is that of `Runs`."""
    table, sign = rows_of(table, task=task.name, size=size), task.objective.sign
    runs = {name: rows_of(table, treatment=name, delta=OWN) for name in ("explore", "skilled")}
    explore, skilled = (delta_interval(one["max_neighbours"].to_numpy(), size, plan.risk) for one in runs.values())
    curve = rows_of(table, treatment="skilled").query(f"delta != {OWN}")
    by_delta = {int(delta): values_of(rows) for delta, rows in curve.groupby("delta")}  # type: ignore[arg-type]
    full = by_delta[size - 1]
    worse = {delta: sign * (full - values) for delta, values in by_delta.items() if delta < size - 1}
    level = 1 - (1 - CONFIDENCE) / max(len(worse), 1)
    if np.isinf(rows_of(curve, delta=size - 1)["value"]).all():
        # All runs are censored: nothing is known of how much worse or better others are.
        shortfall = {delta: Interval(float(one.mean()), -math.inf, math.inf) for delta, one in worse.items()}
        explored = shortfall.get(explore.delta, _NOTHING)
    else:
        shortfall = {delta: interval_of(one, level) for delta, one in worse.items()}
        at = worse.get(explore.delta)
        explored = _NOTHING if at is None else interval_of(at, 1 - (1 - level) / len(plan.cells))
    shortfall[size - 1] = _NOTHING
    objective = float(full.mean())
    tolerance = plan.tolerance * abs(objective)
    both = runs["explore"].merge(runs["skilled"], on="replicate", validate="1:1", suffixes=("_explore", ""))
    fewer = both["max_neighbours"] - both["max_neighbours_explore"]
    better = both.assign(counted=sign * (both["counted"] - both["counted_explore"]))
    robot_steps = runs["skilled"]["robot_steps"]
    above = sum(sum(counts[explore.delta + 1 :]) for counts in robot_steps)
    return Cell(
        task.name, task.gathers, size, explore, skilled, ratio(skilled, explore), saturation(shortfall, tolerance),
        shortfall, objective, tolerance,
        gain=interval_of(sign * (full - by_delta[0])),
        censored=float(np.isinf(runs["skilled"]["value"].to_numpy()).mean()),
        explored=explored,
        too_few=float((fewer > 0).mean()),
        too_many=float((fewer < 0).mean()),
        skill=interval_of(values_of(better)),
        crowded=float(above / max(sum(map(sum, robot_steps)), 1)),
    )  # fmt: skip


def saturation(shortfall: dict[int, Interval], tolerance: float) -> DeltaInterval:
    """Return the smallest δ from which on no shortfall exceeds the tolerance, by means and by bounds.

    Parameters
    ----------
    shortfall : dict of int to Interval
        For each δ that was measured; its intervals hold together, so those of the result do, too.
    tolerance : float
        What is accepted.
    """
    found = sorted(shortfall)
    # By the mean, by the lower bound and by the upper one: the first δ after the last that is too short.
    last = (max((delta for delta in found if shortfall[delta][end] > tolerance), default=-1) for end in range(3))
    return DeltaInterval(*(next(delta for delta in found if delta > wrong) for wrong in last))


class CellClaim(NamedTuple):
    """A claim.

    Attributes
    ----------
    statement : str
        What it says of one task and team size.
    rule : str
        When it holds, and when it does not.
    applies : callable
        Whether it is about a cell.
    judge : callable
        Its verdict on a cell.
    """

    statement: str
    rule: str
    applies: Callable[[Cell], bool]
    judge: Callable[[Cell], str]


class CellVerdict(NamedTuple):
    """A claim judged for one task and team size, or for all (an empty task, size 0)."""

    claim: str
    task: str
    size: int
    outcome: str
    measured: str


def _outcome(holds: bool, fails: bool) -> str:
    return HOLDS if holds else FAILS if fails else UNDECIDED


def _can_say(cell: Cell) -> bool:
    """Return whether the order of both δ is open, and that of a team with skill."""
    return cell.explore.low < cell.size - 1 and cell.has_skill != "no"


#: The claims that are judged for each cell, by name.
CLAIMS: dict[str, CellClaim] = {
    "G1": CellClaim(
        "Where success disperses the team, exploration shows at least as many neighbours as skill.",
        "holds if δ(explore) ≥ δ(skilled) for all values within the bounds, does not hold if for none; where "
        "exploration shows all N − 1 it would hold whatever happens, and where the team with skill is not better "
        "than the one that explores it says nothing: not judged",
        lambda cell: cell.gathers is False and _can_say(cell),
        lambda cell: _outcome(cell.skilled.high <= cell.explore.low, cell.skilled.low > cell.explore.high),
    ),
    "G2": CellClaim(
        "Where success gathers the team, exploration shows fewer neighbours than skill.",
        "holds if δ(explore) < δ(skilled) for all values within the bounds, does not hold if for none; where "
        "exploration shows all N − 1 it would not hold whatever happens, and where the team with skill is not "
        "better than the one that explores it says nothing: not judged",
        lambda cell: cell.gathers is True and _can_say(cell),
        lambda cell: _outcome(cell.explore.high < cell.skilled.low, cell.explore.low >= cell.skilled.high),
    ),
    "G3": CellClaim(
        "The objective saturates at or before δ(skilled).",
        "holds if the objective is within the tolerance at δ(skilled) and beyond, by bounds; does not hold if it "
        "is shown to be outside there; where δ(skilled) is N − 1 it would hold whatever happens: not judged",
        lambda cell: cell.skilled.delta < cell.size - 1,
        lambda cell: _outcome(cell.saturation.high <= cell.skilled.delta, cell.saturation.low > cell.skilled.delta),
    ),
    "G4 small": CellClaim(
        "For teams of 2 to 5, δ is N − 1, within one, by exploration: there is nothing to decide.",
        "holds if δ(explore) ≥ N − 2 for all values within the bounds, does not hold if for none",
        lambda cell: cell.size <= _SMALL,
        lambda cell: _outcome(cell.explore.low >= cell.size - 2, cell.explore.high < cell.size - 2),
    ),
    "G4 large": CellClaim(
        "From N = 8 on, exploration shows fewer than N − 2 neighbours: there is something to decide.",
        "holds if δ(explore) < N − 2 for all values within the bounds, does not hold if for none",
        lambda cell: cell.size >= _LARGE,
        lambda cell: _outcome(cell.explore.high < cell.size - 2, cell.explore.low >= cell.size - 2),
    ),
}
#: The claim about all cells together: its name, what it says, and when it holds.
UNRELIABLE = (
    "G3 explore",
    "The objective does not reliably saturate at δ(explore): in some cell it is shown to be outside the tolerance.",
    "holds if one cell is shown to be outside at δ(explore), by bounds that hold together for all cells; does not hold "
    "if all are shown to be within",
)


def judge(cells: Sequence[Cell]) -> list[CellVerdict]:
    """Return the verdict on each claim for each cell that it is about, and that on δ(explore) for all cells.

    For all cells a claim holds if it does in each, and fails if more are against it than by chance.
    """
    found, overall = [], []
    for name, claim in CLAIMS.items():
        outcomes = []
        for cell in cells:
            if claim.applies(cell):
                outcomes.append(claim.judge(cell))
                measured = f"explore {cell.explore}, skilled {cell.skilled}, saturates {cell.saturation}"
                found.append(CellVerdict(name, cell.task, cell.size, outcomes[-1], measured))
        if outcomes:
            most = by_chance(len(outcomes))
            counts = {one: outcomes.count(one) for one in (HOLDS, FAILS, UNDECIDED)}
            outcome = _outcome(counts[HOLDS] == len(outcomes), counts[FAILS] > most)
            shares = ", ".join(f"{number} {one}" for one, number in counts.items())
            overall.append(CellVerdict(name, "", 0, outcome, f"{shares}; up to {most} against by chance"))
    # With all N − 1 teammates nothing can be missing.
    cells = [cell for cell in cells if cell.explore.delta < cell.size - 1]
    answers = [cell.is_enough(cell.explore.delta) for cell in cells]
    # One of many cells would be outside by chance: here bounds hold together for all.
    outcome = _outcome(any(cell.is_shown_short for cell in cells), bool(answers) and {*answers} == {"yes"})
    shares = ", ".join(f"{answers.count(one)} {one}" for one in ("yes", "no", "undecided"))  # type: ignore[arg-type]
    return [*found, *overall, CellVerdict(UNRELIABLE[0], "", 0, outcome, f"enough at δ(explore): {shares}")]


def by_chance(cells: int) -> int:
    """Return of how many cells so many may speak against a true claim by chance, with a probability above 5 %.

    Notes
    -----
    Each cell does so with at most 5 %, and cells have different seeds: a binomial distribution.
    """
    from scipy.stats import binom

    return next(most for most in range(cells + 1) if binom.sf(most, cells, _ERROR) <= _ERROR)


@dataclass(frozen=True)
class Iteration:
    """The rounds of `iterate_delta`.

    Attributes
    ----------
    delta : int
        The δ that the team which has it does not exceed, for the risk.
    rounds : DataFrame
        One row for each round: treatment, used (the δ that the team has; −1 while it explores), delta, low, high (δ
        that it needs, with bounds), objective (its mean), runs, robot_steps, trainings. The last is that of the check
        with all N − 1 teammates, if δ is less.
    shortfall : Interval
        By how much the objective with δ falls short of that with N − 1, paired; 95 %.
    enough : "yes", "no" or "undecided"
        Whether that is within the tolerance. If not, the procedure has ended too early: see Notes of `iterate_delta`.
    """

    delta: int
    rounds: pd.DataFrame
    shortfall: Interval
    enough: Answer

    @property
    def used(self) -> list[int]:
        """The δ of the rounds after the exploration, without the check."""
        used = self.rounds.loc[self.rounds["treatment"] == "skilled", "used"].tolist()
        return used if used[-1] == self.delta else used[:-1]

    @property
    def runs(self) -> int:
        """The runs that the procedure needs beside those of the exploration."""
        return int(self.rounds["runs"].iloc[1:].sum())

    @property
    def cost(self) -> float:
        """All steps of robots, over those of the exploration alone; steps of learning are not in it."""
        return float(self.rounds["robot_steps"].sum() / self.rounds["robot_steps"].iloc[0])

    @property
    def trainings(self) -> int:
        """How often the team learned."""
        return int(self.rounds["trainings"].sum())


def iterate_delta(
    task: Task | str, *, scenario: Mapping[str, Any] | None = None, rng: int = 0, pool: Executor | None = None,
    **settings: Any,
) -> Iteration:  # fmt: skip
    """Choose δ by exploration, let the team with skill act with it, and measure again until it is large enough.

    Parameters
    ----------
    task : Task or str
        The task.
    scenario : mapping, optional
        Values of its scenario, N among them.
    rng : int
        Root seed.
    pool : Executor, optional
        Who does the work; by default this process. The result does not depend on it.
    **settings
        runs, steps, risk, tolerance, degree and trainings of `GatheringPlan`.

    Returns
    -------
    Iteration

    Raises
    ------
    TypeError, ValueError
        As for `GatheringPlan`.

    Notes
    -----
    δ of a round is the smallest that its runs support. The next round has the larger of this and the last δ, so there
    are at most N − 1 rounds after the exploration. The result is a δ that suffices for the team that *has* it: a team
    whose skill needs more neighbours than it perceives may fail to gather, and then shows few. So the last round
    compares the objective with that of a team with all N − 1 teammates. Neighbours alone cannot show this.
    """
    from teamsight.tasks.named import task_of

    found, given = task_of(task), dict(scenario or {})
    size = int(given.pop(found.size, found.scenario[found.size]))
    return iterate(Runs(GatheringPlan((found,), (size,), set=given, seed=rng, **settings), pool), found, size)


def iterate(runs: Runs, task: Task, size: int) -> Iteration:
    """Return the rounds for a task and a team size; see `iterate_delta`."""
    import pandas as pd

    rows, plan = [], runs.plan

    def round_of(treatment: Named, used: int = OWN) -> tuple[pd.DataFrame, int]:
        """Make a round, and return its runs, and the δ that they support."""
        team = Team(task, size, treatment, used)
        table = runs.of("measured again", team)
        interval = delta_interval(table["max_neighbours"].to_numpy(), size, plan.risk)
        rows.append({
            "treatment": treatment, "used": used, **interval._asdict(), "objective": float(table["counted"].mean()),
            "runs": len(table), "robot_steps": size * plan.steps_of(task) * plan.runs,
            "trainings": plan.trainings if team.learns else 0,
        })  # fmt: skip
        return table, interval.high

    delta, (table, needed) = OWN, round_of("explore")
    while needed > delta:
        delta = needed
        table, needed = round_of("skilled", delta)
    full = table if delta == size - 1 else round_of("skilled", size - 1)[0]
    best = values_of(full)
    shortfall = interval_of(task.objective.sign * (best - values_of(table))) if delta < size - 1 else _NOTHING
    return Iteration(delta, pd.DataFrame(rows), shortfall, is_enough(shortfall, plan.tolerance * abs(best.mean())))


class Gathering(NamedTuple):
    """What was found.

    Attributes
    ----------
    runs : DataFrame
        One row for each run; see `Runs`.
    cells : list of Cell
        One for each task and team size.
    verdicts : list of CellVerdict
        On G1 to G4.
    iterations : dict of (str, int) to Iteration
        The rounds of `iterate_delta` for each task and team size.
    """

    runs: pd.DataFrame
    cells: list[Cell]
    verdicts: list[CellVerdict]
    iterations: Mapping[tuple[str, int], Iteration]

    @property
    def frame(self) -> pd.DataFrame:
        """The cells as a table."""
        import pandas as pd

        return pd.DataFrame([cell.row for cell in self.cells])

    @property
    def rounds(self) -> pd.DataFrame:
        """The rounds of all iterations as a table."""
        import pandas as pd

        tables = [one.rounds.assign(task=task, size=size) for (task, size), one in self.iterations.items()]
        return pd.concat(tables, ignore_index=True)


def gather(
    plan: GatheringPlan,
    pool: Executor | None = None,
    watch: Watch = lambda phase, done, total: None,
    checkpoint: Checkpoint | None = None,
    runs: pd.DataFrame | None = None,
) -> Gathering:
    """Simulate, and judge the claims.

    Parameters
    ----------
    plan : GatheringPlan
        What to simulate.
    pool : Executor, optional
        Who does the work; by default this process. The result does not depend on it.
    watch : callable
        Called with the phase, the work done in it and its work in all.
    checkpoint : Checkpoint, optional
        File of finished runs.
    runs : DataFrame, optional
        Runs of this plan that were made before, as in `Gathering.runs`: they are not made again.
    """
    from teamsight.analysis.runs.run import NEIGHBOURS

    made, curves = Runs(plan, pool, watch, checkpoint, runs), []
    both: tuple[Named, Named] = ("explore", "skilled")
    made.of("both teams", *(Team(task, size, name) for task, size in plan.cells for name in both))
    for task, size in plan.cells:
        maxima = (made.of("both teams", Team(task, size, name))["max_neighbours"].to_numpy() for name in both)
        explore, skilled = (delta_interval(one, size, plan.risk) for one in maxima)
        proposed = (explore.delta, explore.high, skilled.delta)
        curves += [Team(task, size, "skilled", delta) for delta in plan.deltas_of(size, proposed)]
    made.of("against δ", *curves)
    iterations = {(task.name, size): iterate(made, task, size) for task, size in plan.cells}
    cells = [cell_of(plan, made.table, task, size) for task, size in plan.cells]
    made.table.attrs["measures"] = ["value", "counted", *NEIGHBOURS, "robot_steps"]
    return Gathering(made.table, cells, judge(cells), iterations)


def draw(found: Gathering, plan: GatheringPlan) -> Canvas:
    """Return δ of both teams and where the objective saturates, against N for each task; and the gathering index."""
    tasks = {cell.task: {True: "gathers", False: "disperses", None: "unknown"}[cell.gathers] for cell in found.cells}
    few, many = sum(cell.ratio.low > 1 for cell in found.cells), sum(cell.ratio.high < 1 for cell in found.cells)
    figure, shown = panels(
        f"Exploration shows fewer neighbours than skill in {few} of {len(found.cells)} cells, more in {many}",
        f"{plan.runs:,} runs each; δ for a risk of {plan.risk:g}; bounds hold together with 95 %; degree "
        f"{plan.degree}; seed {plan.seed}",
        [*(f"{task} ({gathers})" for task, gathers in tasks.items()), "above 1: exploration shows too few"],
        x=ROBOTS_LABEL, y=[*("δ" for _ in tasks), "index δ(skilled) / δ(explore)"],
        columns=math.ceil(math.sqrt(len(tasks) + 1)), size=(3.5, 3.0),
    )  # fmt: skip
    for axes, task in zip(shown, tasks, strict=False):
        cells = [cell for cell in found.cells if cell.task == task]
        sizes = np.array([cell.size for cell in cells], np.float64)
        axes.plot(sizes, sizes - 1, color=FAINT, linewidth=0.8, linestyle=":", label="N − 1")
        for place, (name, label, colour, mark) in enumerate(_SERIES):
            values, x = [getattr(cell, name) for cell in cells], sizes * (1 + (place - 1) * _BESIDE)
            draw_means(axes, x, values, colour, label, as_bars=True, marker=mark)
        axes.set_ylim(bottom=-0.5)
    _draw_index(shown[-1], found.cells, list(tasks))
    for axes in shown:
        mark_values(axes, np.unique([cell.size for cell in found.cells]).tolist())
    shown[0].legend(frameon=False, fontsize=8)
    return figure


def _draw_index(axes: Axes, cells: Sequence[Cell], tasks: Sequence[str]) -> None:
    """Draw the gathering index of all tasks against N."""
    ends = [value for cell in cells for value in cell.ratio if np.isfinite(value) and value > 0]
    least, most = min(ends, default=1.0) / _BEYOND, max(ends, default=1.0) * _BEYOND
    for number, name in enumerate(tasks):
        own = [cell for cell in cells if cell.task == name]
        values = np.clip(np.array([cell.ratio for cell in own], np.float64), least, most)
        x = np.array([cell.size for cell in own]) * (1 + number * _BESIDE)
        colour, mark = _COLOURS[number % len(_COLOURS)], _MARKS[number % len(_MARKS)]
        draw_means(axes, x, values, colour, name, as_bars=True, marker=mark)
    axes.axhline(1.0, color=FAINT, linewidth=0.8, linestyle=":")
    axes.set(yscale="log", ylim=(least, most))
    inside = [tick for tick in _TICKS if least <= tick <= most]
    axes.set_yticks(inside, [f"{tick:g}" for tick in inside])
    axes.legend(frameon=False, fontsize=7, ncols=2)


def page_values(found: Gathering, plan: GatheringPlan) -> Mapping[str, Any]:
    """Return the values of the page."""
    claims = [*((name, claim.statement, claim.rule) for name, claim in CLAIMS.items()), UNRELIABLE]
    saturation = (
        f"| {cell.task} | {cell.size} | {cell.objective:.3g} | {interval_text(cell.gain)} | {cell.saturation} | "
        f"{cell.is_enough(cell.explore.delta)} | {cell.is_enough(cell.skilled.delta)} | {cell.censored:.0%} |"
        for cell in found.cells
    )
    verdicts = (
        f"| {one.claim} | {one.task or 'all'} | {one.size or 'all'} | {_bold(one)} | {one.measured} |"
        for one in found.verdicts
    )
    rounds = (
        f"| {task} | {size} | {' → '.join(map(str, one.used))} | {one.runs} | {one.trainings} | {one.enough} | "
        f"{interval_text(one.shortfall)} |"
        for (task, size), one in found.iterations.items()
    )
    return {
        "confidence": CONFIDENCE, "index": index_rows(found.cells), "saturation": "\n".join(saturation),
        "claims": "\n".join(f"| {' | '.join(one)} |" for one in claims), "summary": summary_table(found.verdicts),
        "verdicts": "\n".join(verdicts), "rounds": "\n".join(rounds),
        "conditions": "\n".join(f"- {line}" for line in _conditions(plan)),
    }  # fmt: skip


def index_rows(cells: Sequence[Cell]) -> str:
    """Return a row for each task and team size: δ of both teams, and their ratio."""
    return "\n".join(
        f"| {cell.task} | {_GATHERS[cell.gathers]} | {cell.size} | {_SIGNS[cell.has_skill]} | {cell.explore} | "
        f"{cell.skilled} | {interval_text(cell.ratio)} | {cell.too_few:.0%} | {cell.too_many:.0%} | "
        f"{cell.crowded:.2%} | {cell.saturation} |"
        for cell in cells
    )


def summary_table(verdicts: Sequence[CellVerdict]) -> str:
    """Return a row for each claim and a column for each task, with a verdict for each N."""
    tasks = list(dict.fromkeys(one.task for one in verdicts if one.task))
    rows = []
    for last in (one for one in verdicts if not one.task):
        own = [one for one in verdicts if one.claim == last.claim]
        by_task = (", ".join(_SIGNS[one.outcome] for one in own if one.task == task) or "–" for task in tasks)
        rows.append([last.claim, *by_task, _bold(last)])
    return markdown.table(["claim", *tasks, "all"], rows)


def summary(found: Gathering, plan: GatheringPlan) -> list[str]:
    """Return a line for each cell, for each whose team with skill is no better than exploration, and for each claim."""
    lines = [
        f"{cell.task}, N={cell.size}: δ(explore) {cell.explore}, δ(skilled) {cell.skilled}, gathering index "
        f"{cell.ratio.mean:.2f}, saturates at {cell.saturation.delta}"
        for cell in found.cells
    ]
    return [
        *lines, *cautions(found.cells),
        *(f"{one.claim}: {one.outcome} ({one.measured})" for one in found.verdicts if not one.task),
    ]  # fmt: skip


def cautions(cells: Sequence[Cell]) -> list[str]:
    """Return one line for each cell whose team with skill is no better than the one that explores."""
    return [
        f"{cell.task}, N={cell.size}: the team with skill is not better than the one that explores ("
        f"{interval_text(cell.skill)}), so its index says nothing of skill; give the task a better team, or more steps"
        for cell in cells
        if cell.has_skill == "no"
    ]


def interval_text(interval: Interval) -> str:
    """Return a number and its bounds."""
    mean, low, high = ("∞" if one == math.inf else f"{one:.3g}" for one in interval)
    return minus(f"{mean} ({low} to {high})")


def _bold(verdict: CellVerdict) -> str:
    return f"**{verdict.outcome}**" if verdict.outcome == FAILS else verdict.outcome


def _conditions(plan: GatheringPlan) -> Iterable[str]:
    steps = ", ".join(f"{task.name} {plan.steps_of(task):,}" for task in plan.tasks)
    yield f"{plan.runs:,} runs of each team and δ; steps of each run: {steps}; root seed {plan.seed}."
    yield f"δ for a risk of {plan.risk:g} that any robot has more than δ neighbours during a run."
    yield (
        f"The objective against δ: the team with skill with the degree {plan.degree!r}, on the same noise for each δ; "
        f"a shortfall of up to {plan.tolerance:.0%} of the objective with N − 1 is accepted."
    )
    yield "The gain is the objective with N − 1 teammates over that with none, paired; positive is better."
    if any(callable(task.skilled) for task in plan.tasks):
        yield f"Teams that learn: {plan.trainings} trainings for each degree, which share the runs."
    if plan.set:
        listed = (
            f"{name}={','.join(map(str, one)) if isinstance(one, list) else one}" for name, one in plan.set.items()
        )
        yield f"Scenario: {'; '.join(listed)}. Several values are for N in order."


PAPER = Paper(
    plan=GatheringPlan, name="gathering", template=_PAGE, values=page_values, figures={"gathering": draw},
    sentences=summary, make=gather, runs=lambda found: found.runs,
    tables={
        "gathering-index.parquet": lambda found, plan: found.frame,
        "gathering-rounds.parquet": lambda found, plan: found.rounds,
    },
    quick={"sizes": (4, 8), "runs": 20, "deltas": (1, 3)},
    small={"sizes": (3,), "runs": 6, "steps": 10, "set": {"radius": 2.0}},
)  # fmt: skip
