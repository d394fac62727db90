"""Mataric: teams that learn to collect pucks by delayed reward, by events, or by progress estimators.

Each run learns anew; its tables are scored, and its team is tested in worlds in which it learns no more. The page also
says what a count or a ring of intruders adds to one bit. About the result: docs/tasks/collecting.md.

\b
Examples:
  teamsight reproduce mataric --out collecting
  teamsight reproduce mataric --quick --workers 1
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from teamsight.analysis.papers.reproduction import (
    RECALLED,
    Floats,
    Paper,
    PaperPlan,
    column,
    intervals,
    rows_of,
    verdict_of,
)
from teamsight.analysis.plot.kinds import draw_means, mark_values, panels
from teamsight.analysis.plot.style import COLOURS, FAINT, colours_of
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.seeds import root
from teamsight.analysis.stats.paired import Interval, interval_of
from teamsight.analysis.stats.verdicts import FAILS, HOLDS, UNDECIDED, Verdict, above, plus_minus
from teamsight.core.component import Allowed, Count, Seed

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure as Canvas

    from teamsight.agents.world import World
    from teamsight.analysis.runs.simulate import Planned
    from teamsight.policies.basis import BasisBehaviours

#: How sure the source of a claim is; else `RECALLED`.
TOUZET, OURS = "Touzet (2000), §2.3", "ours"
#: δ of counts and sectors, and the share of rows that a table of random values has right.
DELTA, CHANCE = 3, 0.25
#: The schemes of reinforcement by name; "events + H" and "events + I" leave one estimator out, with the weights of the
#: others in their ratio.
SCHEMES: dict[str, dict[str, Any]] = {
    "delayed": {"scheme": "delayed"},
    "events": {"scheme": "events"},
    "events + H": {"weights": (2 / 3, 0.0, 1 / 3)},
    "events + I": {"weights": (2 / 3, 1 / 3, 0.0)},
    "progress": {},
}
#: What the table knows of intruders, with all estimators, other than one bit, which is "progress".
CODINGS: dict[str, dict[str, Any]] = {kind: {"intruders": kind, "delta": DELTA} for kind in ("count", "ring")}
#: The claims on rows that are recalled: text, and the condition, the other and the column that are compared.
ORDERS = (
    ("M1 Events teach more rows than the delivered puck alone", "events", "delayed", "correct"),
    ("M1 Progress estimators teach more than events alone", "progress", "events", "correct"),
    ("M2 With the estimator I more rows with an intruder are learned", "progress", "events + H", "correct_intruder"),
)

_CONDITIONS = {8: "puck", 4: "at home", 2: "night", 1: "intruder"}
_PAYS = {"count": "The number of intruders", "ring": "In which sectors intruders are"}
_PAGE = """
# Learning to collect pucks

{plan.runs} learning runs of each condition, paired by their seed; root seed {plan.seed}. Rows are scored for each robot
after {plan.judged:,} steps, the same for all schemes. Pucks are those that a team delivers in {plan.steps} steps when
it learns no more, mean of {plan.tests} worlds for each run. Intervals are Student's, 95 %, over the runs, each by
itself.

This is no reproduction of numbers: Mataric's arena, ranges, night, weights and the sizes of her reinforcement are not
known to us, and ours were not fitted to her results. Claims that are recalled and not verified agree or differ.

## Rows and pucks

| N | condition | clear rows right after {plan.judged:,} steps [%] | of those with an intruder [%] | pucks delivered then | after {last:,} steps | woken at home |
| ---: | :--- | ---: | ---: | ---: | ---: | ---: |
{conditions}

## Each row

| conditions | behaviour | clear | delayed | events | events + H | events + I | progress |
| :--- | :--- | :--- | ---: | ---: | ---: | ---: | ---: |
{rows}

## Claims

{claims}
"""  # noqa: E501


@dataclass(frozen=True)
class Collecting(PaperPlan):
    """What to simulate.

    Parameters
    ----------
    runs : int
        Learning runs of each condition. Run r of all conditions has the same seed.
    times : tuple of int
        Steps after which tables are scored.
    judged : int
        That of them after which the schemes are compared.
    tests : int
        Test worlds of each run, in which the team does not learn.
    steps : int
        Steps of each test world.
    sizes : tuple of int
        N; the schemes are compared with the first.
    seed : int
        Seed of all runs.
    """

    runs: limits.Runs = 40
    times: Annotated[tuple[Count, ...], Allowed(is_sorted=True)] = (1250, 2500, 5000, 10_000, 20_000, 40_000, 80_000)
    judged: Annotated[Count, Allowed(unit="ticks")] = 20_000
    tests: Count = 10
    steps: limits.Steps = 1200
    sizes: Annotated[tuple[Count, ...], Allowed()] = (4, 12)
    seed: Seed = root("collecting")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.judged not in self.times:
            raise ValueError(f"judged={self.judged}: is none of the times {', '.join(map(str, self.times))}; give one")

    def policies(self, size: int) -> dict[str, BasisBehaviours]:
        """Return the policies that are run with a team of this size, by name."""
        from teamsight.policies.basis import BasisBehaviours

        schemes = SCHEMES if size == self.sizes[0] else {"progress": SCHEMES["progress"]}
        learners = {name: BasisBehaviours(**how) for name, how in {**schemes, **CODINGS}.items()}
        return {**learners, "random": BasisBehaviours(scheme="none"), "by hand": BasisBehaviours.correct()}

    def planned(self) -> Iterator[Planned]:
        """Yield each run with the columns of the table that identify it."""
        from teamsight.analysis.runs.run import task_run, task_seed
        from teamsight.tasks.registry import TASKS

        task = TASKS["collect"]
        # The work of a run is that of all its worlds.
        steps = self.times[-1] + 2 * self.tests * self.steps
        for size in self.sizes:
            cell = {"robots": size}
            for replicate in range(self.runs):
                seed = task_seed(task, self.seed, -1 - replicate, cell)
                tests = range(self.tests * replicate, self.tests * (replicate + 1))
                seeds = tuple(task_seed(task, self.seed, number, cell) for number in tests)
                measure = Learning(self.times, self.judged, seeds, self.steps)
                for name, policy in self.policies(size).items():
                    world = task.parameters({"policy": policy, "awareness": "pairwise"}, cell)
                    named = {"condition": name, "robots": size, "replicate": replicate, "seed": seed}
                    yield named, task_run(task, world, seed, steps, measure)


@dataclass(frozen=True)
class Learning:
    """Lets a team learn, scores its tables after some times, and tests it in worlds in which it learns no more.

    Parameters
    ----------
    times : tuple of int
        Steps after which tables are scored, in ascending order.
    judged : int
        That of them after which each row is scored, and the team tested; it is tested after the last, too.
    tests : tuple of int
        The seeds of the test worlds.
    steps : int
        Their steps.
    """

    times: tuple[int, ...]
    judged: int
    tests: tuple[int, ...]
    steps: int

    def __call__(self, world: World, steps: int) -> dict[str, Any]:
        """Run the world up to the last of the times; `steps` only says how much work that is."""
        from teamsight.policies.basis import CLEAR_ROWS, CORRECT, share_correct

        robots: Any = world.robots  # type: ignore[attr-defined]
        policy: BasisBehaviours = robots.policy
        curve, found = [], {}
        for time in self.times:
            world.run(time - world.tick)
            tables = policy.values(robots.policy_state)
            curve.append(share_correct(tables))
            if time == self.judged:
                found = {
                    "rows": [share_correct(tables, (row,)) for row in range(len(CORRECT))],
                    "correct": curve[-1],
                    "correct_intruder": share_correct(tables, tuple(row for row in CLEAR_ROWS if row & 1)),
                    "delivered_early": self._test(policy, tables, len(robots))[0],
                }
        delivered, slept = self._test(policy, tables, len(robots))
        return {"curve": curve, **found, "delivered": delivered, "slept_at_home": slept}

    def _test(self, policy: BasisBehaviours, tables: Floats, robots: int) -> list[float]:
        """Return the mean number of delivered pucks, and of nights at home, in the test worlds."""
        from teamsight.tasks.collecting import PuckCollecting, delivered, slept_at_home

        found = []
        for seed in self.tests:
            with contextlib.closing(PuckCollecting(robots, policy=policy.frozen(tables), rng=seed)) as world:
                world.run(self.steps)
                found.append((delivered(world), slept_at_home(world)))
        return [float(one) for one in np.mean(found, axis=0)]


def differences(table: pd.DataFrame, one: str, other: str, name: str, size: int) -> Floats:
    """Return by how much a column of one condition exceeds that of another, run by run."""
    first, second = (column(table, name, condition=condition, robots=size) for condition in (one, other))
    return first - second


def verdicts(table: pd.DataFrame, plan: Collecting) -> list[Verdict]:
    """Return the verdicts on all claims; `table` has a row for each run.

    Each names the steps after which it is judged: the sign can change later.
    """
    size = plan.sizes[0]
    early, late = f", after {plan.judged:,} steps", f", after {plan.times[-1]:,} steps"
    found = [
        verdict_of(
            claim + early, RECALLED, interval_of(differences(table, one, other, name, size)), "points",
            said=f"{one} − {other}: {{}}",
        )
        for claim, one, other, name in ORDERS
    ]  # fmt: skip
    for condition in ("delayed", "events", "events + H"):
        interval = interval_of(column(table, "correct_intruder", condition=condition, robots=size) - CHANCE)
        claim = f"M2 Without it ({condition}) they are right no more often than by chance"
        said = f"{condition} − 25 %: {{}}"
        found.append(verdict_of(claim + early, RECALLED, interval, "points", not_above, said=said))
    interval = interval_of(differences(table, "progress", "delayed", "delivered_early", size))
    claim = "Teams that learn more rows right deliver more"
    found.append(verdict_of(claim + early, OURS, interval, "pucks", said="progress − delayed: {}"))
    for size in plan.sizes:
        for coding, what in _PAYS.items():
            interval = interval_of(differences(table, coding, "progress", "delivered", size))
            claim = f"{what} pays more than one bit, N = {size}{late}"
            found.append(verdict_of(claim, TOUZET, interval, "pucks", said=f"{coding} − bit: {{}}"))
    return found


def not_above(interval: Interval) -> str:
    """Return whether a quantity is not above 0, by its interval."""
    return {HOLDS: FAILS, FAILS: HOLDS}.get(above(interval), UNDECIDED)


def draw(table: pd.DataFrame, plan: Collecting) -> Canvas:
    """Return rows learned right against time for each scheme, and what more than one bit adds to the pucks."""
    size = plan.sizes[0]
    right = (
        f"{100 * column(table, 'correct', condition=name, robots=size).mean():.0f} % ({name})"
        for name in ("progress", "events", "delayed")
    )
    figure, (left, axes) = panels(
        f"Rows learned right in {plan.judged:,} steps: {', '.join(right)}",
        f"{plan.runs} learning runs of each condition; 95 % confidence intervals; seed {plan.seed}",
        (f"clear rows learned right, N = {size}", "pucks beyond those with one bit"),
        x=("steps of learning", ""), y=("share of rows [%]", "pucks delivered"), size=(5.4, 3.6),
    )  # fmt: skip
    for name, colour in zip(SCHEMES, colours_of(list(SCHEMES)), strict=True):
        curves = 100.0 * np.array(rows_of(table, robots=size, condition=name)["curve"].tolist())
        dashes = "--" if "+" in name else "-"
        draw_means(left, plan.times, intervals(curves.T), colour, name, as_bars=True, linestyle=dashes)
    left.set_ylim(0, 100)
    mark_values(left, plan.times)
    axes.axhline(0.0, color=FAINT, linewidth=0.8)
    places = [(size, coding) for size in plan.sizes for coding in CODINGS]
    for aside, name, time in ((-0.16, "delivered_early", plan.judged), (0.16, "delivered", plan.times[-1])):
        found = intervals(differences(table, coding, "progress", name, size) for size, coding in places)
        x, colour = np.arange(len(places)) + aside, COLOURS[1 + (aside > 0)]
        draw_means(axes, x, found, colour, f"after {time:,} steps", as_bars=True, linestyle="")
    mark_values(axes, range(len(places)), [f"{coding}\nN = {size}" for size, coding in places], is_log=False)
    for one, columns in ((left, 2), (axes, 1)):
        one.legend(frameon=False, fontsize=8, ncol=columns)
    return figure


def page_values(table: pd.DataFrame, plan: Collecting) -> dict[str, Any]:
    """Return the rows of the tables of the page: of conditions, and of the rows that robots have learned."""
    from teamsight.policies.basis import BEHAVIOURS, CLEAR_ROWS, CORRECT

    conditions, rows = [], []
    for size in plan.sizes:
        for name in plan.policies(size):
            of = partial(column, table, condition=name, robots=size)
            found = [interval_of(100.0 * of(one)) for one in ("correct", "correct_intruder")]
            found += [interval_of(of(one)) for one in ("delivered_early", "delivered")]
            means = " | ".join(plus_minus(one.mean, one.high) for one in found)
            conditions.append(f"| {size} | {name} | {means} | {100.0 * of('slept_at_home').mean():.0f} % |")
    part = rows_of(table, robots=plan.sizes[0])
    shares = [np.mean(rows_of(part, condition=name)["rows"].tolist(), axis=0) for name in SCHEMES]
    for row, answer in enumerate(CORRECT):
        if row & 12 != 12:  # the puck is dropped at home
            named = ", ".join(name for bit, name in _CONDITIONS.items() if row & bit) or "none"
            learned = " | ".join(f"{100.0 * share[row]:.0f} %" for share in shares)
            rows.append(f"| {named} | {BEHAVIOURS[answer]} | {'yes' if row in CLEAR_ROWS else 'no'} | {learned} |")
    return {"conditions": "\n".join(conditions), "rows": "\n".join(rows), "last": plan.times[-1]}


PAPER = Paper(
    plan=Collecting, name="collecting", page="tasks/collecting", template=_PAGE, figures={"collecting": draw},
    values=page_values,
    verdicts=verdicts, measured="measured (95 %)",
    quick={"runs": 6, "times": (1250, 5000, 20_000), "tests": 4},
    small={"runs": 2, "times": (300, 600), "judged": 300, "tests": 1, "steps": 60, "sizes": (3,)},
)  # fmt: skip
