"""Tan (1993): hunters that learn to capture prey, alone or together, with scouts and shared tables.

Puts the 34 values of his tables and figures beside ours under readings of what he leaves open, each with a verdict
from both intervals, and judges claims on what sight of a partner is worth while a team learns. About the result:
docs/tasks/pursuit.md.

\b
Examples:
  teamsight reproduce tan1993 --out pursuit
  teamsight reproduce tan1993 --quick --workers 1
  teamsight reproduce tan1993 --names "2/2 joint" --names "2/2 joint passive"
"""

from __future__ import annotations

import contextlib
import gc
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, cast

import numpy as np

from teamsight.analysis.papers.reproduction import (
    AGREES,
    DIFFERS,
    NAMES,
    Floats,
    NamedConditions,
    Paper,
    column,
    intervals,
    rows_of,
    verdict_counts,
    verdict_of,
)
from teamsight.analysis.plot import markdown
from teamsight.analysis.plot.kinds import draw_means, panels
from teamsight.analysis.plot.style import DEGREE, FAINT, shades
from teamsight.analysis.runs.seeds import root, run_seed
from teamsight.analysis.stats.paired import Interval, interval_of
from teamsight.analysis.stats.verdicts import FAILS, HOLDS, UNDECIDED, Verdict, above, interval_text, plus_minus
from teamsight.core.component import Allowed, Count, Seed

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

    from teamsight.agents.world import World
    from teamsight.analysis.runs.simulate import Planned

#: Trials of training where one hunter captures, where two must, and where only the beginning matters.
ALONE, JOINT, SHORT = 2000, 10_000, 3000
#: Trials that one point of a learning curve averages, at the end of training that give its result, that count as early,
#: and as late.
BLOCK, SETTLED, EARLY, LATE = 50, 500, 200, 500
#: Blocks that a crossing is smoothed over, and depths whose crossings are compared.
SMOOTH, DEPTHS = 5, (2, 3, 4)
#: Trials over which Tan averages random hunters; the least number of runs that his intervals stand for; their level.
RANDOM_TRIALS, TAN_RUNS, LEVEL = 200, 5, 0.90
#: A difference is decided only if its 95 % interval is not wider than this share of Tan's value to either side.
WIDEST = 0.25
#: A value agrees within this share of Tan's. One that is read off a picture may be wrong by so many steps.
NEAR, READ_OFF = 0.10, 2.0
#: What Tan reports: the steps of a trial in training and in the test, with half his 90 % intervals where he gives them.
#: Each value once: 12.21 is in Table 1 too, and at 100.61 and 119.17 curves of Figs. 7, 8 settle, read as 101 and 116.
VALUES = """
Table 1 | 1/1 random        | 123.08
Table 1 | 1/2 random        | 56.47
Table 1 | 1/2 joint random  | 354.45
Table 1 | 2/2 joint random  | 224.92
Table 1 | 1/1 depth 4       | 25.32
Table 1 | 1/2 joint         | 119.17
Table 1 | 2/2 joint         | 100.61
Table 2 | 1/1 depth 2       | 47.14 ± 1.28 | 49.49 ± 1.60
Table 2 | 1/1 scout 2       | 46.33 ± 1.39 | 42.91 ± 1.48
Table 2 | 1/1 scout 3       | 39.78 ± 1.06 | 32.08 ± 1.22
Table 2 | 1/1 scout 4       | 32.67 ± 1.03 | 25.07 ± 0.89
Table 3 | 1/2 depth 2       | 20.38 ± 0.57 | 24.04 ± 1.00
Table 3 | 1/2 depth 3       | 14.65 ± 0.53 | 16.04 ± 0.56
Table 3 | 1/2 depth 4       | 12.21 ± 0.65 | 11.53 ± 0.61
Table 3 | 1/2 mutual 2      | 25.20 ± 0.79 | 24.52 ± 1.24
Table 3 | 1/2 mutual 3      | 14.02 ± 0.75 | 12.98 ± 0.65
Table 3 | 1/2 mutual 4      | 11.05 ± 0.56 | 8.83 ± 0.78
Fig. 7  | 2/2 joint passive | 49
Fig. 7  | 2/2 joint mutual  | 39
Fig. 7  | 2/2 joint         |              | 49
Fig. 7  | 2/2 joint passive |              | 42
Fig. 7  | 2/2 joint mutual  |              | 34
Fig. 8  | 1/2 joint passive | 84
Fig. 8  | 1/2 joint mutual  | 76
"""
#: The claims that one condition needs fewer steps than another: text, source, both, and when: in training, in the test,
#: or in the first trials.
ORDERS = (
    ("One hunter learns to capture", "Tan, Table 1", "1/1 random", "1/1 depth 4", "training"),
    ("A scout of depth 2 shortens tests", "Tan, Table 2", "1/1 depth 2", "1/1 scout 2", "test"),
    ("One of depth 3 shortens training", "Tan, Table 2", "1/1 scout 2", "1/1 scout 3", "training"),
    ("One of depth 4 shortens it more", "Tan, Table 2", "1/1 scout 3", "1/1 scout 4", "training"),
    ("At depth 2, reports slow training", "Tan, Table 3", "1/2 mutual 2", "1/2 depth 2", "training"),
    ("At depth 4 they shorten training", "Tan, Table 3", "1/2 depth 4", "1/2 mutual 4", "training"),
    ("At depth 4 they shorten tests", "Tan, Table 3", "1/2 depth 4", "1/2 mutual 4", "test"),
    ("Averaging tables every 10 steps speeds learning up", "Tan §6.2", "1/2 depth 4", "1/2 averaging 10", "early"),
    ("So does averaging every 50 steps", "Tan §6.2", "1/2 depth 4", "1/2 averaging 50", "early"),
    ("So does averaging every 200 steps", "Tan §6.2", "1/2 depth 4", "1/2 averaging 200", "early"),
    ("So does one table for both", "Tan §6.2", "1/2 depth 4", "1/2 one table", "early"),
    ("Seeing the partner helps", "Tan, Fig. 7", "2/2 joint", "2/2 joint passive", "training"),
    ("Mutual scouting helps more", "Tan, Fig. 7", "2/2 joint passive", "2/2 joint mutual", "training"),
    ("So it does with one prey", "Tan, Fig. 8", "1/2 joint", "1/2 joint passive", "training"),
    ("Mutual scouting helps more", "Tan, Fig. 8", "1/2 joint passive", "1/2 joint mutual", "training"),
)


class Reading(NamedTuple):
    """What Tan leaves open, as it is read; by default as we do.

    Attributes
    ----------
    in_turn : bool
        Whether hunters move first where two must capture too, and not all at once.
    legal_prey, legal_hunters : bool
        Whether they never move against the wall, and do not lose such a move.
    sides : bool
        Whether only cells with a side in common are next to each other.
    no_value : bool
        Whether what is perceived at a capture counts 0, and not its value.
    short : bool
        Whether training has half as many trials.
    soft : bool
        Whether hunters choose in tests as in training, and not greedily.
    """

    in_turn: bool = False
    legal_prey: bool = False
    legal_hunters: bool = False
    sides: bool = False
    no_value: bool = False
    short: bool = False
    soft: bool = False


#: The readings that are reported: ours, the best of the scan (`tan1993_readings`), and that of another simulator.
READINGS: Mapping[str, Reading] = {
    "ours": Reading(),
    "best": Reading(legal_prey=True, soft=True),
    "in turn": Reading(in_turn=True, legal_prey=True, short=True, soft=True),
}
OURS = next(iter(READINGS))

# The square that reported prey and teammates are in, wherever they are on Tan's grid [cells to each side].
_EVERYWHERE = 10
# Steps that are made at once, at least; of how many only half are, where training is to end soon; and for how many
# times the longest expected training. Tests of more steps have means that are far from all of Tan's, below 50.
_LEAST, _FAR, _MOST_STEPS, _LONGEST_TEST = 2000, 20_000, 40_000_000, 100_000
# Conditions of the first panel, their names, and the colour of the degree of awareness that each needs.
_CURVES = {
    "2/2 joint": ("independent", DEGREE["none"]),
    "2/2 joint passive": ("sees the partner", DEGREE["pairwise"]),
    "2/2 joint mutual": ("mutual scouting", DEGREE["shared"]),
}
# What `ledger` says of ours.
_FOUND = ("mean", "half90", "half95", "near", "difference", "low", "high", "verdict")
# Blocks that one point of the figure averages.
_POINT = 4
_PAGE = """
# Tan's pursuit

{plan.runs} runs of each condition, root seed {plan.seed}. Values are mean steps of a trial: for training over its last
{settled} trials, for tests over {plan.tests} trials of tables that learn no more. Intervals are Student's, 95 %.

Tan does not say in which order agents move, what “next to” means, what a move against the wall does, how tests choose,
or how the last step of a trial is valued. As we read him (“ours”) hunters move first where one captures, all move at
once where two must; diagonals are next to a cell; a move against the wall is lost; tests are greedy; the value of what
is perceived at a capture counts like any other, as his formula reads. “Best” differs in that prey make legal moves only
and tests choose as training does; “in turn” also in that hunters move first everywhere, and training has half as many
trials.

## {values} values

{rules}

{agreement}

{ledger}

## {number} claims

As we read him. {chance}

{claims}
"""


@dataclass(frozen=True)
class Condition:
    """A team and its task.

    Parameters
    ----------
    world : mapping of str to object
        Parameters of `Pursuit`, without the policy.
    learner : mapping of str to object, optional
        How hunters learn, as parameters of `PreyQ`; without it they move at random.
    trials : int
        Trials of training.
    """

    world: Mapping[str, Any]
    learner: Mapping[str, Any] | None = None
    trials: int = ALONE

    def relevant(self, reading: Reading) -> Reading:
        """Return a reading without what makes no difference to training here."""
        is_joint, learns = self.world["rule"] == "pair", self.learner is not None
        return reading._replace(
            in_turn=reading.in_turn and is_joint, sides=reading.sides and is_joint,
            no_value=reading.no_value and learns, short=reading.short and learns, soft=False,
        )  # fmt: skip

    def parameters(self, reading: Reading = READINGS[OURS]) -> dict[str, Any]:
        """Return all parameters of the world."""
        from teamsight.policies.online.lattice_walk import BoundedWalk
        from teamsight.policies.online.prey_q import BoundedPreyQ, PreyQ

        reading, found = self.relevant(reading), dict(self.world)
        if reading.in_turn:
            found["order"] = "in turn"
        if reading.sides:
            found["diagonals"] = False
        if reading.legal_prey:
            found["prey_policy"] = BoundedWalk()
        if self.learner is not None:
            # Tan's V(y) is the value of what is perceived next; as we read it, at the end of a trial too.
            learner = {"values_ends": not reading.no_value, **self.learner}
            found["policy"] = (BoundedPreyQ if reading.legal_hunters else PreyQ)(self.world["depth"], **learner)
        elif reading.legal_hunters:
            found["policy"] = BoundedWalk()
        return found


def _alone(hunters: int, depth: int, **world: Any) -> dict[str, Any]:
    return {"hunters": hunters, "prey": 1, "depth": depth, "rule": "alone", **world}


def _joint(prey: int, depth: int = 4, **world: Any) -> dict[str, Any]:
    return {"hunters": 2, "prey": prey, "depth": depth, "rule": "pair", **world}


def _conditions() -> dict[str, Condition]:
    reported: dict[str, Any] = {"awareness": "shared", "teammate_depth": _EVERYWHERE}
    reach = {"reach": _EVERYWHERE}
    found = {
        "1/1 random": Condition(_alone(1, 4)),
        "1/2 random": Condition(_alone(2, 4)),
        "1/2 joint random": Condition(_joint(1)),
        "2/2 joint random": Condition(_joint(2)),
        "1/1 depth 4": Condition(_alone(1, 4), {}),
        "1/1 depth 2": Condition(_alone(1, 2), {}),
    }
    for depth in DEPTHS:
        found[f"1/1 scout {depth}"] = Condition(_alone(1, 2, scouts=1, scout_depth=depth, **reported), reach)
        found[f"1/2 depth {depth}"] = Condition(_alone(2, depth), {})
        found[f"1/2 mutual {depth}"] = Condition(_alone(2, depth, **reported), reach)
    for every in (10, 50, 200):
        found[f"1/2 averaging {every}"] = Condition(_alone(2, 4), {"average_every": every})
    found["1/2 one table"] = Condition(_alone(2, 4), {"one_table": True})
    for prey in (1, 2):
        found[f"{prey}/2 joint"] = Condition(_joint(prey), {}, JOINT)
        found[f"{prey}/2 joint passive"] = Condition(_joint(prey, awareness="pairwise"), {"partner": 4}, JOINT)
        found[f"{prey}/2 joint mutual"] = Condition(_joint(prey, **reported), {**reach, "partner": _EVERYWHERE}, JOINT)
    for depth in DEPTHS[:2]:
        plain, seen = joint_names(depth)
        found[plain] = Condition(_joint(2, depth), {}, SHORT)
        found[seen] = Condition(_joint(2, depth, awareness="pairwise"), {"partner": depth}, SHORT)
    return found


def joint_names(depth: int) -> tuple[str, str]:
    """Return the names of the conditions without and with sight of the partner at this depth."""
    suffix = "" if depth == DEPTHS[-1] else f", depth {depth}"
    return f"2/2 joint{suffix}", f"2/2 joint passive{suffix}"


#: The conditions by name: prey/hunters, and how they learn.
CONDITIONS: Mapping[str, Condition] = _conditions()


@dataclass(frozen=True)
class Trained(NamedConditions):
    """Runs that train and test hunters.

    Parameters
    ----------
    share : float
        Trials of training, as a share of each condition's own.
    tests : int
        Trials of each test.
    """

    tests: Count = 1000


@dataclass(frozen=True)
class Pursuits(Trained):
    """What to simulate.

    Parameters
    ----------
    readings : tuple of str
        How what Tan leaves open is read.
    """

    seed: Seed = root("pursuit")
    names: Annotated[tuple[Annotated[str, Allowed(choices=CONDITIONS)], ...], NAMES] = ()
    readings: Annotated[tuple[Annotated[str, Allowed(choices=READINGS)], ...], NAMES] = tuple(READINGS)
    known = CONDITIONS

    def planned(self) -> Iterator[Planned]:
        """Yield each run with the columns that identify it: reading, condition, replicate, seed and trials."""
        for name in self.readings:
            for condition in self.names:
                for columns, run in runs_of(self, condition, READINGS[name]):
                    yield {"reading": name, **columns}, run


def runs_of(plan: Trained, name: str, reading: Reading, *, both: bool = False) -> Iterator[Planned]:
    """Yield the runs of a condition under a reading: condition, replicate, seed and trials of each, and how to make it.

    Parameters
    ----------
    plan : Trained
        How many, how long, and from which seed.
    name : str
        The condition.
    reading : Reading
        The reading.
    both : bool
        Whether each is tested both ways, and not as it is read.
    """
    from teamsight.analysis.runs.run import Run
    from teamsight.tasks.pursuit import Pursuit

    condition, tests = CONDITIONS[name], plan.tests
    share = plan.share / 2 if condition.relevant(reading).short else plan.share
    trials = max(int(share * condition.trials), BLOCK)
    # Steps of a trial, roughly, from which the work of a run is estimated.
    steps = trials * (110 if condition.world["rule"] == "pair" else 40)
    # Ours was first reported when training could not end soon.
    soon, soft = both or reading != READINGS[OURS], None if both else reading.soft
    parameters, measure = condition.parameters(reading), Learning(trials, tests, soon, soft)
    for replicate in range(plan.runs):
        seed = run_seed(plan.seed, replicate)
        columns = {"condition": name, "replicate": replicate, "seed": seed, "trials": trials}
        yield columns, Run(parameters, seed, steps, measure, Pursuit)


@dataclass(frozen=True)
class Learning:
    """Measures a world of `Pursuit`: trains its hunters, and tests them.

    Parameters
    ----------
    trials, tests : int
        Trials of training, and of the test.
    soon : bool
        Whether training ends soon after its last trial, and not when as many steps are made as the first trials let
        expect, which can be twice as many.
    soft : bool, optional
        Whether hunters choose in the test as in training, and not greedily. By default they are tested both ways, and
        one that takes far longer than any of Tan's has an infinite mean.
    """

    trials: int
    tests: int
    soon: bool = True
    soft: bool | None = None

    def __call__(self, world: World, steps: int) -> dict[str, Any]:
        """Return the mean steps of a trial in each block of training, at its end, and in the test; or in both tests.

        Parameters
        ----------
        world : World
            A `Pursuit`.
        steps : int
            An estimate of the steps of the training.
        """
        from teamsight.policies.online.online_q import OnlineQ

        hunters: Any = cast("Any", world).hunters
        # Worlds refer to themselves, and few objects are made here: the long histories of former runs would stay.
        gc.collect()
        training = next_trials(world, self.trials, soon=self.soon)
        ways = {"test": False, "soft": True} if self.soft is None else {"test": self.soft}
        tests, learner = dict.fromkeys(ways, training[-SETTLED:]), hunters.policy
        if isinstance(learner, OnlineQ):
            tables = hunters.policy_state.floats.copy()
            for name, is_soft in ways.items():
                hunters.policy = learner.frozen(tables, learner.temperature if is_soft else 0.0)
                tests[name] = np.array([math.inf])
                with contextlib.nullcontext() if self.soft is not None else contextlib.suppress(EndlessError):
                    most = _MOST_STEPS if self.soft is not None else _LONGEST_TEST
                    tests[name] = next_trials(world, self.tests, most=most)
        whole = training[: len(training) // BLOCK * BLOCK].reshape(-1, BLOCK)
        return {
            "curve": whole.mean(axis=1).tolist(),
            "training": float(training[-SETTLED:].mean()),
            **{name: float(test.mean()) for name, test in tests.items()},
            "neighbours": int(world.max_neighbours),
        }


class EndlessError(ValueError):
    """Raised when trials do not end."""


def next_trials(world: World, count: int, *, soon: bool = False, most: int = _MOST_STEPS) -> Floats:
    """Run a world until `count` more trials have ended, and return their steps; if wished, not much longer.

    Raises
    ------
    EndlessError
        If they take more steps than `most`, by default than any team should need.
    """
    first, lengths = world.tick, np.zeros(0)
    while len(lengths) < count:
        missing = count - len(lengths)
        mean = lengths[-SETTLED if soon else 0 :].mean() if len(lengths) else 1.0
        if world.tick - first > most:
            raise EndlessError(
                f"trials={count}: only {len(lengths)} have ended after {most:,} steps; give a smaller share"
            )
        wanted = 1.05 * missing * (mean + 1.0)
        # Half of it as long as trials may still become shorter.
        steps = max(_LEAST, wanted / 2 if soon and wanted > _FAR else wanted)
        world.run(int(min(steps, most)), progress=False)
        history = world.recording.history.iloc[first:]
        lengths = np.asarray(history["trial_steps"].to_numpy()[history["captures"].to_numpy() > 0], float)
    return lengths[:count]


class Reported(NamedTuple):
    """A value of Tan: where it stands, condition, "training" or "test", steps, and half of his interval or NaN."""

    where: str
    condition: str
    phase: str
    steps: float
    half: float

    @property
    def may_be_off(self) -> float:
        """By how many steps it may have been read wrongly."""
        return READ_OFF if self.where.startswith("Fig") else 0.0

    def is_near(self, mean: float) -> bool:
        """Whether a mean is within `NEAR` of the value, or of one that may be meant."""
        return abs(mean - self.steps) - self.may_be_off <= NEAR * self.steps


def _reported() -> Iterator[Reported]:
    for line in VALUES.strip().splitlines():
        where, condition, *values = map(str.strip, line.split("|"))
        for phase, text in zip(("training", "test"), values, strict=False):
            if text:
                steps, half = ([float(one) for one in text.split("±")] + [math.nan])[:2]
                yield Reported(where, condition, phase, steps, half)


#: All values of Tan.
REPORTED = tuple(_reported())


def ledger(table: pd.DataFrame, reading: str = "") -> pd.DataFrame:
    """Return each value of Tan whose condition is in the table of runs beside ours under a reading.

    By default the reading is the first of the table.

    Returns
    -------
    DataFrame
        The fields of `Reported`; mean, half90, half95 (ours, over the runs); near (whether it agrees within 10 %);
        difference (ours minus his), low, high (its 95 % interval, longer by what may have been read wrongly); verdict:
        "agrees" if that interval contains 0 and reaches at most `WIDEST` of his value to either side, "undecided" if it
        contains 0 and is wider, "differs" if it does not contain 0.
    """
    import pandas as pd

    reading = reading or _readings(table)[0]
    table = rows_of(table, reading=reading)
    have, rows = set(table["condition"]), []
    for value in REPORTED:
        if value.condition in have:
            found = column(table, value.phase, condition=value.condition)
            mean, steps = float(found.mean()), value.steps
            half90, half95 = (interval_of(found, level).high - mean for level in (LEVEL, 0.95))
            wide = _half_width(found, value.condition, steps, value.half) + value.may_be_off
            low, high = mean - steps - wide, mean - steps + wide
            verdict = DIFFERS if low > 0.0 or high < 0.0 else AGREES if wide <= WIDEST * steps else UNDECIDED
            rows.append((*value, mean, half90, half95, value.is_near(mean), mean - steps, low, high, verdict))
    return pd.DataFrame(rows, columns=[*Reported._fields, *_FOUND])


def _half_width(found: Floats, condition: str, steps: float, half: float) -> float:
    """Return half the width of Welch's 95 % interval of the difference between our mean and a value of Tan.

    Half a 90 % interval is Student's t times the error. Random hunters were averaged over 200 trials, whose lengths are
    spread about as much as their mean. Where he gives no interval the error is unknown, and counted as 0.
    """
    from scipy.special import stdtrit

    error, freedom = 0.0, math.inf
    if not math.isnan(half):
        error, freedom = half / float(stdtrit(TAN_RUNS - 1, 0.5 + LEVEL / 2)), TAN_RUNS - 1
    elif "random" in condition:
        error, freedom = steps / math.sqrt(RANDOM_TRIALS), RANDOM_TRIALS - 1
    if len(found) < 2:
        return math.inf
    parts = np.array([found.std(ddof=1) / math.sqrt(len(found)), error]) ** 2
    total = float(parts.sum())
    spread = float(np.sum(np.where(parts > 0, parts**2 / np.array([len(found) - 1, freedom]), 0.0)))
    return float(stdtrit(total**2 / spread, 0.975)) * math.sqrt(total) if spread > 0 else 0.0


def curves_of(table: pd.DataFrame, name: str) -> Floats:
    """Return the learning curves of a condition, shape (runs, blocks)."""
    curves = rows_of(table, condition=name).sort_values("replicate")["curve"].tolist()
    return np.array([np.asarray(curve, float) for curve in curves])


def gains(table: pd.DataFrame, base: str, other: str) -> Floats:
    """Return how many steps a trial is shorter with `other` than with `base`, by run and block of trials."""
    one, two = curves_of(table, base), curves_of(table, other)
    blocks = min(one.shape[1], two.shape[1])
    return np.asarray(one[:, :blocks] - two[:, :blocks])


def crossing(gain: Floats) -> float:
    """Return the trial at which a smoothed gain becomes positive for good; infinite if it ends below 0."""
    smooth = np.convolve(gain, np.full(SMOOTH, 1.0 / SMOOTH), "valid")
    below = np.flatnonzero(smooth <= 0.0)
    if not len(below):
        return 0.0
    last = int(below[-1]) + 1
    return math.inf if last == len(smooth) else float(BLOCK * (last + SMOOTH // 2))


def crossings(table: pd.DataFrame) -> dict[int, Floats]:
    """Return for each depth the trial from which seeing the partner pays in each run.

    All depths are judged over the trials of the shortest training: the last of many noisy blocks below 0 comes later
    in a longer curve, even if nothing differs.
    """
    found = {depth: gains(table, *joint_names(depth)) for depth in DEPTHS}
    blocks = min(gain.shape[1] for gain in found.values())
    return {depth: np.array([crossing(one) for one in gain[:, :blocks]]) for depth, gain in found.items()}


def verdicts(table: pd.DataFrame, plan: Pursuits | None = None, reading: str = "") -> list[Verdict]:
    """Return the verdicts on all claims whose conditions are in the table, under a reading; by default the first."""
    table = rows_of(table, reading=reading or _readings(table)[0])
    have, found = set(table["condition"]), []
    for claim, source, worse, better, phase in ORDERS:
        if have >= {worse, better}:
            if phase == "early":
                said, saved = f"in the first {EARLY} trials {{}}", _means(gains(table, worse, better), 0, EARLY)
            else:
                said = f"{worse} − {better}: {{}}"
                saved = column(table, phase, condition=worse) - column(table, phase, condition=better)
            found.append(verdict_of(claim, source, interval_of(saved), "steps", said=said))
    for depth in DEPTHS:
        if have >= {*joint_names(depth)}:
            gain = gains(table, *joint_names(depth))
            early, late = (interval_of(one) for one in (-_means(gain, 0, EARLY), _means(gain, -LATE)))
            claim = f"Depth {depth}: the gain from seeing the partner is negative early and positive late"
            said = f"loss in the first {EARLY} trials {interval_text(early, 'steps')}; gain in the last {LATE} "
            found.append(Verdict(claim, "ours", said + interval_text(late, "steps"), _both(early, late)))
    if have.issuperset(name for depth in DEPTHS for name in joint_names(depth)):
        at = crossings(table)
        medians = {depth: float(np.median(one)) for depth, one in at.items()}
        said = "; ".join(
            f"d = {depth}: trial {f'{one:,.0f}' if math.isfinite(one) else 'none'}" for depth, one in medians.items()
        )
        verdict, more = UNDECIDED, "some runs do not cross"
        if all(np.isfinite(one).all() for one in at.values()):
            shifts = [interval_of(at[one] - at[other]) for one, other in ((3, 2), (4, 3))]
            verdict, more = _both(*shifts), "shifts " + " and ".join(interval_text(one, "trials") for one in shifts)
        claim = "The crossing moves right with d: a larger table pays later"
        found.append(Verdict(claim, "ours", f"{said}; {more}", verdict))
    if "2/2 joint" in have:
        most = column(table, "neighbours", condition="2/2 joint")
        claim = "Both hunters meet while they learn, so that the largest number of neighbours is N − 1 = 1"
        said = f"{(most == 1).sum()} of {len(most)} runs"
        found.append(Verdict(claim, "ours", said, HOLDS if (most == 1).all() else FAILS))
    return found


def _means(gain: Floats, first: int, last: int | None = None) -> Floats:
    """Return the mean gain of each run in some of its trials."""
    return np.asarray(gain[:, first // BLOCK : None if last is None else last // BLOCK].mean(axis=1))


def _both(*intervals: Interval) -> str:
    """Return whether all quantities are above 0, by their intervals."""
    each = set(map(above, intervals))
    return FAILS if FAILS in each else UNDECIDED if UNDECIDED in each else HOLDS


def draw(table: pd.DataFrame, plan: Pursuits) -> Canvas:
    """Return learning curves of joint hunters, and what seeing the partner is worth over time, for three depths."""
    table = rows_of(table, reading=_readings(table)[0])
    have, settled = set(table["condition"]), ledger(table)
    curves = {name: look for name, look in _CURVES.items() if name in have}
    takes = (f"{column(table, 'training', condition=name).mean():.0f} ({label})" for name, (label, _) in curves.items())
    figure, (left, right) = panels(
        f"Two trained hunters capture in {', '.join(takes) or 'unknown'} steps",
        f"two prey on a 10 × 10 grid; {plan.runs} runs of each; 95 % confidence bands; dashed: where Tan's settle; "
        f"seed {plan.seed}",
        ("depth 4", "what seeing the partner is worth"), x="trials", y=("steps of a trial", "steps saved in a trial"),
        size=(5.4, 3.9),
    )  # fmt: skip
    for name, (label, colour) in curves.items():
        _draw_band(left, curves_of(table, name), colour, label)
        for value in rows_of(settled, condition=name, phase="training")["steps"]:
            left.axhline(value, color=colour, linestyle="--", linewidth=1.0)
    left.set_ylim(bottom=0)
    right.axhline(0.0, color=FAINT, linewidth=1.0)
    for depth, colour in zip(DEPTHS, shades(3), strict=True):
        if have >= {*joint_names(depth)}:
            _draw_band(right, gains(table, *joint_names(depth))[:, : SHORT // BLOCK], colour, f"d = {depth}")
    for axes, where, columns in ((left, "upper right", 3), (right, "lower right", 1)):
        if axes.get_legend_handles_labels()[1]:
            axes.legend(frameon=False, loc=where, ncols=columns, fontsize=8)  # type: ignore[call-overload]
    return figure


def _draw_band(axes: Axes, curves: Floats, colour: str, label: str) -> None:
    """Draw the mean over runs with its interval, one point for some blocks."""
    points = max(curves.shape[1] // _POINT, 1)
    found = intervals(part.mean(axis=1) for part in np.array_split(curves, points, axis=1))
    draw_means(axes, BLOCK * (np.arange(points) + 0.5) * curves.shape[1] / points, found, colour, label)


def page_values(table: pd.DataFrame, plan: Pursuits) -> Mapping[str, Any]:
    """Return the values of the page."""
    *agreement, chance = sentences(table, plan)
    return {
        "settled": SETTLED, "values": len(ledger(table)), "rules": RULES, "agreement": " ".join(agreement),
        "chance": chance, "ledger": ledger_table(table),
    }  # fmt: skip


#: How agreement is counted.
RULES = (
    f"A value agrees within {100 * NEAR:g} % if ours differs from it by at most that share of it. By the interval rule "
    "it agrees if Welch's 95 % interval of the difference contains 0 and reaches at most "
    f"{100 * WIDEST:g} % of the value to either side, is undecided if it contains 0 and is wider, and differs "
    f"otherwise. Tan's random hunters are a mean over {RANDOM_TRIALS} trials; where he gives no interval only ours "
    f"counts. What is read off his figures may be wrong by {READ_OFF:g} steps: they are taken off a difference, and "
    "lengthen its interval to either side."
)


def ledger_table(table: pd.DataFrame) -> str:
    """Return all values of Tan beside ours, under each reading, as a table of Markdown."""
    found = {name: ledger(table, name) for name in _readings(table)}
    columns, rows = ["where", "prey/hunters", "phase", "Tan (90 %)"], []
    for name in found:
        columns += [f"{name} (95 %)", f"within {100 * NEAR:g} %", "interval rule"]
    for parts in zip(*(one.itertuples() for one in found.values()), strict=True):
        tan = parts[0]
        value = plus_minus(tan.steps, tan.steps + tan.half, ".2f")
        if tan.where.startswith("Fig"):
            value = f"{tan.steps:g} (± {READ_OFF:g} read)"
        cells = [tan.where, tan.condition, tan.phase, value]
        for part in parts:
            ours = plus_minus(part.mean, part.mean + part.half95, ".1f")
            cells += [ours, "yes" if part.near else "no", part.verdict]
        rows.append(cells)
    return markdown.table(columns, rows, align="lllr" + "rll" * len(found))


def _readings(table: pd.DataFrame) -> list[str]:
    return list(dict.fromkeys(table["reading"]))


def sentences(table: pd.DataFrame, plan: Pursuits) -> Sequence[str]:
    """Return how many values agree under each reading, and how many claims would hold by chance."""
    said = []
    for name in _readings(table):
        rows = ledger(table, name)
        agree, differ, left = ((rows["verdict"] == verdict).sum() for verdict in (AGREES, DIFFERS, UNDECIDED))
        judged = verdict_counts(verdicts(table, reading=name))
        said.append(
            f"Reading “{name}”: {rows['near'].sum()} of {len(rows)} values of Tan agree within {100 * NEAR:g} %; by "
            f"intervals {agree} agree, {differ} differ, {left} are undecided. {judged}"
        )
    claims = len(verdicts(table))
    return (
        *said,
        "Each claim is judged by its own 95 % interval: if nothing made a difference, at most one in 40 would hold by "
        f"chance, {claims / 40:.1f} of {claims}.",
    )


def _ledgers(table: pd.DataFrame, plan: Pursuits) -> pd.DataFrame:
    import pandas as pd

    return pd.concat([ledger(table, name).assign(reading=name) for name in _readings(table)], ignore_index=True)


PAPER = Paper(
    plan=Pursuits, name="pursuit", page="tasks/pursuit", template=_PAGE, figures={"pursuit": draw}, values=page_values,
    verdicts=verdicts, sentences=sentences, tables={"pursuit-ledger.parquet": _ledgers},
    quick={"runs": 3, "share": 0.05},
    small={"runs": 2, "share": 0.005, "tests": 20, "names": ("1/1 random", "2/2 joint", "2/2 joint passive")},
)  # fmt: skip
