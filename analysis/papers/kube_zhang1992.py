"""Kube and Zhang (1992): one to twenty robots push a box that one cannot move.

Teams with a fixed priority of behaviours, with and without recovery from stagnation, or with an adaptive logic network
that learns from it; with all teammates, the nearest, or none in sight. A stress test and no reproduction: the law of
the box is ours. About the result: docs/tasks/pushing.md.

\b
Examples:
  teamsight reproduce kube_zhang1992 --out pushing
  teamsight reproduce kube_zhang1992 --quick --workers 1
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cache, partial
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import numpy.typing as npt

from teamsight.analysis.papers import reproduction
from teamsight.analysis.papers.reproduction import RECALLED, Floats, Paper, column, judged, rows_of, verdict_of
from teamsight.analysis.plot.kinds import draw_means, panels
from teamsight.analysis.plot.style import COLOURS, FAINT, ROBOTS_LABEL
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.seeds import root
from teamsight.analysis.stats.paired import Interval, half_width
from teamsight.analysis.stats.verdicts import FAILS, HOLDS, UNDECIDED, Verdict, above, within
from teamsight.core.component import Allowed, Count, Seed

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure as Canvas

    from teamsight.agents.world import World
    from teamsight.analysis.runs.simulate import Planned
    from teamsight.policies.braitenberg.adaptive_network import AdaptiveNetwork

#: How sure the source of a claim is: read, or none; else `RECALLED`.
READ, OURS = "video 199 of the Handbook of Robotics", "ours"
#: Team sizes at which times are compared: few robots, the number in between, many.
FEW, SOME, MANY = 2, 10, 20
#: The difference of times that counts as none, as a share.
MARGIN = 0.1
FIXED, SLOW, NETWORK, NEAREST, BLIND, EXPLORE = (
    "fixed priority", "no recovery", "network", "δ = 1", "no awareness", "explore",
)  # fmt: skip

# A run stops at the first multiple of these steps at which the box has been moved far enough.
_PART = 100
# The steps and team sizes of the runs from which the network learns, and their replicates and those of its tests.
_STEPS, _SIZES, _EXAMPLES, _TESTS = 300, (3, 6, 12), range(-4, 0), range(-8, -4)
_UNKNOWN = Interval(math.nan, -math.inf, math.inf)
_COLOUR = dict(zip((EXPLORE, FIXED, SLOW, NETWORK), COLOURS, strict=False))
_PAGE = """
# Box pushing

{plan.runs} runs of each team of each size, paired: all teams of a size meet the same places. Root seed {plan.seed}. A
run ends when the box has been moved by 10 units; one that takes longer than {plan.steps} steps is censored and counts
as so many. *Stagnation* is the share of the steps with at least two robots that push in which the box does not move.
Intervals have 95 %, each by itself: they are not corrected for the number of claims. “The same time” means up to
{margin:g} %. Neighbours are those within awareness range, up to the end of the run.

This is a stress test and no reproduction: Kube and Zhang's ranges, speeds, box and results in numbers are not known to
us, and the law of the box is ours. No claim has a number. Claims that are recalled and not verified agree or differ;
only what was read can hold or fail.

## Team sizes

| robots | steps | censored | stagnation | steps without recovery | censored | stagnation | neighbours when exploring | with fixed priority |
| ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |
{sizes}

## Claims

{claims}

## Arbiters and awareness

{said[0]}

{said[1]}
"""  # noqa: E501


@dataclass(frozen=True)
class Pushing(reproduction.PaperPlan):
    """What to simulate.

    Parameters
    ----------
    runs : int
        Runs of each team of each size. Run r of all teams of a size has the same seed.
    steps : int
        Steps after which a run is censored.
    seed : int
        Seed of all runs.
    robots : tuple of int
        The team sizes.
    """

    runs: limits.Runs = 100
    steps: limits.Steps = 2000
    seed: Seed = root("pushing")
    robots: Annotated[tuple[Count, ...], Allowed()] = (1, 2, 3, 4, 5, 6, 8, 10, 12, 14, 16, 18, 20)

    def teams(self) -> dict[str, dict[str, Any]]:
        """Return the parameters of each team, by name."""
        from teamsight.agents.awareness import NearestAwareness
        from teamsight.tasks.pushing import FIXED_PRIORITY, PUSH

        fixed = {"policy": FIXED_PRIORITY, "recovery": True, "awareness": "pairwise"}
        return {
            FIXED: fixed,
            SLOW: {**fixed, "recovery": False},
            NETWORK: {"policy": network_of(self.seed), "awareness": "pairwise"},
            NEAREST: {**fixed, "awareness": NearestAwareness(1)},
            BLIND: {**fixed, "awareness": "none"},
            EXPLORE: dict(PUSH.explore or {}),
        }

    def planned(self) -> Iterator[Planned]:
        """Yield each run with the columns that identify it: team, robots, replicate and seed."""
        from teamsight.tasks.pushing import PUSH

        teams = self.teams()
        for robots in self.robots:
            how = PUSH, self.seed, self.runs, {"robots": robots}, teams, self.steps, until_moved
            for name, replicate, seed, run in reproduction.paired_runs(*how):
                yield {"team": name, "robots": robots, "replicate": replicate, "seed": seed}, run


def until_moved(world: World, steps: int) -> dict[str, Any]:
    """Run a world until the box was moved by its distance, and return what happened until then.

    Returns
    -------
    dict
        ``time`` [steps], that of a censored run being `steps`; whether it is ``censored``; ``box_moved`` [length]; the
        number of steps with at least two robots that push, ``together``, and of those in which the box does not move,
        ``stagnating``; ``max_neighbours`` up to the end of the run.
    """
    from teamsight.tasks.pushing import completion_time

    reproduction.run_until(lambda world: completion_time(world) < math.inf, world, steps, _PART)
    time = completion_time(world)
    is_censored = time == math.inf
    end = steps if is_censored else int(time)
    history = world.recording.history.iloc[:end]
    return {
        "time": end,
        "censored": is_censored,
        "box_moved": float(history["box_moved"].sum()),
        "together": int((history["pushing"] >= 2).sum()),
        "stagnating": int((history["stagnating"] >= 2).sum()),
        "max_neighbours": int(world.recording.max_neighbours("robots")),
    }


@cache
def examples_of(seed: int, replicates: Iterable[int]) -> npt.NDArray[np.int64]:
    """Return what robots with the fixed priority perceive and do: cues and behaviours, shape (2, examples).

    Parameters
    ----------
    seed : int
        The root seed.
    replicates : iterable of int
        Numbers of the runs; they are below 0, so that no other run meets these worlds.
    """
    from teamsight.analysis.runs.run import task_seed
    from teamsight.policies.braitenberg.vehicle import BEHAVIOUR, LAST_CUES
    from teamsight.tasks.pushing import PUSH

    found = []
    for size in _SIZES:
        for replicate in replicates:
            world: Any = PUSH.build(rng=task_seed(PUSH, seed, replicate, {"robots": size}), robots=size)
            for _ in range(_STEPS):
                world.step()
                kept = world.robots.policy_state.ints[:, 0]
                found.append(kept[kept[:, BEHAVIOUR] >= 0][:, [LAST_CUES, BEHAVIOUR]].T)
            world.close()
    return np.concatenate(found, axis=1)


@cache
def network_of(seed: int) -> AdaptiveNetwork:
    """Return the network that has learned from runs with the fixed priority under a root seed."""
    from teamsight.policies.braitenberg.adaptive_network import AdaptiveNetwork

    return AdaptiveNetwork.trained(*examples_of(seed, _EXAMPLES), rng=seed)


def agreement_of(seed: int) -> tuple[float, float]:
    """Return the share of decisions in which network and fixed priority agree: in examples, and in other runs."""
    learned, tested = (
        float(np.mean(network_of(seed).select(cues) == behaviours))
        for cues, behaviours in (examples_of(seed, runs) for runs in (_EXAMPLES, _TESTS))
    )
    return learned, tested


def slower(table: pd.DataFrame, robots: int, than: int, team: str = FIXED) -> Interval:
    """Return by how many steps a team needs longer with one number of robots than with another.

    The variances may differ; without two runs of both, or one that is not censored, nothing is known.
    """
    table = rows_of(table[table["robots"].isin((robots, than))], team=team)
    one, other = (column(table, "time", robots=size) for size in (robots, than))
    if min(len(one), len(other)) < 2 or table["censored"].all():
        return _UNKNOWN
    variance = one.var(ddof=1) / len(one) + other.var(ddof=1) / len(other)
    return _around(float(one.mean() - other.mean()), float(variance), min(len(one), len(other)))


def saved(table: pd.DataFrame, team: str, over: str) -> Interval:
    """Return by which share the mean time of a team of two or more is shorter than that of another, over all sizes.

    If all runs are censored, nothing is known.
    """
    table = table[(table["robots"] >= FEW) & table["team"].isin((team, over))]
    if table["censored"].all():
        return _UNKNOWN
    return reproduction.saving(*(column(table, "time", team=one) for one in (team, over)))


def stagnation(runs: pd.DataFrame) -> Floats:
    """Return for each run the share of the steps with at least two robots that push in which the box does not move.

    Runs without such steps are left out.
    """
    tried = runs[runs["together"] > 0]
    return np.asarray(tried["stagnating"] / tried["together"], float)


def stagnation_slope(table: pd.DataFrame) -> Interval:
    """Return by how much stagnation without recovery grows with each further robot: a line through the means of sizes.

    The variance of each mean is that of its runs, so that sizes may differ in it.
    """
    runs = rows_of(table[table["robots"] >= FEW], team=SLOW)
    shares = {size: stagnation(part.sort_values("replicate")) for size, part in runs.groupby("robots")}
    shares = {size: share for size, share in shares.items() if len(share) > 1}
    if len(shares) < 2:
        return _UNKNOWN
    sizes = np.array(list(shares), float)
    weight = (sizes - sizes.mean()) / ((sizes - sizes.mean()) ** 2).sum()
    means = np.array([share.mean() for share in shares.values()])
    variances = np.array([share.var(ddof=1) / len(share) for share in shares.values()])
    return _around(float(weight @ means), float(weight**2 @ variances), min(len(share) for share in shares.values()))


def _around(mean: float, variance: float, fewest: int) -> Interval:
    """Return Student's interval, with the degrees of freedom of the smallest sample, so that it is not too short."""
    wide = float(half_width(np.array(math.sqrt(variance)), np.array(fewest)))
    return Interval(mean, mean - wide, mean + wide)


def verdicts(table: pd.DataFrame, plan: Pushing | None = None) -> list[Verdict]:
    """Return the verdicts on all claims; `table` has a row for each run."""
    from teamsight.analysis.stats.exceedance import bounds

    alone, pair = rows_of(table, robots=1), rows_of(table, team=FIXED, robots=FEW)
    moved, done = int((alone["box_moved"] > 0).sum()), int((~pair["censored"]).sum())
    # That two robots move the box in more than half of the runs, by the interval of Clopper and Pearson.
    low, high = (float(one) for one in bounds(done, max(len(pair), 1), 0.975))
    return [
        judged(
            "K1 One robot never moves the box (by construction)", READ, f"{moved} of {len(alone)} runs",
            UNDECIDED if alone.empty else FAILS if moved else HOLDS,
        ),
        judged(
            f"K1 {FEW} robots move it the whole way in most runs", READ,
            f"{done} of {len(pair)} runs ({100 * low:.0f} to {100 * high:.0f} %)",
            above(Interval(0.5, low, high), 0.5),
        ),
        verdict_of(f"K2 {SOME} robots are faster than {FEW}", RECALLED, slower(table, FEW, SOME), "steps"),
        verdict_of(f"K2 {MANY} robots are slower than {SOME}", RECALLED, slower(table, MANY, SOME), "steps"),
        verdict_of(
            "K3 Without recovery, stagnation grows with N", RECALLED, stagnation_slope(table), "%",
            said="{} for each robot",
        ),
        verdict_of(
            f"K4 Network and fixed priority take the same time (up to {100 * MARGIN:g} %)", RECALLED,
            saved(table, NETWORK, FIXED), "%", partial(within, margin=MARGIN),
        ),
        verdict_of("Perceiving the nearest teammate saves time", OURS, saved(table, FIXED, BLIND), "%"),
    ]  # fmt: skip


def same_runs(table: pd.DataFrame) -> tuple[int, int]:
    """Return in how many runs of teams of two or more δ = 1 changes nothing that is measured, and their number."""
    measured = ["time", "box_moved", "together", "stagnating", "max_neighbours"]
    one, two = (
        rows_of(table[table["robots"] >= FEW], team=team).sort_values(["robots", "replicate"])[measured].to_numpy()
        for team in (FIXED, NEAREST)
    )
    return int((one == two).all(axis=1).sum()), len(one)


def draw(table: pd.DataFrame, plan: Pushing) -> Canvas:
    """Return times, stagnation and neighbours against the number of robots."""
    sizes = [size for size in plan.robots if size >= FEW]
    time, best = min((column(table, "time", team=FIXED, robots=size).mean(), size) for size in plan.robots)
    quantities: dict[str, tuple[tuple[str, ...], Callable[[pd.DataFrame], Any]]] = {
        "steps until the box is moved": ((FIXED, SLOW, NETWORK), lambda runs: runs["time"]),
        "stagnation": ((FIXED, SLOW), stagnation),
        "largest number of neighbours": ((EXPLORE, FIXED), lambda runs: runs["max_neighbours"]),
    }
    figure, shown = panels(
        f"{best} robots move the box fastest, in {time:.0f} steps",
        f"with a {FIXED}; {plan.runs} runs of each team; 95 % confidence intervals; seed {plan.seed}",
        list(quantities), x=ROBOTS_LABEL,
    )  # fmt: skip
    shown[-1].plot(sizes, [size - 1 for size in sizes], color=FAINT, linewidth=0.8, linestyle=":", label="N − 1")
    for axes, (teams, measured) in zip(shown, quantities.values(), strict=True):
        for team in teams:
            runs = {size: rows_of(table, team=team, robots=size).sort_values("replicate") for size in sizes}
            samples = {size: found for size, one in runs.items() if len(found := measured(one))}
            wide = 2.4 if team == FIXED else 1.2
            found = reproduction.intervals(samples.values())
            draw_means(axes, list(samples), found, _COLOUR[team], team, as_bars=True, linewidth=wide)
        axes.set_ylim(0, 1 if measured is stagnation else None)
        axes.legend(frameon=False, fontsize=8)
    return figure


def sizes(table: pd.DataFrame) -> str:
    """Return the rows of a table, one for each number of robots."""
    rows = []
    for size in sorted(table["robots"].unique()):
        row = f"| {size} |"
        for team in (FIXED, SLOW):
            runs = rows_of(table, team=team, robots=size)
            stuck = f"{100 * stagnation(runs).mean():.0f} %" if runs["together"].any() else "–"
            row += f" {runs['time'].mean():.0f} | {100 * runs['censored'].mean():.0f} % | {stuck} |"
        met = (rows_of(table, team=team, robots=size)["max_neighbours"].mean() for team in (EXPLORE, FIXED))
        rows.append(row + "".join(f" {one:.1f} |" for one in met))
    return "\n".join(rows)


def sentences(table: pd.DataFrame, plan: Pushing) -> tuple[str, str]:
    learned, tested = agreement_of(plan.seed)
    same, runs = same_runs(table)
    return (
        f"The network selects the behaviour of the fixed priority in {100 * learned:.2f} % of the decisions from which "
        f"it learned, and in {100 * tested:.2f} % of those of other runs.",
        f"With the nearest teammate alone (δ = 1) instead of all teammates, {same} of {runs} runs with at least two "
        "robots are the same.",
    )


PAPER = Paper(
    plan=Pushing, name="pushing", page="tasks/pushing", template=_PAGE, figures={"pushing": draw},
    values=lambda table, plan: {
        "margin": 100 * MARGIN, "sizes": sizes(table), "said": sentences(table, plan),
    },
    verdicts=verdicts, sentences=sentences, quick={"runs": 10, "robots": (1, 2, 5, 10, 20)},
    small={"runs": 1, "steps": 60, "robots": (1, 2, 4), "seed": 7},
)  # fmt: skip
