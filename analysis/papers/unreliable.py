"""Unreliable teams: δ and the gain from awareness if robots fail, or sense rarely.

Two sweeps over three scenarios of CMOMMT, or over that of another task and its team with skill: robots that fail and
are repaired, with availabilities from 1 to 0.5; and robots that sense and decide every 1 to 50 ticks. In each condition
the same worlds are run with awareness and without, so the gain is paired. Writes a figure for each sweep, a table of
all runs with their seeds, a table of all conditions, and a page. About the result: docs/unreliable.md.

\b
Examples:
  teamsight reproduce unreliable --out unreliable
  teamsight reproduce unreliable --runs 10 --policies a-cmommt
  teamsight reproduce unreliable --runs 400 --repair 20 --seed 7
  teamsight reproduce unreliable --task graze --set robots=8 --out graze
"""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np

from teamsight.analysis.papers.reproduction import Paper, PaperPlan, rows_of, runs_of
from teamsight.analysis.plot import markdown
from teamsight.analysis.plot.kinds import draw_means, mark_values, panels
from teamsight.analysis.plot.style import DEGREE, FAINT, minus
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.seeds import canonical, root
from teamsight.analysis.stats.paired import Interval, interval_of
from teamsight.analysis.stats.verdicts import interval_text, plus_minus, signed_text
from teamsight.core.component import Allowed, Count, Positive, Seed
from teamsight.tasks.registry import TASKS

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

    from teamsight.agents.components import Failures
    from teamsight.agents.decisions import Cycle
    from teamsight.agents.world import World
    from teamsight.analysis.runs.simulate import Planned
    from teamsight.tasks.task import Task

#: The sweeps, what their values are, the title of the figure, the label of its axis, and what is fixed.
SWEEPS = {
    "failures": (
        "Failures", "availability", "Robots that fail",
        "failures in 1,000 ticks of work\n(availability)", "mean time to repair {0.repair:g} ticks",
    ),
    "periods": (
        "Sensing periods", "period", "Robots that sense rarely",
        "sensing period  [ticks]", "phases at random",
    ),
}  # fmt: skip
#: The risk for which δ is stated, and the confidence of each of its bounds.
RISK, CONFIDENCE = 0.05, 0.95
#: The task whose policies and scenarios were chosen by hand; the name of the team of another task.
CMOMMT, SKILLED = "cmommt", "skilled"
#: Numbers of robots and arena radii of CMOMMT: crowded, medium and sparse, chosen before any result; its targets.
SCENARIOS, TARGETS = ((10, 3.0), (10, 5.0), (20, 5.0)), 15
#: For each policy the teams that are compared, a policy and a degree of awareness each: with information about
#: teammates, and without. The evolved policy needs it, so it is compared with A-CMOMMT without.
TEAMS = {
    "a-cmommt": (("a-cmommt", "pairwise"), ("a-cmommt", "none")),
    "evolved": (("evolved", "ring"), ("a-cmommt", "none")),
}

# By this share of the axis the points of a policy stand beside those of the one before, so that both are seen.
_BESIDE = 0.02
_PAGE = """
# Unreliable teams

{plan.runs} runs of {plan.steps} steps in each condition, {plan.about}, root seed {plan.seed}. Failures and repairs take
exponential times; the mean time to repair is {plan.repair:g} ticks. Robots that sense rarely have random phases. δ is
for a risk of {risk:g}, from the runs with awareness; its bounds have 95 % confidence each. Intervals are those of
Student's t, 95 %; all differences are paired. A gain is over {without}. Neighbours are means over active robots and
steps.

{sweeps}
"""

_Policy = Annotated[str, Allowed(choices=(*TEAMS, SKILLED))]
_Share = Annotated[float, Allowed(above=0, most=1)]


class Condition(NamedTuple):
    """One value of a sweep, and what it does to a team."""

    sweep: str
    value: float
    failures: Failures | None = None
    cycle: Cycle | None = None


@dataclass(frozen=True)
class UnreliableMeasure:
    """Lets a team fail or sense rarely, runs the world, and measures the task.

    Parameters
    ----------
    task : Task
        The task.
    failures : Failures or None
        Failures of its team.
    cycle : Cycle or None
        When its robots sense and decide.
    """

    task: Task
    failures: Failures | None
    cycle: Cycle | None

    def __call__(self, world: World, steps: int) -> dict[str, Any]:
        """Run the world and return the columns; see `TaskMeasure`."""
        from teamsight.agents.teammates import of_team
        from teamsight.analysis.runs.run import TaskMeasure

        for group in of_team(world.groups, self.task.team):
            if self.cycle is not None:
                world.adjust(group, cycle=self.cycle)
            if self.failures is not None:
                world.attach(self.failures, group)
        return TaskMeasure(self.task)(world, steps)


@dataclass(frozen=True)
class Unreliability(PaperPlan):
    """What to simulate.

    Parameters
    ----------
    runs : int
        Runs of each condition. Run r of every condition of a scenario has the same seed, so all differences are paired.
    steps : int, optional
        Steps of each run.
    seed : int
        Seed of all runs.
    repair : float
        Mean time to repair.
    policies : tuple of str
        Policies of cmommt, separated by commas.
    availabilities : tuple of float
        Shares of the time in which a robot works, MTTF / (MTTF + MTTR).
    periods : tuple of int
        Sensing periods.
    scenarios : collection of (int, float)
        Of CMOMMT, numbers of robots and radii.
    task : Task or str
        The task whose team is unreliable.
    set : mapping of str to object
        A value of the scenario of a task other than cmommt. May be given several times.

    Raises
    ------
    TypeError, ValueError
        If there is no such task, or a value has no meaning for it.
    """

    runs: limits.Runs = 60
    steps: Annotated[limits.Steps | None, Allowed(shown="that of the task")] = None
    seed: Seed = root("unreliable")
    repair: Annotated[Positive, Allowed(unit="ticks")] = 50.0
    policies: Annotated[tuple[_Policy, ...], Allowed(shown="a-cmommt,evolved")] = ()
    availabilities: Annotated[tuple[_Share, ...], Allowed()] = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5)
    periods: Annotated[tuple[Count, ...], Allowed(unit="ticks")] = (1, 2, 5, 10, 20, 50)
    scenarios: Collection[tuple[int, float]] = SCENARIOS
    task: Annotated[Task | str, Allowed(choices=TASKS)] = CMOMMT
    set: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        from teamsight.tasks.named import task_of

        task = task_of(self.task)
        usual = tuple(TEAMS) if task.name == CMOMMT else (SKILLED,)
        found: dict[str, Any] = {"task": task, "policies": self.policies or usual, "steps": self.steps or task.steps}
        for name, value in found.items():
            object.__setattr__(self, name, value)
        if wrong := [one for one in found["policies"] if one not in usual]:
            raise ValueError(f"policies={wrong[0]}: the task {task.name} has {', '.join(usual)}; give these")
        if task.name == CMOMMT and self.set:
            raise ValueError(f"set={dict(self.set)}: the scenarios of {CMOMMT} are fixed; leave it out")
        task.full_scenario(self.set)
        if self.number < max(self.periods):
            least = f"at least {max(self.periods)}, the longest sensing period"
            raise ValueError(f"steps={self.number}: must be {least}; give more steps")

    @cached_property
    def is_cmommt(self) -> bool:
        """Whether policies and scenarios are those that were chosen by hand."""
        return self.work.name == CMOMMT

    @property
    def work(self) -> Task:
        """The task."""
        task: Any = self.task
        return task  # type: ignore[no-any-return]

    @property
    def number(self) -> int:
        """The steps of a run."""
        return self.steps or self.work.steps

    @property
    def columns(self) -> tuple[str, ...]:
        """The values that tell scenarios apart: N, and those that were given."""
        return ("robots", "radius") if self.is_cmommt else tuple(dict.fromkeys((self.work.size, *self.set)))

    @property
    def cells(self) -> list[dict[str, Any]]:
        """The scenarios."""
        if self.is_cmommt:
            return [{"robots": robots, "targets": TARGETS, "radius": radius} for robots, radius in self.scenarios]
        full = self.work.full_scenario(self.set)
        return [{name: full[name] for name in self.columns}]

    @property
    def about(self) -> str:
        """What all scenarios have in common."""
        return f"{TARGETS} targets, ranges 1, default speeds" if self.is_cmommt else f"task {self.work.name}"

    @property
    def observed(self) -> str:
        """The objective, with its unit."""
        return "observed [%]" if self.is_cmommt else self.work.objective.metric

    def team(self, policy: str, aware: bool) -> tuple[str, str]:
        """Return the policy and the degree of awareness of a team; another task's has a degree of its own."""
        if self.is_cmommt:
            return TEAMS[policy][not aware]
        return SKILLED, "pairwise" if aware else "none"

    def name(self, policy: str, aware: bool) -> str:
        """Return the name of a team."""
        return SKILLED if aware and not self.is_cmommt else "{} ({})".format(*self.team(policy, aware))

    def colour(self, policy: str, aware: bool) -> str:
        """Return the colour of the degree of a team."""
        return DEGREE[self.team(policy, aware)[1]]

    def title(self, scenario: Mapping[Any, Any]) -> str:
        """Return the names and values of a scenario."""
        if self.is_cmommt:
            return f"N = {scenario['robots']}, R = {scenario['radius']:g}"
        return ", ".join(f"{name} = {scenario[name]}" for name in self.columns)

    @cached_property
    def _skilled(self) -> dict[bool, dict[str, Any]]:
        # A team that has to learn does so once under each degree.
        return {
            aware: self.work.parameters("skilled", self.set, awareness=None if aware else "none", rng=self.seed)
            for aware in (True, False)
        }

    def parameters(self, policy: str, aware: bool, scenario: Mapping[str, Any]) -> dict[str, Any]:
        """Return the parameters of a world."""
        if not self.is_cmommt:
            return self._skilled[aware]
        named = dict(zip(("policy", "awareness"), self.team(policy, aware), strict=True))
        return self.work.parameters(named, scenario)

    def conditions(self) -> dict[str, Any]:
        """Return the settings, fit for JSON."""
        names = ("runs", "steps", "seed", "repair", "policies", "availabilities", "periods")
        named = {name: getattr(self, name) for name in names}
        own = {"task": self.work.name, "scenario": self.work.full_scenario(self.set)}
        return json.loads(json.dumps(named | ({"scenarios": self.scenarios} if self.is_cmommt else own)))  # type: ignore[no-any-return]

    def planned(self) -> Iterator[Planned]:
        """Yield each run with the columns that identify it.

        These are sweep, value (the availability, or the period [ticks]), policy, aware (whether it has information
        about teammates), the scenario, replicate and seed. The conditions without failures and with period 1 are the
        same runs, which are made once; so are those of one team that several are compared with.
        """
        from teamsight.analysis.runs.run import LabelledRun, task_run, task_seed

        for sweep, value, failures, cycle in self.treatments():
            # As parameters, with which runs of CMOMMT share a world.
            changed = {name: one for name, one in (("events", failures), ("cycle", cycle)) if one is not None}
            measure = UnreliableMeasure(self.work, failures, cycle)
            for policy in self.policies:
                for aware in (True, False):
                    for scenario in self.cells:
                        given = self.parameters(policy, aware, scenario)
                        label = (
                            self.work.name, canonical(self.work.full_scenario(self.set)), self.name(policy, aware),
                            repr(failures), repr(cycle), f"learned {self.seed}",
                        )  # fmt: skip
                        for replicate in range(self.runs):
                            seed = task_seed(self.work, self.seed, replicate, scenario)
                            named = {"sweep": sweep, "value": value, "policy": policy, "aware": aware, **scenario}
                            if self.is_cmommt:
                                run = task_run(self.work, given | changed, seed, self.number)
                            else:
                                run = LabelledRun(given, seed, self.number, measure, self.work.world, label)
                            yield named | {"replicate": replicate, "seed": seed}, run

    def treatments(self) -> Iterator[Condition]:
        """Yield the conditions of both sweeps."""
        from teamsight import Cycle
        from teamsight.agents.components import Failures

        for value in self.availabilities:
            # One object for all runs, by which they recognise that they can share a world.
            failures = Failures(time_to_failure(value, self.repair), self.repair) if value < 1.0 else None
            yield Condition("failures", value, failures)
        for period in self.periods:
            # Robots are not in step, as in a team without a common clock.
            yield Condition("periods", float(period), None, None if period == 1 else Cycle(period, phase="random"))


def time_to_failure(availability: float, repair: float) -> float:
    """Return the mean time to failure [ticks] that gives an availability below 1 with a mean time to repair."""
    return repair * availability / (1.0 - availability)


class Unreliable(NamedTuple):
    """What was found: a row for each run (see `Unreliability.planned`), and one for each condition (see `points`)."""

    runs: pd.DataFrame
    points: pd.DataFrame


def find(plan: Unreliability, *how: Any) -> Unreliable:
    """Make the runs of a plan, and return what was found."""
    runs = runs_of(plan, *how)
    return Unreliable(runs, points(runs, plan))


def points(table: pd.DataFrame, plan: Unreliability) -> pd.DataFrame:
    """Return one row for each condition.

    Parameters
    ----------
    table : DataFrame
        The runs of the plan.
    plan : Unreliability
        What was simulated.

    Returns
    -------
    DataFrame
        sweep, value, policy and the scenario (of CMOMMT, robots and radius); count (runs); the objective with awareness
        and without (of CMOMMT, the observed fraction in percent), and gain, their paired difference, positive where
        awareness is better, all with the ends of their 95 % intervals; delta, the point estimate for the risk `RISK` in
        the runs with awareness, delta_low and delta_safe, between which it lies (each with `CONFIDENCE`), supported
        (whether there are enough runs for delta_safe); neighbours and unaware_neighbours, the mean numbers over the
        active robots and the steps, with the ends of their intervals.
    """
    import pandas as pd

    from teamsight.analysis.stats import exceedance

    condition, found = ["sweep", "value", "policy", *plan.columns], []
    for key, rows in table.groupby(condition, sort=False):
        aware, unaware = (rows_of(rows, aware=which).set_index("replicate").sort_index() for which in (True, False))
        with_, without = (np.asarray(_objective(part, plan), np.float64) for part in (aware, unaware))
        point = dict(zip(condition, key, strict=True)) | {"count": len(aware)}
        for name, values in (
            ("aware", with_),
            ("unaware", without),
            ("gain", plan.work.objective.sign * (with_ - without)),
            ("neighbours", aware["mean_neighbours"].to_numpy()),
            ("unaware_neighbours", unaware["mean_neighbours"].to_numpy()),
        ):
            point |= dict(zip((name, f"{name}_low", f"{name}_high"), interval_of(values), strict=True))
        size = int(rows[plan.work.size].iloc[0])
        curve = exceedance.curve(aware["max_neighbours"], size, confidence=CONFIDENCE)
        for name, of in (("delta", "probability"), ("delta_low", "low"), ("delta_safe", "high")):
            point[name] = exceedance.smallest_delta(curve, of, RISK)
        found.append(point | {"supported": exceedance.supports(len(aware), RISK, CONFIDENCE)})
    return pd.DataFrame(found)


def _objective(rows: pd.DataFrame, plan: Unreliability) -> pd.Series[float]:
    """Return the objective of runs; a censored run counts as its length."""
    objective = plan.work.objective
    counted = rows[objective.metric].map(lambda value: objective.counted(value, plan.number))
    return (100.0 if plan.is_cmommt else 1.0) * counted


def changes(table: pd.DataFrame, sweep: str, plan: Unreliability) -> pd.DataFrame:
    """Return how the gain changes along a sweep: in each condition minus the first one, paired by seed.

    Parameters
    ----------
    table : DataFrame
        The runs of the plan.
    sweep : str
        A name in `SWEEPS`.
    plan : Unreliability
        What was simulated.

    Returns
    -------
    DataFrame
        policy, the scenario, value, change (of CMOMMT in percentage points), low, high (95 % interval).
    """
    import pandas as pd

    of = rows_of(table, sweep=sweep)
    first, found = of["value"].iloc[0], []
    by, sign = ["policy", *plan.columns], plan.work.objective.sign
    for key, rows in of.assign(counted=_objective(of, plan)).groupby(by, sort=False):
        wide = rows.pivot(index="replicate", columns=["value", "aware"], values="counted")
        gains = {value: sign * (wide[value][True] - wide[value][False]) for value in rows["value"].unique()}
        for value, gain in gains.items():
            if value != first:
                found.append((*key, value, *interval_of(np.asarray(gain - gains[first], np.float64))))
    return pd.DataFrame(found, columns=[*by, "value", "change", "low", "high"])


def draw(found: Unreliable, plan: Unreliability, sweep: str) -> Canvas:
    """Return the figure of a sweep: what is observed, the gain from awareness, and δ."""
    _, named, title, label, fixed = SWEEPS[sweep]
    of = rows_of(found.points, sweep=sweep)
    of = of.assign(x=of["value"] if sweep == "periods" else of["value"].map(partial(_failures, plan=plan)))
    unit, kinds = " points" * plan.is_cmommt, len(plan.cells)
    ends = of.groupby("policy", sort=False)["gain"].agg(["idxmin", "idxmax"])
    least, most = of.loc[ends["idxmin"]], of.loc[ends["idxmax"]]
    adds = (
        f"{signed_text(low)} to {signed_text(high)}{unit} ({policy}; least at {named} {value:g})"
        for policy, value, low, high in zip(least["policy"], least["value"], least["gain"], most["gain"], strict=True)
    )
    gained = "gain from awareness  [points]" if plan.is_cmommt else "gain from awareness"
    rows: dict[str, Callable[..., None]] = {
        "observed targets  [%]" if plan.is_cmommt else plan.observed: _draw_observed,
        gained: _draw_gain, "δ": _draw_delta,
    }  # fmt: skip
    figure, shown = panels(
        f"{title}: awareness adds {', '.join(adds)}",
        f"{plan.runs} runs of {plan.steps} steps, {f'{TARGETS} targets' if plan.is_cmommt else plan.about}; "
        f"{fixed.format(plan)}; 95 % confidence bands; gain over {plan.name(of['policy'].iloc[0], False)}; δ for a "
        f"risk of {RISK:g} with its bounds, {CONFIDENCE:.0%} each; seed {plan.seed}",
        [*map(plan.title, plan.cells), *("" for _ in range(2 * kinds))], x=label,
        y=[name * (at == 0) for name in rows for at in range(kinds)], columns=kinds, size=(3.6, 2.3),
        sharex="col", sharey="row",
    )  # fmt: skip
    for number, axes in enumerate(shown):
        draw_row, scenario = [*rows.values()][number // kinds], plan.cells[number % kinds]
        draw_row(axes, rows_of(of, **{name: scenario[name] for name in plan.columns}), plan)
        _scale(axes, of, sweep)
    # One axis for all panels of a row: teams are compared across them.
    shown[-1].set_ylim(0.0, max(1, of["delta_safe"].where(of["supported"], of["delta"]).max()) + 0.6)
    handles, labels = shown[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    return figure


def _failures(availability: float, plan: Unreliability) -> float:
    return 0.0 if availability == 1.0 else 1000.0 / time_to_failure(availability, plan.repair)


def _scale(axes: Axes, of: pd.DataFrame, sweep: str) -> None:
    ticks = of.drop_duplicates("x").sort_values("x")
    names = [f"{x:.2g}\n({value:g})" for x, value in zip(ticks["x"], ticks["value"], strict=True)]
    is_log = sweep == "periods"
    mark_values(axes, ticks["x"].tolist(), None if is_log else names, is_log=is_log)


def _draw_observed(axes: Axes, of: pd.DataFrame, plan: Unreliability) -> None:
    for policy, rows in of.groupby("policy", sort=False):
        _draw_band(axes, rows, "aware", plan.colour(str(policy), True), plan.name(str(policy), True))
        missing = plan.name(str(policy), False)
        if missing not in axes.get_legend_handles_labels()[1]:
            _draw_band(axes, rows, "unaware", plan.colour(str(policy), False), missing, "--")


def _draw_gain(axes: Axes, of: pd.DataFrame, plan: Unreliability) -> None:
    axes.axhline(0.0, color=FAINT, linewidth=1.0)
    for policy, rows in of.groupby("policy", sort=False):
        _draw_band(axes, rows, "gain", plan.colour(str(policy), True))


def _draw_band(axes: Axes, rows: pd.DataFrame, name: str, colour: str, label: str = "", dashes: str = "-") -> None:
    rows = rows.sort_values("x")
    found = rows[[name, f"{name}_low", f"{name}_high"]].to_numpy(float)
    draw_means(axes, rows["x"], found, colour, label, marker="o", markersize=4, linestyle=dashes)


def _draw_delta(axes: Axes, of: pd.DataFrame, plan: Unreliability) -> None:
    from matplotlib.ticker import MaxNLocator

    logarithmic = bool(of["x"].min() > 0)
    for number, (policy, rows) in enumerate(of.groupby("policy", sort=False)):
        rows = rows.sort_values("x")
        aside = number * _BESIDE * float(np.ptp(np.log(rows["x"]) if logarithmic else rows["x"]))
        place = rows["x"] * np.exp(aside) if logarithmic else rows["x"] + aside
        high = rows["delta_safe"].where(rows["supported"], rows["delta"])
        found = np.column_stack([rows["delta"], rows["delta_low"], high])
        draw_means(axes, place, found, plan.colour(str(policy), True), as_bars=True)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))


def page_values(found: Unreliable, plan: Unreliability) -> Mapping[str, Any]:
    """Return the values of the page."""
    parts = []
    for sweep, (title, *_) in SWEEPS.items():
        said = "\n".join(f"- {line}" for line in sentences(found, sweep, plan))
        parts += [f"## {title}", markdown.wrapped(said), sweep_table(found.points, sweep, plan)]
    without = "the same team without awareness, positive where awareness is better"
    without = "A-CMOMMT without awareness" if plan.is_cmommt else without
    return {"risk": RISK, "without": without, "sweeps": "\n\n".join(parts)}


def sweep_table(found: pd.DataFrame, sweep: str, plan: Unreliability) -> str:
    """Return a table with a row for each quantity and scenario, and a column for each value of the sweep.

    Parameters
    ----------
    found : DataFrame
        From `points`.
    sweep : str
        A name in `SWEEPS`.
    plan : Unreliability
        What was simulated.
    """
    of, rows = rows_of(found, sweep=sweep), []
    values = of["value"].unique().tolist()
    quantities: tuple[tuple[str, bool, Callable[[Any], str]], ...] = (
        (
            "gain [points]" if plan.is_cmommt else "gain", True,
            lambda point: minus(plus_minus(point["gain"], point["gain_high"], "+.1f", ".1f")),
        ),
        (plan.observed, True, lambda point: plus_minus(point["aware"], point["aware_high"])),
        (plan.observed, False, lambda point: plus_minus(point["unaware"], point["unaware_high"])),
        ("δ (its bounds)", True, _range),
        ("neighbours", True, lambda point: f"{point['neighbours']:.2f}"),
        ("neighbours", False, lambda point: f"{point['unaware_neighbours']:.2f}"),
    )  # fmt: skip
    for quantity, aware, write in quantities:
        teams: dict[str, str] = {}
        for policy in of["policy"].unique():
            teams.setdefault(plan.name(policy, aware), policy)
        for team, policy in teams.items():
            for scenario, part in rows_of(of, policy=policy).groupby([*plan.columns], sort=False):
                cells = {point["value"]: write(point) for point in part.to_dict("records")}
                shown = [f"{one:g}" if isinstance(one, float) else f"{one}" for one in scenario]
                rows.append([f"{quantity}, {team}", *shown, *(cells[value] for value in values)])
    names = [{"robots": "N", "radius": "R"}.get(name, name) for name in plan.columns]
    titles = [f"quantity, against the {SWEEPS[sweep][1]}", *names, *(f"{value:g}" for value in values)]
    return markdown.table(titles, rows, align="l" + "r" * (len(titles) - 1))


def sentences(found: Unreliable, sweep: str, plan: Unreliability) -> list[str]:
    """Return what the sweep shows, a sentence for each policy and scenario."""
    by = ["policy", *plan.columns]
    change, said = dict(list(changes(found.runs, sweep, plan).groupby(by, sort=False))), []
    for key, rows in rows_of(found.points, sweep=sweep).groupby(by, sort=False):
        first, last = rows.iloc[0], rows.iloc[-1]
        who = f"{first['policy']}, {plan.title(first.to_dict())}"
        gain = "gain", "gain_low", "gain_high"
        text = f"{who}: gain {_interval(first, *gain)} at {first['value']:g}"
        if len(rows) > 1:
            changed = _interval(change[key].iloc[-1], "change", "low", "high")
            text += f", {_interval(last, *gain)} at {last['value']:g}; change {changed}. "
            text += f"δ {_range(first)} and {_range(last)}"
        said.append(f"{text}.")
    return said


def summary(found: Unreliable, plan: Unreliability) -> Sequence[str]:
    """Return the sentences of both sweeps, each with the name of its sweep."""
    return [f"{sweep}: {line}" for sweep in SWEEPS for line in sentences(found, sweep, plan)]


def _range(point: Any) -> str:
    high = f" to {point['delta_safe']}" if point["supported"] else ""
    return f"{point['delta']} ({point['delta_low']}{high})"


def _interval(point: Any, *names: str) -> str:
    return interval_text(Interval(*(float(point[name]) for name in names)))


PAPER = Paper(
    plan=Unreliability, name="unreliable", page="unreliable", template=_PAGE, values=page_values,
    figures={f"unreliable-{sweep}": partial(draw, sweep=sweep) for sweep in SWEEPS}, sentences=summary,
    tables={"unreliable-points.parquet": lambda found, plan: found.points}, make=find, runs=lambda found: found.runs,
    # The documentation has the points alone, of which figures and tables are made.
    restore=lambda table: Unreliable(table, table),
    small={
        "runs": 2, "steps": 12, "repair": 5.0, "availabilities": (1.0, 0.5), "periods": (1, 4),
        "scenarios": ((4, 1.5),),
    },
)  # fmt: skip
