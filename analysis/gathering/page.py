"""The gathering index as a page: the table, the claims with their verdicts, and the conditions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from teamsight.analysis.gathering.cells import CONFIDENCE, Cell
from teamsight.analysis.gathering.claims import CLAIMS, UNRELIABLE, UNRELIABLE_STATEMENT, Verdict, shown
from teamsight.analysis.gathering.iterate import Iteration
from teamsight.analysis.gathering.plan import Plan
from teamsight.analysis.plot import markdown
from teamsight.analysis.plot.style import minus
from teamsight.analysis.stats.paired import Interval

_GATHERS = {True: "yes", False: "no", None: "unknown"}
_ANSWERS = {"yes": "yes", "no": "**no**", "undecided": "?"}
_SIGNS = {"holds": "holds", "does not hold": "**fails**", "undecided": "?"}


def page(
    cells: Sequence[Cell],
    verdicts: Sequence[Verdict],
    iterations: Mapping[tuple[str, int], Iteration],
    plan: Plan,
) -> str:
    """Return the page.

    Parameters
    ----------
    cells : sequence of Cell
        One for each task and team size.
    verdicts : sequence of Verdict
        From `claims.judge`.
    iterations : mapping
        The rounds for each task and team size.
    plan : Plan
        What was simulated.
    """
    return markdown.page(
        "# The gathering index",
        "δ by random exploration, δ of the team with skill, and their ratio: above 1, exploration shows too few "
        f"neighbours, if the team with skill is the better one (by 95 %; ? is undecided). Intervals in brackets hold "
        f"together, for each task and N, with {CONFIDENCE:.0%}.",
        index_table(cells),
        "## Where the objective saturates",
        "δ from which on the objective falls short of that with N − 1 teammates by at most the tolerance, whether it "
        "is shown to be enough with the two δ above, and what all N − 1 teammates are worth.",
        saturation_table(cells),
        "## Claims",
        claims_table(),
        "## Verdicts",
        "For N from small to large; ? is undecided.",
        summary_table(verdicts),
        "## All verdicts",
        verdicts_table(verdicts),
        "## Explore, act, measure again",
        "The team with skill gets the δ of the exploration, then the one that it needed with that, until it holds. "
        "At last it is compared with a team with N − 1.",
        rounds_table(iterations),
        "## Conditions",
        _conditions(plan),
    )


def index_table(cells: Sequence[Cell]) -> str:
    """Return a row for each task and team size: δ of both teams, and their ratio."""
    columns = [
        "task", "gathers", "N", "skilled is better", "δ(explore)", "δ(skilled)", "gathering index",
        "an exploration shows fewer", "shows more", "robot-steps with more than δ(explore)", "saturates at δ",
    ]  # fmt: skip
    rows = (
        [
            cell.task, _GATHERS[cell.gathers], f"{cell.size}", _ANSWERS[cell.has_skill], shown(cell.explore),
            shown(cell.skilled), interval_text(cell.ratio), f"{cell.too_few:.0%}", f"{cell.too_many:.0%}",
            f"{cell.crowded:.2%}", shown(cell.saturation),
        ]
        for cell in cells
    )  # fmt: skip
    return markdown.table(columns, rows, align="llrlrrrrrrr")


def saturation_table(cells: Sequence[Cell]) -> str:
    """Return a row for each task and team size: the objective against δ."""
    columns = [
        "task", "N", "objective with N − 1", "gain of awareness", "saturates at δ", "enough at δ(explore)",
        "enough at δ(skilled)", "censored",
    ]  # fmt: skip
    rows = (
        [
            cell.task, f"{cell.size}", f"{cell.objective:.3g}", interval_text(cell.gain), shown(cell.saturation),
            cell.is_enough(cell.explore.delta), cell.is_enough(cell.skilled.delta), f"{cell.censored:.0%}",
        ]
        for cell in cells
    )  # fmt: skip
    return markdown.table(columns, rows, align="lrrrrllr")


def rounds_table(iterations: Mapping[tuple[str, int], Iteration]) -> str:
    """Return a row for each task and team size: the δ of the rounds, and their cost."""
    columns = ["task", "N", "δ of the rounds", "more runs", "more trainings", "enough", "falls short by"]
    rows = (
        [
            task, f"{size}", " → ".join(map(str, one.used)), f"{one.runs}", f"{one.trainings}", one.enough,
            interval_text(one.shortfall),
        ]
        for (task, size), one in iterations.items()
    )  # fmt: skip
    return markdown.table(columns, rows, align="lrlrrlr")


def claims_table() -> str:
    """Return the claims and their rules."""
    rows = [[claim.name, claim.statement, claim.rule] for claim in CLAIMS.values()]
    rule = (
        "holds if one cell is shown to be outside at δ(explore), by bounds that hold together for all cells; does not "
        "hold if all are shown to be within"
    )
    return markdown.table(["claim", "statement", "rule"], [*rows, [UNRELIABLE, UNRELIABLE_STATEMENT, rule]])


def summary_table(verdicts: Sequence[Verdict]) -> str:
    """Return a row for each claim and a column for each task, with a verdict for each N."""
    tasks = list(dict.fromkeys(one.task for one in verdicts if one.task))
    rows = []
    for name in dict.fromkeys(one.claim for one in verdicts):
        own = [one for one in verdicts if one.claim == name]
        by_task = (", ".join(_SIGNS[one.outcome] for one in own if one.task == task) or "–" for task in tasks)
        rows.append([name, *by_task, _bold(own[-1].outcome)])
    return markdown.table(["claim", *tasks, "all"], rows)


def verdicts_table(verdicts: Sequence[Verdict]) -> str:
    """Return a row for each verdict."""
    rows = (
        [one.claim, one.task or "all", f"{one.size or 'all'}", _bold(one.outcome), one.measured] for one in verdicts
    )  # fmt: skip
    return markdown.table(["claim", "task", "N", "verdict", "measured"], rows)


def summary(verdicts: Sequence[Verdict]) -> list[str]:
    """Return one line for each claim: whether it holds, and in how many cells."""
    lines = []
    for name in dict.fromkeys(one.claim for one in verdicts):
        overall = next(one for one in reversed(verdicts) if one.claim == name)
        lines.append(f"{name}: {overall.outcome} ({overall.measured})")
    return lines


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
    return minus(f"{_number(interval.mean)} ({_number(interval.low)} to {_number(interval.high)})")


def _number(value: float) -> str:
    return "∞" if value == math.inf else f"{value:.3g}"


def _bold(outcome: str) -> str:
    return f"**{outcome}**" if outcome == "does not hold" else outcome


def _conditions(plan: Plan) -> str:
    steps = ", ".join(f"{task.name} {plan.steps_of(task):,}" for task in plan.all_tasks)
    lines = [
        f"{plan.runs:,} runs of each team and δ; steps of each run: {steps}; root seed {plan.seed}.",
        f"δ for a risk of {plan.risk:g} that any robot has more than δ neighbours during a run.",
        f"The objective against δ: the team with skill with the degree {plan.degree!r}, on the same noise for each δ; "
        f"a shortfall of up to {plan.tolerance:.0%} of the objective with N − 1 is accepted.",
        "The gain is the objective with N − 1 teammates over that with none, paired; positive is better.",
    ]
    if any(callable(task.skilled) for task in plan.all_tasks):
        lines.append(f"Teams that learn: {plan.trainings} trainings for each degree, which share the runs.")
    if plan.scenario:
        shown = "; ".join(f"{name}={_listed(value)}" for name, value in plan.scenario.items())
        lines.append(f"Scenario: {shown}. Several values are for N in order.")
    return "\n".join(f"- {line}" for line in lines)


def _listed(value: object) -> str:
    return ",".join(map(str, value)) if isinstance(value, (list, tuple)) else str(value)
