"""Evolve the constants of a policy by CMA-ES, and compare them with the strongest A-CMOMMT.

The checkpoint of an evolution holds the fitness of every candidate, generation by generation. Candidates are not
stored, because with the same seed the strategy proposes the same ones: an interrupted evolution is replayed and then
continues with the same bits.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt
import pandas as pd

from teamsight import __version__
from teamsight.agents.awareness import Awareness, PairwiseAwareness, RingAwareness
from teamsight.agents.cmommt import DEFAULTS
from teamsight.analysis import ceilings
from teamsight.analysis.papers.reproduction import Paper, PaperPlan, filled
from teamsight.analysis.papers.training import Evolution
from teamsight.analysis.plot import markdown
from teamsight.analysis.plot.kinds import colour_bar, draw_heat_map, panels, texts_of
from teamsight.analysis.plot.style import DIVERGING, minus, signed
from teamsight.analysis.runs import files
from teamsight.analysis.runs.checkpoint import Checkpoint, code_digest
from teamsight.analysis.runs.executor import Executor
from teamsight.analysis.runs.grid import Grid
from teamsight.analysis.runs.limits import CellRuns
from teamsight.analysis.runs.run import Model, Run
from teamsight.analysis.runs.seeds import model_seed, root
from teamsight.analysis.runs.simulate import Progress, Watch, run_all
from teamsight.analysis.stats.paired import Interval, cell_means, grid_of, includes_zero, interval_of
from teamsight.analysis.stats.verdicts import interval_text, signed_text
from teamsight.core.extras import extra
from teamsight.policies.adaptive_forces import PARTS, AdaptiveForces, without
from teamsight.policies.constants import ConstantsPolicy
from teamsight.policies.evolved import SILENCED, Evolved, made, silenced
from teamsight.policies.group_forces import GroupForces
from teamsight.policies.handmade.a_cmommt import OCCASIONS, WEIGHTS, ACmommt
from teamsight.policies.handmade.forces import BEHAVIOURS
from teamsight.policies.handmade.random_walk import RandomWalk
from teamsight.policies.interface import Policy
from teamsight.policies.registry import POLICIES

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

    from teamsight.agents.world import World

Floats = npt.NDArray[np.float64]

#: The worlds on which the evolved policy is compared.
GRID = Grid((5, 10, 15, 20, 25, 30), tuple(float(radius) for radius in range(2, 10)))
#: Root seeds. Each purpose has its own, so that no result is reported on worlds that shaped it.
TRAIN, TRAIN_FURTHER, VALIDATE, SCREEN, TEST, GENERALISE, ADAPTIVE = (
    root(f"evolution: {part}")
    for part in ("train", "train further", "validate", "screen", "test", "generalise", "adaptive forces")
)
CEILING = root("ceilings")
TARGETS, STEPS, DELTA = 15, 600, 16
CONSTANTS, TRAINING = "constants.json", "training.json"
#: Options of A-CMOMMT of which all combinations are screened, and the values of others under the best of these.
RULES: Mapping[str, tuple[str, ...]] = {
    "idle": tuple(BEHAVIOURS), "idle_when": tuple(OCCASIONS), "weights": tuple(WEIGHTS),
}  # fmt: skip
TUNED: Mapping[str, tuple[float, ...]] = {
    "turn_probability": (0.0, 0.01, 0.02, 0.05),
    "gain": (0.5, 1.0, 2.0, 4.0, 8.0),
}
OPTIONS = [*RULES, *TUNED]
#: The values of `TUNED` when none is given.
USUAL = {name: getattr(ACmommt(), name) for name in TUNED}
#: Gain [percentage points] below which no cell's interval may lie as a whole.
WORST = -2.0
#: Gain of the adaptive forces that was aimed at [percentage points].
AIM = 2.2
# Combinations of rules under which the others are screened.
_FINALISTS = 3
# Largest team in training, in units of R². Larger teams observe nearly all targets whatever they do.
_CROWDED = 2.0
# Constants are saved and validated every so many generations.
_SAVE_EVERY = 100
_SCREEN_RUNS, _VALIDATE_RUNS, _CEILING_RUNS = 10, 5, 2
#: What the page calls the A-CMOMMT that was screened best.
STRONGEST = "a-cmommt, strongest"
_CEILINGS = "sharing", "clairvoyant"
#: What the page calls the adaptive forces before their search.
_BEGUN = "adaptive-forces before the search"
# Columns of a gain: a mean difference with its 95 % confidence interval [percentage points].
_GAIN = ("mean", "low", "high")
_PAGE = """
# The evolved policy

Like A-CMOMMT, `policy="evolved"` adds up forces. How they depend on distance was found by evolution. Each robot
remembers targets that it lost, teammates that it met, its trail, and the area that it has sensed, by odometry and a
compass. It perceives teammates only through a ring of 16 sectors, Θ(1).

Made by `teamsight evolve test --training evolution{further} --out docs`: {about[runs]} runs of {steps} steps in each
cell, paired on common noise. The root seed {test} was used for nothing else.

## Gain

Over R = 2..9 and N = 5..30 it observes **{overall} percentage points** more of the targets than A-CMOMMT under
pairwise awareness with its best options ({best}; the best of {combinations} combinations, screened with root seed
{screen}). The smallest gain is {smallest}, at N = {worst[robots]}, R = {worst[radius]:g}. Cells whose whole interval
is below {limit:g}: {below}.

{surface}

![Gain of the evolved policy over the strongest A-CMOMMT](images/evolved.png)

{ceiling}

## Training

`{made[command]}` made {made[trials]:,} trials of {worlds} worlds each, {robot_steps} robot-steps in all. Every
generation has new worlds (root seed {train}), none with more than 2 R² robots, where nearly all targets are observed
under any policy.

{training}

Generation 0 was written by hand: the forces of A-CMOMMT with smooth weights, a memory of the area, and straight
motion while idle.

{continued}

## Ablations

Gain when one part of the policy is set to 0, without training it again (root seed {validate}):

{ablations}

Differences smaller than these intervals are not significant.

## Other worlds

The policy was evolved for one speed, one number of targets and one range. Its gain over the same A-CMOMMT in other
worlds (root seed {generalise}; N = 5, 10, 20, 30; R = 4, 8), without training or screening again:

{generalisation}

## With a memory of rivals

`policy="adaptive-forces"` is [`group-forces`](imagined-worlds.md) with a memory: a target stays a teammate's for a
while after that is perceived no longer, a robot without targets goes after one that it lost, and with one target it
keeps moving. Each of these constants depends on how many targets and teammates the robot met lately, {size} in all.
`{about[adaptive][command]}` began with those of `group-forces` and made {about[adaptive][trials]:,} trials in the same
worlds as above.

The rule, set before the runs with root seed {adaptive_root}, which was used for nothing else: it ships if the interval
of its gain over `evolved` and that over `group-forces` are above 0. The aim was {aim:+g} over A-CMOMMT; it is
{reached}.

{adaptive}

What gained nothing on other seeds: a longer search, repulsion by remembered teammates, guesses of where they are now, a
force to the middle of the known ground, and a smaller or greater share of the targets for robots that have many.

Without a part, and without training again (root seed {validate}):

{removed}

## Options of A-CMOMMT

Observed targets [%] under A-CMOMMT with pairwise awareness, over the same grid (root seed {screen}). First all
combinations of its rules, with the default constants, {usual}:

{rules}

Then the constants, under the best {finalists} of these rules: the turn probability of robots that wander, and [the
gain of the force](model.md#where-this-departs-from-the-paper). The best combination is the baseline of this page,
{added:.1f} percentage points above the best rules with the default constants.

{tuned}
"""
# How far the policy goes towards what is possible.
_CEILING = """
## The way to what is possible

Over the same grid, with root seed {root}, it goes **{share:.0f} % of the way** from this A-CMOMMT to a clairvoyant
team: [ceilings](ceilings.md) are teams that know more than robots can, and what no team can pass.

{table}
"""
# The paragraphs on the validated generations of a training, and of one that began with its constants.
_TRAINING = """
Gain on other worlds (root seed {validate}), over the whole grid, over A-CMOMMT with {options}:

{points}
"""
_CONTINUED = """
`{made[command]}` began with these constants and made {made[trials]:,} trials in new worlds (root seed
{train_further}). Its gain on the worlds of root seed {validate}, over A-CMOMMT with {options}:

{points}

New constants ship only if, on these worlds, they gain more than the old ones by more than the interval.
"""


def cells_tried() -> list[tuple[int, float]]:
    """Return the worlds (robots, radius) in which every candidate is tried."""
    return [(robots, radius) for robots, radius in GRID.cells if robots <= _CROWDED * radius**2]


def robot_steps() -> int:
    """Return the robot-steps of one candidate's trial, its cost in samples."""
    return STEPS * sum(robots for robots, _ in cells_tried())


def kind_of(evolution: Evolution) -> type[ConstantsPolicy]:
    """Return the class of the policy whose constants are sought."""
    return cast("type[ConstantsPolicy]", POLICIES[evolution.policy])


def fitness(
    candidates: Sequence[ConstantsPolicy], generation: int, pool: Executor | None = None, *, root: int = TRAIN
) -> list[float]:
    """Return the observed fraction of each candidate, averaged over the worlds of a generation.

    Parameters
    ----------
    candidates : sequence of ConstantsPolicy
        The policies that are tried.
    generation : int
        Number of the generation, which determines the worlds. All its candidates get the same worlds.
    pool : Executor, optional
        Processes that do the work; by default this process.
    root : int
        Root seed of the worlds.
    """
    teams = [_ring(policy) for policy in candidates]
    runs = [_run(team, robots, radius, root, generation) for team in teams for robots, radius in cells_tried()]
    return [sum(observed) / len(observed) for observed in _observed(runs, len(teams), pool)]


def _observed(
    runs: Sequence[Run], rows: int, pool: Executor | None, progress: Progress = lambda done, total: None
) -> list[list[float]]:
    """Return the observed fractions of runs, in so many rows of equal length."""
    found = [outcome.observed_fraction for outcome in run_all(runs, pool, progress=progress)]
    return np.array(found).reshape(rows, -1).tolist()  # type: ignore[no-any-return]


def _ring(policy: ConstantsPolicy) -> dict[str, Any]:
    return {"policy": policy, "awareness": RingAwareness(DELTA)}


def _run(
    team: Mapping[str, Any], robots: int, radius: float, root: int, replicate: int, targets: int = TARGETS,
    model: Model | None = None,
) -> Run:  # fmt: skip
    scenario = {"robots": robots, "targets": targets, "radius": radius}
    return Run({**team, **scenario}, model_seed(root, replicate, robots, targets, radius), STEPS, model=model)


def evolve(
    evolution: Evolution, generations: int, checkpoint: Checkpoint, pool: Executor | None = None
) -> Iterator[Floats]:
    """Yield the constants found after each generation; those in the checkpoint are not tried again.

    Parameters
    ----------
    evolution : Evolution
        Its parameters.
    generations : int
        Number of generations in all.
    checkpoint : Checkpoint
        File of the fitness of all candidates; see `checkpoint_in`.
    pool : Executor, optional
        Processes that try the candidates; by default this process.

    Raises
    ------
    ModuleNotFoundError
        If the package cma is not installed.
    """
    cma = extra("cma", "evolution", "evolve")
    rng, kind = np.random.default_rng(evolution.seed), kind_of(evolution)
    options = {
        "popsize": evolution.population,
        "randn": lambda *shape: rng.standard_normal(shape),
        "seed": np.nan,
        "verbose": -9,
        "CMA_stds": kind.deviations(),
        # Do not stop: with noise, equal fitness does not mean convergence.
        "tolfun": 0, "tolfunhist": 0, "tolflatfitness": np.inf, "tolstagnation": np.inf, "tolx": 0,
    }  # fmt: skip
    strategy = cma.CMAEvolutionStrategy(begin(evolution), evolution.spread, options)
    worlds = f"cells={cells_tried()}, targets={TARGETS}, steps={STEPS}, delta={DELTA}"
    # All earlier generations follow from the same settings.
    common = "evolution", f"cma={cma.__version__}", str(evolution), worlds, code_digest(__name__)
    keys = [(*common, f"generation={number}") for number in range(generations)]
    finished = checkpoint.results(keys)
    for key in keys:
        candidates = strategy.ask()
        found = finished.get(key)
        if found is None:
            # An evolution that begins with the result of another has other worlds.
            worlds_of = TRAIN_FURTHER if evolution.start else TRAIN
            found = fitness([kind(tuple(one)) for one in candidates], strategy.countiter, pool, root=worlds_of)
            checkpoint.add({key: found})
        strategy.tell(candidates, [-value for value in found])
        yield np.array(strategy.mean, float)


def begin(evolution: Evolution) -> Floats:
    """Return the initial mean of the search distribution."""
    return np.array(evolution.start) if evolution.start else kind_of(evolution).beginning(evolution.seed)


def checkpoint_in(folder: Path) -> Checkpoint:
    """Return the generations that an evolution has left in a folder."""
    return Checkpoint(folder / "evolution.checkpoint")


def train(
    evolution: Evolution,
    generations: int,
    folder: Path,
    pool: Executor | None = None,
    watch: Watch = lambda phase, done, total: None,
    *,
    force: bool = False,
) -> None:
    """Evolve constants, validate them on other worlds, and write both to a folder.

    The folder receives ``constants.json``, ``training.json`` and ``evolution.checkpoint``. The latter stays: from it an
    interrupted call resumes, and one with more generations continues.

    Parameters
    ----------
    evolution : Evolution
        Its parameters.
    generations : int
        Number of generations in all.
    folder : Path
        An existing folder.
    pool : Executor, optional
        Processes that do the work; by default this process.
    watch : callable
        Called with the phase, the work done and the work in all.
    force : bool
        Replace files that teamsight did not write, and those of other evolutions.

    Raises
    ------
    ModuleNotFoundError
        If the package cma is not installed.
    ValueError
        If a file in `folder` belongs to another evolution, or must not be replaced.
    """
    settings, kind = asdict(evolution), kind_of(evolution)
    for name in (CONSTANTS, TRAINING):
        files.check_replaceable(folder / name, settings, force=force)
    checkpoint = checkpoint_in(folder)
    checkpoint.check()
    policies = {"0": kind(tuple(begin(evolution)))}
    further = f" --start {CONSTANTS}" if evolution.start else ""
    if evolution.spread != Evolution.spread:
        further += f" --spread {evolution.spread:g}"
    chosen = f" --policy {evolution.policy}" if evolution.policy != Evolution.policy else ""
    marked = {"software": "teamsight", "settings": settings}
    for number, mean in enumerate(evolve(evolution, generations, checkpoint, pool), 1):
        watch("evolving", number, generations)
        if number % _SAVE_EVERY == 0 or number == generations:
            policies[str(number)] = kind(tuple(mean))
            about = {
                "command": f"teamsight evolve train{chosen} --generations {number} --population {evolution.population} "
                f"--seed {evolution.seed}{further}",
                "trials": evolution.population * number,
                "robot_steps": evolution.population * number * robot_steps(),
                "version": __version__,
            }
            files.write_json(folder / CONSTANTS, marked | policies[str(number)].content(about), force=force)
    options = options_of(screen(_SCREEN_RUNS, pool, partial(watch, "screening")))[0]
    table = compare(
        policies, options, pool, root=VALIDATE, runs=_VALIDATE_RUNS, progress=partial(watch, "validating")
    )
    points = [
        {"generation": int(row["name"]), "robot_steps": int(row["name"]) * evolution.population * robot_steps()}
        | {name: row[name] for name in _GAIN}
        for row in gains_by(table, "policy").to_dict("records")
    ]
    files.write_json(folder / TRAINING, marked | {"options": options, "points": points}, force=force)


@dataclass(frozen=True)
class Comparison(PaperPlan):
    """Which constants are compared with the strongest A-CMOMMT, on worlds that shaped neither.

    Parameters
    ----------
    constants : Path, optional
        A file that `train` wrote; by default the constants that ship with the package.
    training : Path, optional
        The folder of `train`, whose validated generations the page shows.
    further : Path, optional
        The folder of an evolution that began with the constants, for the same purpose.
    runs : int
        Runs of each cell.
    """

    constants: Path | None = None
    training: Path | None = None
    further: Path | None = None
    runs: CellRuns = 30

    def conditions(self) -> dict[str, Any]:
        """Return the number of runs, what made the constants and those of a further evolution, and their rivals.

        Raises
        ------
        ValueError
            If a file holds no constants or no validated generations.
        """
        return {
            "runs": self.runs, "made": made(self.constants) if self.constants else made(),
            "trained": _validated(self.training)[1], "continued": _validated(self.further)[1],
            "further": made(self.further / CONSTANTS) if self.further else None, "adaptive": made(AdaptiveForces.file),
        }  # fmt: skip


def find(plan: Comparison, pool: Executor | None, watch: Watch, checkpoint: Checkpoint | None = None) -> pd.DataFrame:
    """Return the table of ``evolved.parquet``; the column `part` says what a row is about."""
    policy = Evolved.load(plan.constants) if plan.constants else Evolved()
    screened = screen(_SCREEN_RUNS, pool, partial(watch, "screening"))
    against = partial(compare, options=options_of(screened)[0], pool=pool)
    on_grid = against({"evolved": policy}, root=TEST, runs=plan.runs, progress=partial(watch, "comparing"))
    ablated = {name: Evolved(tuple(silenced(np.array(policy.constants), name))) for name in SILENCED}
    ablations = against(
        {"none": policy, **ablated}, root=VALIDATE, runs=_VALIDATE_RUNS, progress=partial(watch, "ablating")
    )
    possible = ceilings.compare(
        [(robots, TARGETS, radius) for robots, radius in GRID.cells],
        {
            STRONGEST: {"policy": ACmommt(**options_of(screened)[0]), "awareness": PairwiseAwareness()},
            "evolved": _ring(policy), **{name: {"policy": name} for name in _CEILINGS},
        },
        runs=min(plan.runs, _CEILING_RUNS), steps=STEPS, seed=CEILING, pool=pool,
        progress=partial(watch, "planning"),
    )  # fmt: skip
    elsewhere = against(
        {"evolved": policy}, root=GENERALISE, runs=plan.runs, variations=VARIATIONS,
        progress=partial(watch, "generalising"),
    )  # fmt: skip
    parts = {
        "screen": screened,
        "cell": by_cell(on_grid),
        "overall": gains_by(on_grid, "policy")[[*_GAIN]],
        "ceiling": by_ceiling(possible),
        "ablation": gains_by(ablations, "policy")[["name", *_GAIN]],
        "generalisation": gains_by(elsewhere, "variation"),
        **of_adaptive_forces(policy, against, plan.runs, watch),
        "training": pd.DataFrame(_validated(plan.training)[0]),
        "further": pd.DataFrame(_validated(plan.further)[0]),
    }
    table = pd.concat([rows.assign(part=part) for part, rows in parts.items()], ignore_index=True)
    table.attrs.update(plan.conditions())
    return table


def of_adaptive_forces(
    policy: Evolved, against: Callable[..., pd.DataFrame], runs: int, watch: Watch
) -> dict[str, pd.DataFrame]:
    """Return the gains of the adaptive forces and of others, and those without parts; see `compare` for `against`."""
    whole = AdaptiveForces()
    begun = AdaptiveForces(tuple(AdaptiveForces.beginning(0)))
    teams = {"evolved": policy, "group-forces": GroupForces(), _BEGUN: begun, "adaptive-forces": whole}
    rest = {f"without {name}": AdaptiveForces(without(whole.constants, name)) for name in PARTS}
    found = against(teams, root=ADAPTIVE, runs=runs, progress=partial(watch, "comparing others"))
    parts, ablating = {"adaptive-forces": whole, **rest}, partial(watch, "ablating others")
    removed = against(parts, root=VALIDATE, runs=_VALIDATE_RUNS, progress=ablating)
    return {
        "adaptive": by_policy(found, ("evolved", "group-forces")), "removed": by_policy(removed, ("adaptive-forces",))
    }  # fmt: skip


def by_policy(table: pd.DataFrame, others: Sequence[str]) -> pd.DataFrame:
    """Return the gain of each policy over A-CMOMMT, and over other policies of the table [percentage points].

    Returns
    -------
    DataFrame
        As `gains_by`, with columns "mean over", "low over" and "high over" each other policy.
    """
    found = gains_by(table, "policy")
    gains = table.pivot_table(index="replicate", columns="policy", values="difference", sort=False)
    for other in others:
        over = [interval_of(100.0 * (gains[name] - gains[other]).to_numpy()) for name in found["name"]]
        for part, values in zip(_GAIN, zip(*over, strict=True), strict=True):
            found[f"{part} over {other}"] = values
    return found


def by_ceiling(table: pd.DataFrame) -> pd.DataFrame:
    """Return what teams and ceilings observe over the grid [%], and their share of the way to a clairvoyant team."""
    found = ceilings.standings(table, overall=True)
    names = ("share", "share_low", "share_high")
    return pd.DataFrame([
        {"name": one.team, **one.observed._asdict(), **dict(zip(names, one.share, strict=True))} for one in found
    ])  # fmt: skip


def _validated(folder: Path | None) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """Return the validated generations of a training, and the options of A-CMOMMT with which they were compared."""
    if folder is None:
        return [], {}
    file = folder / TRAINING
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        names = ("generation", "robot_steps", *_GAIN)
        # What is no number cannot be added to 0.
        points = [{name: point[name] + 0 for name in names} for point in content["points"]]
        return points, {name: content["options"][name] for name in OPTIONS}
    except (ValueError, TypeError, KeyError):
        raise ValueError(
            f"{file}: holds no validated generations; make it again with `teamsight evolve train`"
        ) from None


def screen(runs: int, pool: Executor | None = None, progress: Progress = lambda done, total: None) -> pd.DataFrame:
    """Return what A-CMOMMT observes over the grid with combinations of its options, the best first.

    First all `RULES` are screened with the default constants, then all of `TUNED` under the best rules.

    Parameters
    ----------
    runs : int
        Runs of each cell.
    pool : Executor, optional
        Processes that do the work; by default this process.
    progress : callable
        Called with the work done and the work in all.

    Returns
    -------
    DataFrame
        Columns `OPTIONS`, observed [%].
    """
    how = runs, pool, progress
    first = _screen_all([one | USUAL for one in _combinations(RULES)], *how)
    tuned = [
        best | one
        for best in options_of(first)[:_FINALISTS]
        for one in _combinations(TUNED)
        # A robot that does not wander has no turn probability.
        if one != USUAL and (best["idle"] == "wander" or one["turn_probability"] == USUAL["turn_probability"])
    ]
    table = pd.concat([first, _screen_all(tuned, *how)])
    return table.sort_values("observed", ascending=False, ignore_index=True, kind="stable")


def options_of(screened: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the options of A-CMOMMT in each row of a table."""
    return [{str(name): value for name, value in row.items()} for row in screened[OPTIONS].to_dict("records")]


def _combinations(values: Mapping[str, tuple[Any, ...]]) -> list[dict[str, Any]]:
    return [dict(zip(values, one, strict=True)) for one in product(*values.values())]


def _screen_all(
    options: Sequence[Mapping[str, Any]], runs: int, pool: Executor | None, progress: Progress
) -> pd.DataFrame:
    """Return what A-CMOMMT observes over the grid with each of some options, the best first."""
    planned = [
        _run({"policy": ACmommt(**one), "awareness": PairwiseAwareness()}, robots, radius, SCREEN, replicate)
        for one in options
        for robots, radius in GRID.cells
        for replicate in range(runs)
    ]
    fractions = np.array(_observed(planned, len(options), pool, progress))
    table = pd.DataFrame(options, columns=OPTIONS).assign(observed=100.0 * fractions.mean(axis=1))
    return table.sort_values("observed", ascending=False, ignore_index=True, kind="stable")


def boxed(*, ratio: float, robots: int, targets: int, radius: float, policy: Policy, awareness: Awareness,
          rng: int) -> World:  # fmt: skip
    """Return the world of `CMOMMT` with its defaults, but in a box.

    Parameters
    ----------
    ratio : float
        Length of the box over its width.
    robots, targets : int
        Numbers of agents.
    radius : float
        Radius of the disc whose area the box has [length].
    policy, awareness
        Those of the robots.
    rng : int
        Seed of the world.
    """
    from teamsight.agents.body import Robot, Target
    from teamsight.agents.world import World
    from teamsight.world.arena import Box

    width = radius * math.sqrt(math.pi / ratio)
    world = World(Box(ratio * width, width), rng=rng)
    team = world.add(Robot, robots, policy=policy, awareness=awareness, speed=DEFAULTS["robot_speed"])
    prey = world.add(Target, targets, policy=RandomWalk(turn_probability=0.05), speed=DEFAULTS["target_speed"])
    world.senses(team, prey)
    return world


class Variation(NamedTuple):
    """Worlds that differ in one respect from those in which the policy was evolved.

    Attributes
    ----------
    name : str
        What is different.
    settings : mapping
        Parameters of the model.
    cells : tuple of (int, float)
        Team sizes and radii.
    targets : int
        Number of targets.
    model : callable, optional
        See `Run`.
    """

    name: str
    settings: Mapping[str, Any] = {}
    cells: tuple[tuple[int, float], ...] = tuple(product((5, 10, 20, 30), (4.0, 8.0)))
    targets: int = TARGETS
    model: Model | None = None


#: What is varied. The first row is for comparison.
VARIATIONS = (
    Variation("nothing"),
    Variation("robots and targets half as fast", {"robot_speed": 0.05, "target_speed": 0.0375}),
    Variation("robots and targets twice as fast", {"robot_speed": 0.2, "target_speed": 0.15}),
    Variation("targets half as fast as robots", {"target_speed": 0.05}),
    Variation("targets as fast as robots", {"target_speed": 0.1}),
    Variation("each target with its own speed", {"uniform_target_speed": True}),
    Variation("5 targets", targets=5),
    Variation("40 targets", targets=40),
    Variation("evasive targets", {"target_policy": "evasive"}),
    Variation("square of the disc's area", {"ratio": 1.0}, model=boxed),
    Variation("box 4:1 of the disc's area", {"ratio": 4.0}, model=boxed),
    Variation("sensing range halved", {"sensing_range": 0.5}),
    Variation("sensing range doubled", {"sensing_range": 2.0}),
    Variation("awareness range halved", {"awareness_range": 0.5}),
    Variation("awareness range doubled", {"awareness_range": 2.0}),
    Variation("R = 12", cells=tuple((robots, 12.0) for robots in (10, 20, 30))),
    Variation("R = 16", cells=tuple((robots, 16.0) for robots in (10, 20, 30))),
    Variation("N = 1", cells=((1, 4.0), (1, 8.0))),
    Variation("N = 2", cells=((2, 4.0), (2, 8.0))),
    Variation("N = 3", cells=((3, 4.0), (3, 8.0))),
    Variation("N = 60", cells=((60, 4.0), (60, 8.0))),
)


def compare(
    policies: Mapping[str, ConstantsPolicy],
    options: Mapping[str, Any],
    pool: Executor | None = None,
    *,
    root: int,
    runs: int,
    variations: Iterable[Variation] | None = None,
    progress: Progress = lambda done, total: None,
) -> pd.DataFrame:
    """Return the runs of policies under ring awareness, paired with those of A-CMOMMT under pairwise awareness.

    Parameters
    ----------
    policies : mapping of str to ConstantsPolicy
        The policies by name.
    options : mapping
        Options of A-CMOMMT.
    pool : Executor, optional
        Processes that do the work; by default this process.
    root : int
        Root seed.
    runs : int
        Runs of each cell.
    variations : iterable of Variation, optional
        The worlds; by default those of `GRID`.
    progress : callable
        Called with the work done and the work in all.

    Returns
    -------
    DataFrame
        Columns policy, variation, robots, radius, replicate, base (what A-CMOMMT observes) and difference.
    """
    rivals = [_ring(policy) for policy in policies.values()]
    rivals.append({"policy": ACmommt(**options), "awareness": PairwiseAwareness()})
    worlds = [
        (one, robots, radius, replicate)
        for one in ([Variation("", cells=GRID.cells)] if variations is None else variations)
        for robots, radius in one.cells
        for replicate in range(runs)
    ]
    planned = [
        _run({**one.settings, **rival}, robots, radius, root, replicate, one.targets, one.model)
        for one, robots, radius, replicate in worlds
        for rival in rivals
    ]
    found = _observed(planned, len(worlds), pool, progress)
    rows = [
        (name, world.name, *place, base, one - base)
        for (world, *place), (*observed, base) in zip(worlds, found, strict=True)
        for name, one in zip(policies, observed, strict=True)
    ]
    return pd.DataFrame(rows, columns=["policy", "variation", "robots", "radius", "replicate", "base", "difference"])


def gains_by(table: pd.DataFrame, by: str) -> pd.DataFrame:
    """Return the mean difference for each value of a column, with an interval over replicates.

    Returns
    -------
    DataFrame
        Columns name, observed (by A-CMOMMT) [%], and mean, low, high of the gain [percentage points].
    """
    rows = []
    for name, found in table.groupby(by, sort=False):
        gain = interval_of(100.0 * found.groupby("replicate")["difference"].mean().to_numpy())
        rows.append({"name": name, "observed": 100.0 * float(found["base"].mean()), **gain._asdict()})
    return pd.DataFrame(rows)


def by_cell(table: pd.DataFrame) -> pd.DataFrame:
    """Return mean and 95 % interval of each cell [percentage points]."""
    cells = cell_means(table, "difference")
    return cells.assign(**{name: 100.0 * cells[name] for name in ("mean", "se", "low", "high")})


def page_values(table: pd.DataFrame, plan: Comparison | None = None) -> dict[str, Any]:
    """Return the values of the page.

    Parameters
    ----------
    table : DataFrame
        From `find`; its attributes are the conditions of the comparison.
    plan : Comparison, optional
        Not read: the page of the documentation is that of a table which was made before.
    """
    about = table.attrs
    parts = {str(name): rows for name, rows in table.groupby("part")}
    cells, screened, made, further = _cells_of(table), parts["screen"], about["made"], about["further"]
    worst, seeds = cells.sort_values("mean").iloc[0], {"train_further": TRAIN_FURTHER, "validate": VALIDATE}
    rules, tuned, added = _screened(screened)
    validated = {
        part: filled(
            template, made=of, options=_options(about[options]), points=_points(parts[part]), **seeds
        ).strip()
        for part, template, options, of in (
            ("training", _TRAINING, "trained", made), ("further", _CONTINUED, "continued", further)
        )
        if part in parts
    }  # fmt: skip
    return {
        "about": about, "made": made, "worst": worst, "added": added, "rules": rules, "tuned": tuned, "steps": STEPS,
        "limit": WORST, "test": TEST, "screen": SCREEN, "train": TRAIN, "generalise": GENERALISE,
        "finalists": _FINALISTS, "further": " --further further" if further else "",
        "overall": _gain(parts["overall"].iloc[0]), "best": _options(screened.iloc[0]), "combinations": len(screened),
        "smallest": _gain(worst), "below": (cells["high"] < WORST).sum() or "none", "surface": _surface(cells),
        "worlds": len(cells_tried()), "robot_steps": _billions(made["robot_steps"]),
        "ceiling": _ceiling(parts["ceiling"]) if "ceiling" in parts else "",
        "size": len(AdaptiveForces.shipped()), "adaptive_root": ADAPTIVE, "aim": AIM,
        "adaptive": _over(parts["adaptive"], ("evolved", "group-forces")),
        "reached": "reached" if parts["adaptive"]["mean"].iloc[-1] >= AIM else "not reached",
        "removed": _over(parts["removed"], ("adaptive-forces",)),
        "training": validated.get("training", ""), "continued": validated.get("further", ""),
        "ablations": _table(["removed"], parts["ablation"], lambda row: [row["name"]]),
        "generalisation": _table(
            ["what is different", "A-CMOMMT observes [%]"], parts["generalisation"],
            lambda row: [row["name"], f"{row['observed']:.1f}"],
        ),
        "usual": " and ".join(f"`{name}={value:g}`" for name, value in USUAL.items()), **seeds,
    }  # fmt: skip


def _cells_of(table: pd.DataFrame) -> pd.DataFrame:
    # The column has no value in the rows of other parts, which makes it one of floats.
    return table[table["part"] == "cell"].astype({"robots": int})


def _gain(row: Any) -> str:
    return interval_text(Interval(*(row[name] for name in _GAIN)), digits=2)


def _billions(robot_steps: float) -> str:
    return f"{robot_steps / 1e9:.1f} × 10⁹"


def _ceiling(found: pd.DataFrame) -> str:
    rows = (
        [row["name"], f"{row['mean']:.1f} ({row['low']:.1f} to {row['high']:.1f})",
         ceilings.share_text(Interval(row["share"], row["share_low"], row["share_high"]))]
        for _, row in found.iterrows()
    )
    table = markdown.table(["team", "observed [%], 95 % interval", "of the way"], rows)
    return _CEILING.format(root=CEILING, share=_share(found), table=table).strip()


def _share(ceiling: pd.DataFrame) -> float:
    """Return how much of the way to a clairvoyant team the evolved policy goes [%]."""
    return 100.0 * float(ceiling.loc[ceiling["name"] == "evolved", "share"].item())


def _options(options: Mapping[str, Any] | pd.Series[Any]) -> str:
    shown = {name: f"{options[name]:g}" if name in TUNED else repr(options[name]) for name in OPTIONS}
    return ", ".join(f"`{name}={value}`" for name, value in shown.items())


def _surface(cells: pd.DataFrame) -> str:
    grid = grid_of(cells)
    rows = ([str(robots), *map(signed_text, row)] for robots, row in grid.iterrows())
    return markdown.table(["N", *(f"R = {radius:g}" for radius in grid.columns)], rows)


def _table(columns: list[str], rows: pd.DataFrame, of: Callable[[Any], list[str]]) -> str:
    """Return a table of gains, with the columns that `of` returns for a row before them."""
    cells = ([*of(row), _gain(row)] for _, row in rows.iterrows())
    return markdown.table([*columns, "gain, 95 % interval [pp]"], cells)


def _over(rows: pd.DataFrame, others: Sequence[str]) -> str:
    """Return the table of gains over A-CMOMMT and over other policies."""

    def cell(row: Any, of: str) -> str:
        return interval_text(Interval(*(row[f"{name}{of}"] for name in _GAIN)), digits=2)

    columns = ["policy", "gain over A-CMOMMT [pp]", *(f"more than `{other}`" for other in others)]
    cells = (
        [row["name"], cell(row, ""), *("" if row["name"] == other else cell(row, f" over {other}") for other in others)]
        for _, row in rows.iterrows()
    )
    return markdown.table(columns, cells)


def _points(points: pd.DataFrame) -> str:
    """Return a table of validated generations."""
    ordered = points.sort_values("generation")
    return _table(
        ["generation", "robot-steps"], ordered, lambda row: [f"{row['generation']:.0f}", _billions(row["robot_steps"])]
    )


def _screened(screened: pd.DataFrame) -> tuple[str, str, float]:
    """Return tables of the rules with the usual constants and of the constants, and what the best of them add."""
    rules = list(RULES)
    first = screened[(screened[list(TUNED)] == list(USUAL.values())).all(axis=1)]
    by_rule = markdown.table(
        [*rules, "observed [%]"], ([*row[rules], f"{row['observed']:.2f}"] for _, row in first.iterrows())
    )
    tuned = screened.merge(first[rules].head(_FINALISTS))
    grid = tuned.pivot(index=[*rules, "turn_probability"], columns="gain", values="observed")
    rows = (
        [*row[:3], f"{row[3]:g}", *(f"{value:.2f}" for value in row[4:])]
        for row in grid.reset_index().itertuples(index=False, name=None)
    )
    by_gain = markdown.table([*rules, "turn_probability", *(f"gain {gain:g}" for gain in grid.columns)], rows)
    return by_rule, by_gain, screened["observed"].iloc[0] - first["observed"].iloc[0]


def draw(table: pd.DataFrame, plan: Comparison | None = None) -> Canvas:
    """Return the gain over team size and radius; for the parameters see `page_values`."""
    import matplotlib
    from matplotlib.colors import CenteredNorm

    cells, ceiling = _cells_of(table), table[table["part"] == "ceiling"]
    about = [
        f"Θ(1), ring of 16, minus the strongest A-CMOMMT, Θ(N), paired on common noise, mean of {table.attrs['runs']} "
        f"runs of {STEPS} steps, seed {minus(str(TEST))}; in brackets: the 95 % interval includes 0"
    ]
    if len(ceiling):
        about.append(f"{_share(ceiling):.0f} % of the way from that A-CMOMMT to a team that knows all the future")
    figure, (axes,) = panels(
        f"The evolved policy observes {_gain(table[table['part'] == 'overall'].iloc[0])} points more than A-CMOMMT",
        about, ("",), size=(8.0, 5.2), is_plain=False,
    )  # fmt: skip
    grid = grid_of(cells)
    norm, colours = CenteredNorm(0.0, np.ceil(cells["mean"].abs().max())), matplotlib.colormaps[DIVERGING]
    draw_heat_map(axes, grid, texts_of(grid, signed, includes_zero(cells)), norm, colours)
    colour_bar(figure, matplotlib.cm.ScalarMappable(norm, colours), [axes], "gain in observed targets  [points]")
    return figure


@dataclass(frozen=True, kw_only=True)
class _ComparisonPaper(Paper[Comparison, pd.DataFrame]):
    def about(self, plan: Comparison) -> dict[str, Any]:
        return plan.conditions()


#: The comparison, as what it makes.
COMPARISON = _ComparisonPaper(
    plan=Comparison, name="evolved", page="evolved", template=_PAGE, values=page_values,
    figures={"images/evolved": draw}, make=find,
)  # fmt: skip
