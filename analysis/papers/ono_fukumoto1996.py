"""Ono and Fukumoto (1996): four hunters that must surround a prey, with modules or with one table over all.

Compares the sizes of tables, captures while hunters learn, and random hunters; judges whether modules learn, whether
hunters specialise, and what δ by distance costs. About the result: docs/tasks/surround.md.

\b
Examples:
  teamsight reproduce ono_fukumoto1996 --out pursuit
  teamsight reproduce ono_fukumoto1996 --quick --workers 1
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, cast

import numpy as np
import numpy.typing as npt

from teamsight.analysis.papers.reproduction import NAMES, Floats, NamedConditions, Paper, column, rows_of
from teamsight.analysis.plot.kinds import panels
from teamsight.analysis.plot.style import COLOURS, FAINT
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.seeds import root
from teamsight.analysis.stats.paired import Interval, interval_of
from teamsight.analysis.stats.verdicts import FAILS, HOLDS, UNDECIDED, Verdict, above
from teamsight.core.component import Allowed, Seed

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure as Canvas

    from teamsight.agents.world import World
    from teamsight.analysis.runs.run import Run

Integers = npt.NDArray[np.int64]

#: The side of the torus of Ono and Fukumoto [cells], and hunters that surround one prey.
SIDE, HUNTERS = 20, 4
#: Smaller tori, on which random hunters capture often enough to be counted; on the first one table is learned too.
SMALLER, SMALL = (4, 5, 6, 7, 8), 4
#: Parts of a run in which captures are counted, and those at its end that count as late.
PARTS, LATE = 40, 10
#: At least by this factor learners must be faster.
FACTOR = 10.0

# Steps at the end of a run whose positions are recorded, at most.
_WATCHED = 100_000
# Shuffles of the hunters in every capture, for the mutual information that chance alone gives.
_SHUFFLES = 200
# East, west, north, south.
_SIDES = np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
# Each interval of two that are compared has this level, so that both hold with 95 %.
_LEVEL = 0.975
_ONO, _WHITEHEAD = "Ono and Fukumoto", "Whitehead et al."
_RANDOM, _MODULAR, _WHOLE = f"random, side {SIDE}", f"modular, side {SMALL}", f"monolithic, side {SMALL}"
# By torus, the conditions with their labels and colours.
_PANELS = {
    SIDE: {
        "modular, depth 2": ("modules, depth 2", COLOURS[1]),
        "modular, depth 3": ("modules, depth 3", COLOURS[2]),
        "monolithic, depth 2": ("one table over all, depth 2", COLOURS[3]),
        "nearest 2, depth 2": ("the 2 nearest, depth 2", COLOURS[4]),
        "nearest 1, depth 2": ("the nearest, depth 2", COLOURS[5]),
    },
    SMALL: {_MODULAR: ("modules", COLOURS[1]), _WHOLE: ("one table over all", COLOURS[3])},
}
_PAGE = """
# Modules against one table over all

{plan.runs} runs of each condition, root seed {plan.seed}. Four hunters on a torus must stand on all four sides of one
prey. Ono and Fukumoto's rates, their choice of actions and their prey's moves are not known to us. Ours: α = 0.1, γ =
0.9, Boltzmann choice by the sum of the modules with T = 0.001, first values 0; reward 1 to every hunter at a capture
and −0.1 at any other step; a prey that moves at random or stays; prey that would enter a hunter's cell stays, then
hunters that would enter the prey's. They were chosen on other seeds.

## Tables of a hunter

| depth | p | rows of 3 modules, 3·p² | rows of one table, p⁴ | values, modules | values, one table |
| ---: | ---: | ---: | ---: | ---: | ---: |
{sizes}

## Steps to a capture

| hunters | steps | captures | runs with a capture at the end | steps to a capture at the end (95 %) | mutual information, by chance [bit] |
| :--- | ---: | ---: | ---: | ---: | ---: |
{learners}

## Random hunters

| torus | steps | captures | steps to a capture (95 %) | (side² − 1)⁴ / 4! | ratio |
| :--- | ---: | ---: | ---: | ---: | ---: |
{random}

## {number} claims

{claims}
"""  # noqa: E501


@dataclass(frozen=True)
class Condition:
    """A team and its torus.

    Parameters
    ----------
    side : int
        The side of the torus [cells].
    depth : int
        Hunters perceive prey and each other in a square of so many cells to each side.
    learner : mapping of str to object, optional
        How hunters learn, as parameters of `ModularQ`; without it they move at random.
    delta : int, optional
        How many of the nearest hunters each perceives; by default all in its square.
    steps : int
        Steps of a run.
    """

    side: int
    depth: int
    learner: Mapping[str, Any] | None = None
    delta: int | None = None
    steps: int = 2_000_000

    @property
    def parameters(self) -> dict[str, Any]:
        """All parameters of the world."""
        from teamsight.agents.awareness import NearestAwareness
        from teamsight.policies.online.lattice_walk import LatticeWalk
        from teamsight.policies.online.modular_q import ModularQ

        policy: Any = LatticeWalk(5)
        found = {
            "hunters": HUNTERS, "prey": 1, "side": self.side, "depth": self.depth, "rule": "surround", "torus": True,
            "awareness": "none", "prey_policy": policy, "policy": policy,
        }  # fmt: skip
        if self.learner is not None:
            found["awareness"] = "pairwise" if self.delta is None else NearestAwareness(self.delta)
            found["policy"] = ModularQ(self.depth, **self.learner)
        return found


#: The conditions by name.
CONDITIONS: Mapping[str, Condition] = {
    **{f"random, side {side}": Condition(side, 1, steps=1_000_000) for side in SMALLER},
    _RANDOM: Condition(SIDE, 1),
    "modular, depth 2": Condition(SIDE, 2, {}),
    "monolithic, depth 2": Condition(SIDE, 2, {"monolithic": True}),
    "modular, depth 3": Condition(SIDE, 3, {}, steps=8_000_000),
    **{
        f"nearest {delta}, depth 2": Condition(SIDE, 2, {"modules": delta, "by": "distance"}, delta)
        for delta in (1, 2, 3)
    },
    _MODULAR: Condition(SMALL, 1, {}, steps=3_000_000),
    _WHOLE: Condition(SMALL, 1, {"monolithic": True}, steps=3_000_000),
}


@dataclass(frozen=True)
class Surroundings(NamedConditions):
    """What to simulate.

    Parameters
    ----------
    share : float
        Steps of a run, as a share of each condition's own.
    """

    runs: limits.Runs = 6
    seed: Seed = root("surround")
    names: Annotated[tuple[Annotated[str, Allowed(choices=CONDITIONS)], ...], NAMES] = ()
    known = CONDITIONS

    def work(self, condition: Condition) -> tuple[dict[str, Any], Callable[[int], Run]]:
        """Return the column steps, and what returns the run with a seed."""
        from teamsight.analysis.runs.run import Run
        from teamsight.tasks.pursuit import Pursuit

        # A whole number of steps in each part.
        steps = max(int(self.share * condition.steps) // PARTS, 1) * PARTS
        measure = Surrounding(condition.side)
        return {"steps": steps}, lambda seed: Run(condition.parameters, seed, steps, measure, Pursuit)


@dataclass(frozen=True)
class Surrounding:
    """Measures a world of `Pursuit` with the rule "surround".

    Parameters
    ----------
    side : int
        The side of its torus [cells].
    """

    side: int

    def __call__(self, world: World, steps: int) -> dict[str, Any]:
        """Run the world and return captures by part of the run, and the mutual information of hunters and sides."""
        watched = min(_WATCHED, steps // 2)
        world.run(steps - watched, progress=False)
        world.recording.record_positions()
        world.run(watched, progress=False)
        ends = np.flatnonzero(world.recording.history["captures"].to_numpy() > 0)
        parts = np.histogram(ends, np.linspace(0, steps, PARTS + 1))[0]
        found = information(self._sides(world, ends[ends >= steps - watched] + 1), np.random.default_rng(steps))
        return {
            "captures": int(parts.sum()),
            "parts": parts.tolist(),
            "late": int(parts[-LATE:].sum()),
            "neighbours": int(world.max_neighbours),
            **found,
        }

    def _sides(self, world: World, times: Integers) -> Integers:
        """Return which hunter, by number, stood on which side at some times; shape (captures, sides)."""
        frame = world.recording.trajectory
        frame = frame[np.isin(frame["time"].to_numpy(), times)]
        is_prey = frame["group"].to_numpy() == "prey"
        place = frame[["x", "y"]].to_numpy()
        prey, hunters = place[is_prey][:, np.newaxis], place[~is_prey].reshape(len(times), HUNTERS, 2)
        gap = hunters - prey
        gap -= self.side * np.rint(gap / self.side)
        there = (np.rint(gap)[:, :, np.newaxis] == _SIDES).all(axis=-1)
        return cast("Integers", there.argmax(axis=1))


def information(sides: Integers, rng: np.random.Generator) -> dict[str, float]:
    """Return the mutual information of hunters and sides [bit], and its mean if hunters are shuffled in each capture.

    Parameters
    ----------
    sides : ndarray, shape (captures, sides), int64
        The number of the hunter on each side of the prey.
    rng : Generator
        For the shuffles.

    Returns
    -------
    dict
        information, chance (NaN without captures), and watched, the number of captures.
    """
    count = len(sides)
    if not count:
        return {"information": np.nan, "chance": np.nan, "watched": 0}
    shuffled = [_bits(rng.permuted(sides, axis=1)) for _ in range(_SHUFFLES)]
    return {"information": _bits(sides), "chance": float(np.mean(shuffled)), "watched": count}


def _bits(sides: Integers) -> float:
    number = sides.shape[1]
    counts = np.zeros((number, number))
    np.add.at(counts, (np.broadcast_to(np.arange(number), sides.shape), sides), 1)
    share = counts / counts.sum()
    by_chance = share.sum(axis=1, keepdims=True) * share.sum(axis=0, keepdims=True)
    some = share > 0
    return float(np.sum(share[some] * np.log2(share[some] / by_chance[some])))


def late_rates(table: pd.DataFrame, condition: str) -> Floats:
    """Return log10 of the captures per step at the end of each run; a run without any counts as half a capture."""
    late, steps = (column(table, name, condition=condition) for name in ("late", "steps"))
    return np.asarray(np.log10(np.maximum(late, 0.5) / (steps * LATE / PARTS)))


def early_rates(table: pd.DataFrame, condition: str) -> Floats:
    """Return log10 of the captures per step in the first tenth of each run, without any as half a capture."""
    found = rows_of(table, condition=condition).sort_values("replicate")
    early = np.array(found["parts"].tolist())[:, : PARTS // 10].sum(axis=1)
    return np.asarray(np.log10(np.maximum(early, 0.5) / (found["steps"] / 10)), float)


def late_steps(table: pd.DataFrame, condition: str, level: float = 0.95) -> Interval:
    """Return the steps to a capture at the end of runs, their geometric mean with its interval.

    If a run has no capture there, the upper end is infinite; if none has any, so is the mean, and the lower end is
    Poisson's bound.
    """
    late, steps = (column(table, name, condition=condition) for name in ("late", "steps"))
    if not late.any():
        return Interval(math.inf, float(steps.sum()) * LATE / PARTS / _most(0, level), math.inf)
    mean, low, high = (_power(one) for one in interval_of(-late_rates(table, condition), level))
    return Interval(mean, low, high if late.all() else math.inf)


def random_steps(table: pd.DataFrame, condition: str, level: float = 0.95) -> Interval:
    """Return the mean steps to a capture of random hunters; captures at random times follow Poisson's law.

    Without a capture the mean is infinite, and the lower end is a bound.
    """
    from scipy.special import gammaincinv

    found = rows_of(table, condition=condition)
    captures, steps = int(found["captures"].sum()), float(found["steps"].sum())
    least = float(gammaincinv(captures, (1 - level) / 2)) if captures else 0.0
    mean = steps / captures if captures else math.inf
    return Interval(mean, steps / _most(captures, level), steps / least if least else math.inf)


def expected_steps(side: int) -> float:
    """Return the mean steps to a capture if hunters were anywhere but in the prey's cell: (side² − 1)⁴ / 4!.

    There are 4! ways in which four hunters hold four sides. Random hunters need less, because one that would enter the
    prey's cell stays beside it.
    """
    return float((side**2 - 1) ** HUNTERS / math.factorial(HUNTERS))


def _most(captures: int, level: float) -> float:
    """Return the largest mean number of captures with which so few are not too unlikely, by Poisson's law."""
    from scipy.special import gammaincinv

    return float(gammaincinv(captures + 1, 1 - (1 - level) / 2))


def _power(exponent: float) -> float:
    return 10**exponent if exponent < 300 else math.inf


def verdicts(table: pd.DataFrame, plan: Surroundings | None = None) -> list[Verdict]:
    """Return the verdicts on all claims whose conditions are in the table; it has a row for each run."""
    have, found = set(table["condition"]), []

    def faster(claim: str, source: str, better: str, worse: str, least: float = 1.0, early: bool = False) -> None:
        """Judge whether one condition captures more often than another, by a factor; runs are paired."""
        if have >= {better, worse}:
            rates = early_rates if early else late_rates
            factors = interval_of(rates(table, better) - rates(table, worse))
            factor = Interval(*(float(10.0 ** min(one, 300.0)) for one in factors))
            mean, low, high = (f"{one:,.0f}" if one >= 100 else f"{one:.3g}" for one in factor)
            said = f"{mean} times ({low} to {high}) as many captures"
            said = f"{said} in the first tenth of the steps" if early else f"{better} / {worse}: {said} at the end"
            found.append(Verdict(claim, source, said, above(factor, least)))

    for depth in (2, 3):
        name = f"modular, depth {depth}"
        if have >= {name, _RANDOM}:
            ours, chance = late_steps(table, name, _LEVEL), random_steps(table, _RANDOM, _LEVEL)
            verdict = HOLDS if chance.low >= FACTOR * ours.high else UNDECIDED
            verdict = FAILS if chance.high < FACTOR * ours.low else verdict
            claim = f"O1, {name}: modular learners need at most a tenth of the steps of random hunters"
            said = f"random {shown(chance)} steps; at the end of learning {shown(ours)}"
            found.append(Verdict(claim, _ONO, said, verdict))
    faster(
        "O2: one table over all captures less than a tenth as often, after the same steps", _ONO, "modular, depth 2",
        "monolithic, depth 2", FACTOR,
    )  # fmt: skip
    for depth in (2, 3):
        if (name := f"modular, depth {depth}") in have:
            runs = rows_of(table, condition=name)
            runs, said, verdict = runs[runs["watched"] > 0], "no captures at the end", UNDECIDED
            if len(runs):
                bits, chance_bits = (runs[one].to_numpy(float) for one in ("information", "chance"))
                excess = interval_of(bits - chance_bits)
                verdict = above(excess)
                said = (
                    f"mutual information {bits.mean():.2f} bit, by chance {chance_bits.mean():.3f}: "
                    f"{excess.mean:+.2f} ({excess.low:+.2f} to {excess.high:+.2f}), of 2".replace("-", "−")
                )
            claim = f"O3, {name}: hunters specialise, each in some sides of the prey"
            found.append(Verdict(claim, _ONO, said, verdict))
    torus = f"On a torus of side {SMALL} modules"
    faster(f"{torus} learn faster than one table over all", _WHITEHEAD, _MODULAR, _WHOLE, early=True)
    faster(f"{torus} end below one table over all", _WHITEHEAD, _WHOLE, _MODULAR)
    three, two, one = (f"nearest {delta}, depth 2" for delta in (3, 2, 1))
    faster("With the δ nearest, δ = 2 is below δ = N − 1 = 3", "ours", three, two)
    faster("So is δ = 1 below δ = 2", "ours", two, one)
    return found


def shown(interval: Interval) -> str:
    """Return a number of steps and its interval; of one that is infinite only the bound is known."""
    mean, low, high = interval
    if not math.isfinite(mean):
        return f"more than {low:,.0f}"
    return f"{mean:,.0f} ({low:,.0f} to {f'{high:,.0f}' if math.isfinite(high) else '∞'})"


def draw(table: pd.DataFrame, plan: Surroundings) -> Canvas:
    """Return steps to a capture while hunters learn, on the large torus and on the small one."""
    have = set(table["condition"])
    found = {name: late_steps(table, name).mean for name in list(_PANELS[SIDE])[:3] if name in have}
    takes = (f"{mean:,.0f} ({name})" for name, mean in found.items() if math.isfinite(mean))
    figure, shown = panels(
        f"Four trained hunters surround a prey in {', '.join(takes) or 'unknown'} steps",
        f"one prey; {plan.runs} runs of each, and their geometric mean; dashed: random hunters, by formula; seed "
        f"{plan.seed}",
        [f"torus of {side} × {side}" for side in _PANELS], x="steps of learning [million]", y="steps to a capture",
        size=(5.4, 3.9), width_ratios=(1.6, 1.0),
    )  # fmt: skip
    for axes, (side, curves) in zip(shown, _PANELS.items(), strict=True):
        axes.set(xscale="log", yscale="log")
        for name, (label, colour) in curves.items():
            runs = rows_of(table, condition=name)
            if runs.empty:
                continue
            part = int(runs["steps"].iloc[0]) / PARTS
            # A part without a capture is drawn as if it had half of one.
            steps = part / np.maximum(np.array(runs["parts"].tolist(), float), 0.5)
            middle = part * (np.arange(PARTS) + 0.5) / 1e6
            axes.plot(middle, steps.T, color=colour, linewidth=0.5, alpha=0.35)
            axes.plot(middle, np.exp(np.log(steps).mean(axis=0)), color=colour, linewidth=2.0, label=label)
        if axes.get_legend_handles_labels()[1]:
            axes.legend(frameon=False, fontsize=8, loc="upper right", bbox_to_anchor=(1.0, 0.93))
        axes.axhline(expected_steps(side), color=FAINT, linestyle="--", linewidth=1.0)
    return figure


def page_values(table: pd.DataFrame, plan: Surroundings) -> dict[str, str]:
    """Return the rows of the tables of the page: sizes of tables, hunters that learn, and random ones."""
    from teamsight.policies.online.modular_q import ModularQ

    sizes, learners, random = [], [], []
    for depth in (2, 3, 4):
        modular, places = ModularQ(depth), (2 * depth + 1) ** 2 + 1
        whole = places**HUNTERS
        values = f"{modular.entries:,} | {whole * modular.moves:,}"
        sizes.append(f"| {depth} | {places} | {modular.tables * modular.rows:,} | {whole:,} | {values} |")
    for name, condition in CONDITIONS.items():
        runs = rows_of(table, condition=name)
        if runs.empty:
            continue
        if condition.learner is not None:
            bits, chance = runs["information"].mean(), runs["chance"].mean()
            met = f"{(runs['late'] > 0).sum()} of {len(runs)}"
            row = f"| {name} | {int(runs['steps'].iloc[0]):,} | {runs['captures'].mean():,.0f} | {met} | "
            known = f"{bits:.2f} ({chance:.2f})" if bits == bits else ""
            learners.append(f"{row}{shown(late_steps(table, name))} | {known} |")
        else:
            found, formula = random_steps(table, name), expected_steps(condition.side)
            torus, steps = f"{condition.side} × {condition.side}", int(runs["steps"].sum())
            row = f"| {torus} | {steps:,} | {runs['captures'].sum():,} | "
            ratio = f"{found.mean / formula:.2f}" if found.mean < math.inf else ""
            random.append(f"{row}{shown(found)} | {formula:,.0f} | {ratio} |")
    return {"sizes": "\n".join(sizes), "learners": "\n".join(learners), "random": "\n".join(random)}


PAPER = Paper(
    plan=Surroundings, name="pursuit-modules", page="tasks/surround", template=_PAGE, figures={"pursuit-modules": draw},
    values=page_values, verdicts=verdicts, quick={"runs": 3, "share": 0.05},
    small={"runs": 2, "share": 0.0005, "names": ("random, side 4", "modular, side 4")},
)  # fmt: skip
