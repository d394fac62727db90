"""The benchmark of CMOMMT: fixed scenarios on fixed seeds, the teams that are entered, and what each observes.

Its results are one JSON file, which ships beside this module. It holds for each team and scenario the number of targets
that were observed in each run, summed over its steps: whole numbers, which anybody can make again to the last bit.
"""

from __future__ import annotations

import json
import math
import os
import re
import time
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness import RelayedAwareness
from teamsight.agents.cmommt import CMOMMT
from teamsight.agents.components.failures import Failures
from teamsight.agents.components.unreliable_awareness import UnreliableAwareness
from teamsight.agents.resolve import awareness_of, policy_of
from teamsight.agents.sensing.sensor import Sensor
from teamsight.analysis.ceilings import CEILING, PLANNERS, SETTINGS, PlannedRun, measure, planned
from teamsight.analysis.learning.explore import Exploration, explore
from teamsight.analysis.papers.reproduction import filled
from teamsight.analysis.plot import markdown
from teamsight.analysis.plot.kinds import colour_bar, colour_cells, panels, places, write_numbers
from teamsight.analysis.plot.style import DIVERGING, minus, superscript, to_picture
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.seeds import model_seed, root
from teamsight.analysis.runs.simulate import Planned, Progress, run_rows
from teamsight.analysis.stats.paired import Interval, interval_of
from teamsight.analysis.stats.verdicts import plus_minus
from teamsight.core import checks
from teamsight.core.version import __version__
from teamsight.policies import AdaptiveForces, GroupForces, evolved
from teamsight.policies.compiled import decides_in_kernel
from teamsight.policies.interface import Policy
from teamsight.policies.lazy.lazy_regression import LazyRegression

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

    from teamsight.agents.awareness import Awareness
    from teamsight.analysis.runs.executor import Executor
    from teamsight.analysis.runs.files import Content

Floats = npt.NDArray[np.float64]

#: The name of the benchmark and its version. Scenarios, seeds and steps of a version never change.
BENCHMARK = "cmommt-1"
#: The results that ship.
REFERENCE = Path(__file__).resolve().with_suffix(".json")
ROOT, EXPLORED = root("benchmark: report"), root("benchmark: explore")
STEPS = 600
#: Runs of a team in each scenario, and of a quick look.
RUNS, QUICK = 50, 10
#: The team at which the way to the ceiling begins, and the bound that no team passes.
FLOOR, BOUND = "random-walk", "teleport"

#: The settings of all scenarios, where they declare no others.
COMMON: Mapping[str, Any] = {
    "robots": 10, "targets": 15, "radius": 5.0, "sensing_range": 1.0, "awareness_range": 1.0, "robot_speed": 0.1,
    "target_speed": 0.075, "uniform_target_speed": False, "target_policy": "random-walk",
}  # fmt: skip


class Scenario(NamedTuple):
    """One scenario.

    Attributes
    ----------
    about : str
        What is different.
    settings : mapping of str to object
        Settings of `CMOMMT`, beside `COMMON`.
    hops : int
        Over how many hops teams that perceive each teammate hear reports; 0 for their own degree of awareness.
    """

    about: str
    settings: Mapping[str, Any]
    hops: int = 0

    @property
    def values(self) -> dict[str, Any]:
        """All settings."""
        return {**COMMON, **self.settings}

    @property
    def is_planned(self) -> bool:
        """Whether the planners know all that it sets."""
        return not self.hops and self.settings.keys() <= {*SETTINGS}

    @property
    def is_base(self) -> bool:
        """Whether it sets nothing but the numbers of robots and the radius."""
        return not self.hops and self.settings.keys() == {"robots", "radius"}


_THIRD = 2.0 * math.pi / 3.0
#: All scenarios by name. Those that set neither robots nor radius are variations of n10-r5.
SCENARIOS: Mapping[str, Scenario] = {
    **{
        f"n{robots}-r{radius}": Scenario(
            f"N = {robots}, R = {radius}", {"robots": robots, "radius": float(radius)}
        )
        for robots in (5, 10, 20) for radius in (3, 5, 8)
    },
    "targets-5": Scenario("5 targets", {"targets": 5}),
    "targets-40": Scenario("40 targets", {"targets": 40}),
    "fast-targets": Scenario("targets as fast as robots", {"target_speed": 0.1}),
    "own-speeds": Scenario("each target its own speed, from 0 on", {"uniform_target_speed": True}),
    "evasive": Scenario("targets flee from robots", {"target_policy": "evasive"}),
    "view-120": Scenario("targets are sensed 120° wide, ahead", {"sensor": Sensor(field_of_view=_THIRD)}),
    "noise": Scenario(
        "noise of 0.1 in distance and bearing, 10 % missed, 5 % false detections",
        {"sensor": Sensor(range_noise=0.1, bearing_noise=0.1, missed=0.1, false_positives=0.05)},
    ),
    "failures": Scenario("a robot works 200 ticks, then fails for 50, on average", {"events": Failures(200.0, 50.0)}),
    "late": Scenario(
        "what is known of teammates is 5 ticks old, and 20 % is missing",
        {"events": UnreliableAwareness(delay=5, missing=0.2)},
    ),
    "hops": Scenario(
        "awareness range 0.5; reports go over two hops, for degrees that show each teammate",
        {"awareness_range": 0.5}, hops=2,
    ),
    "cycle-5": Scenario("robots decide every 5 ticks", {"cycle": 5.0}),
    "differential": Scenario("robots on two wheels, 0.1 apart", {"drive": "differential"}),
    "bodies": Scenario(
        "robots of radius 0.1 and targets of 0.05 are in each other's way",
        {"robot_radius": 0.1, "target_radius": 0.05, "contact": "slide"},
    ),
}  # fmt: skip


@dataclass(frozen=True)
class Entrant:
    """A team that is entered.

    Parameters
    ----------
    policy : str, Policy or callable
        Its policy, as for `CMOMMT`, or the name of a planner.
    awareness : str or Awareness
        Its degree of awareness; planners have none.
    options : mapping of str to object
        Options of a policy by name.
    learned : int
        The number of transitions from which it learns before each run; 0 for a policy that is given.
    transitions : float
        Transitions, robot-steps in all, from which it was learned or evolved; None if nobody says.
    most : int
        The most runs in a scenario: planners take seconds for each.
    about : str
        What it is.
    """

    policy: Any
    awareness: Any = "none"
    options: Mapping[str, Any] = field(default_factory=dict)
    learned: int = 0
    transitions: float | None = 0.0
    most: int = RUNS
    about: str = ""

    @property
    def is_planner(self) -> bool:
        """Whether a central planner steers it, which knows more than robots can."""
        return isinstance(self.policy, str) and self.policy in PLANNERS

    def enters(self, scenario: Scenario) -> bool:
        """Return whether it can be entered in a scenario."""
        return scenario.is_planned or not self.is_planner

    def parameters(self, scenario: Scenario) -> dict[str, Any]:
        """Return the parameters of its worlds in a scenario; of one that learns without a policy."""
        settings = scenario.values
        if self.is_planner:
            return {**{name: settings[name] for name in SETTINGS}, "policy": self.policy}
        degree = awareness_of(self.awareness)
        if self.learned:
            return {**settings, "awareness": degree}
        policy = policy_of(self.policy, self.options)
        # A rule for one robot declares nothing.
        is_bound = isinstance(policy, Policy) and (policy.degree is not None or policy.inputs > 0)
        if scenario.hops and degree.shows_teammates and not is_bound:
            degree = RelayedAwareness(scenario.hops)
        return {**settings, "policy": policy, "awareness": degree}

    def planned(self, scenario: Scenario, replicates: Iterable[int]) -> Iterator[tuple[int, Run]]:
        """Yield the runs in a scenario with their replicates: of equal replicates all teams get the same world."""
        given = self.parameters(scenario)
        for replicate in replicates:
            seed = model_seed(ROOT, replicate, given["robots"], given["targets"], given["radius"])
            run: Run
            if self.is_planner:
                run = PlannedRun({**given, "horizon": STEPS}, seed, STEPS, observe, planned)
            elif self.learned:
                about = {"exploration": replicate, "transitions": self.learned}
                run = Run({**given, **about}, seed, STEPS, observe, learned_world)
            else:
                run = Run(given, seed, STEPS, observe)
            yield replicate, run


@cache
def _learned(exploration: int, transitions: int) -> LazyRegression:
    """Return what is learned from one exploration of its own, each the paper's in as many worlds as needed."""
    once = Exploration(seed=model_seed(EXPLORED, exploration, 5, 10, 3.0))
    worlds = -(-transitions // once.transitions)
    memory = explore(Exploration(seed=once.seed, runs=worlds))
    with warnings.catch_warnings():
        # That few transitions may not be enough for a slope is what is measured.
        warnings.simplefilter("ignore", UserWarning)
        made = LazyRegression(memory.sample(transitions, seed=exploration))
    # All that it has learned is a small table; the transitions of all explorations would fill the memory.
    object.__setattr__(made, "memory", memory.sample(1, seed=0))
    return made


def learned_world(exploration: int, transitions: int, rng: int | None = None, **settings: Any) -> CMOMMT:
    """Return a world of robots that have learned from so many transitions of the exploration of this number."""
    return CMOMMT(policy=_learned(exploration, transitions), rng=rng, **settings)


_FOLLOW = "teamsight.policies.handmade.follow_free:FollowFree"
#: All teams that are entered, by name. A further one is a further line.
ENTRANTS: Mapping[str, Entrant] = {
    FLOOR: Entrant(FLOOR, about="a new direction at each step: the floor"),
    "straight": Entrant(FLOOR, options={"turn_probability": 0.05}, about="a random walk with 5 % turns, as targets"),
    "stationary": Entrant("stationary", about="robots spread over the arena, which stay"),
    "centroid": Entrant("centroid", about="to the centre of the targets in sight"),
    "follow-free, unaware": Entrant(
        _FOLLOW, options={"exponent": 64.0, "teammates": 0}, about="designed law f = d⁶⁴, all targets free"
    ),
    "a-cmommt": Entrant("a-cmommt", "pairwise", about="Parker's policy, defaults"),
    "a-cmommt, strongest": Entrant(
        "a-cmommt", "pairwise", {"idle": "wander", "weights": "shared", "turn_probability": 0.0, "gain": 4.0},
        about="the best of 81 options",
    ),
    "b-cmommt": Entrant("b-cmommt", "shared", about="requests for help, defaults"),
    "b-cmommt, strongest": Entrant(
        "b-cmommt", "shared",
        {"idle": "wander", "turn_probability": 0.0, "escape": 0.6, "answer": 0.0, "dr1": 0.0, "dr2": 0.0},
        about="the best of 73 options, which never helps",
    ),
    "p-cmommt": Entrant("p-cmommt", "shared", about="evenness over targets, defaults"),
    "p-cmommt, strongest": Entrant(
        "p-cmommt", "shared",
        {"idle": "wander", "turn_probability": 0.0, "weights": "shared", "evenness": 0.1, "gain": 8.0},
        about="the best of 49 options, nearly A-CMOMMT",
    ),
    "follow-free": Entrant(_FOLLOW, "ring", about="designed law f = d, free targets only"),
    "learned-600": Entrant(
        "", "ring", learned=600, transitions=600.0, about="regression, from 600 transitions of its own in each run"
    ),
    "learned-100000": Entrant(
        "", "ring", learned=100_000, transitions=1e5, about="the same from 100,000"
    ),
    "evolved": Entrant("evolved", "ring", transitions=evolved.made()["robot_steps"], about="constants by CMA-ES"),
    "ppo": Entrant("ppo", "ring", transitions=2e6, about="a network trained by PPO with 5 robots, 10 targets"),
    "ppo-many-teams": Entrant(
        "ppo", "ring", {"file": "many-teams"}, transitions=1e9, about="the same network, trained with seven teams"
    ),
    "group-forces": Entrant(
        "group-forces", "ring", transitions=9600.0,
        about="25 constants, sought in worlds imagined from 9,600 transitions",
    ),
    # Written by `python benchmarks/imagined.py --guess FILE`.
    "group-forces, guessed": Entrant(
        "group-forces", "ring", {"constants": GroupForces.load(GroupForces.file.with_name("guessed.json")).constants},
        about="its control: the same search in worlds of a guess, without transitions",
    ),
    "adaptive-forces": Entrant(
        "adaptive-forces", "ring", transitions=evolved.made(AdaptiveForces.file)["robot_steps"],
        about="87 constants by CMA-ES, with a memory of rivals",
    ),
    "sharing": Entrant("sharing", most=4, about="planner: knows what some robot senses or sensed"),
    "informed": Entrant("informed", most=4, about="planner: knows where all targets are"),
    CEILING: Entrant(CEILING, most=4, about="planner: knows where all targets will be"),
}  # fmt: skip


def counts(entrants: Mapping[str, Entrant], runs: int, **how: Any) -> dict[str, dict[str, list[int]]]:
    """Run teams in all scenarios that they enter.

    Parameters
    ----------
    entrants : mapping of str to Entrant
        The teams by name.
    runs : int
        The number of runs in each scenario; of a team at most its `most`.
    **how
        pool, checkpoint and progress, as for `run_rows`.

    Returns
    -------
    mapping of str to mapping of str to list of int
        By team and scenario, for each run the number of observed targets, summed over steps. `BOUND` is a team too.
    """
    listed: list[Planned] = []
    for name, entrant in entrants.items():
        for title, scenario in SCENARIOS.items():
            if entrant.enters(scenario):
                replicates = range(min(runs, entrant.most))
                listed += [({"team": name, "scenario": title}, run) for _, run in entrant.planned(scenario, replicates)]
    found: dict[str, dict[str, list[int]]] = {}
    for row in run_rows(listed, **how).to_dict("records"):
        for team, column in ((row["team"], "observed"), *([(BOUND, "bound")] if row["team"] == CEILING else [])):
            found.setdefault(team, {}).setdefault(row["scenario"], []).append(int(row[column]))
    return found


def observe(world: Any, steps: int) -> dict[str, int]:
    """Run a world, and return the number of observed targets summed over steps; see `counts`."""
    found = measure(world, steps)
    shares = {"observed": found.observed_fraction, "bound": found.teleport}
    return {
        name: round(share * steps * len(world.targets)) for name, share in shares.items() if not math.isnan(share)
    }


#: The scenario in which CPU time is measured.
TIMED = "n10-r5"
# The most rounds, of so many steps each; for teams that take longer than so many seconds one is enough.
_ROUNDS, _TIMED_STEPS, _LONG = 7, 200, 1.0


def cpu_time(entrant: Entrant) -> float:
    """Return the CPU time of a robot's step on this machine [µs], the least of several rounds.

    It contains perception, decision, motion and the search for neighbours: that of stationary robots is the price of
    the world.
    """
    best, given = math.inf, entrant.parameters(SCENARIOS[TIMED])
    world: CMOMMT
    for seed in range(_ROUNDS):
        if entrant.is_planner:
            world = planned(horizon=_TIMED_STEPS, rng=seed, **given)
        elif entrant.learned:
            world = learned_world(0, entrant.learned, seed, **given)
        else:
            world = CMOMMT(**given, rng=seed)
        with warnings.catch_warnings():
            # That a policy is Python is no news.
            warnings.simplefilter("ignore", UserWarning)
            # Kernels are compiled before, and a planner begins.
            world.run(1)
            began = time.process_time()
            world.run(_TIMED_STEPS - 1)
        taken = time.process_time() - began
        best = min(best, taken / (_TIMED_STEPS - 1))
        if taken > _LONG:
            break
    return float(f"{1e6 * best / int(given['robots']):.3g}")


def degree_of(entrant: Entrant) -> Awareness | None:
    """Return the degree of awareness of a team; None of one that a planner steers."""
    return None if entrant.is_planner else awareness_of(entrant.awareness)


def entry(entrant: Entrant, observed: Mapping[str, Sequence[int]], cpu: float | None) -> dict[str, Any]:
    """Return what the file says of a team: what it is, and what it observed."""
    degree = degree_of(entrant)
    policy = entrant.policy if isinstance(entrant.policy, str) else _named(entrant.policy)
    sizes = sorted({one.values["robots"] for one in SCENARIOS.values()})
    return {
        "about": entrant.about,
        "policy": policy or "LazyRegression",
        "options": dict(entrant.options),
        "awareness": degree and repr(degree),
        "order": degree and degree.order,
        "inputs": degree and {str(size): sum(degree.width(size)) for size in sizes},
        "transitions": entrant.transitions,
        "cpu_us_per_decision": cpu,
        "observed": {title: list(part) for title, part in observed.items()},
    }


def _named(policy: Any) -> str:
    return str(getattr(policy, "__qualname__", repr(policy)))


def definition() -> dict[str, Any]:
    """Return what the file says of the benchmark itself: all that decides which worlds are run."""

    def plain(value: Any) -> Any:
        return value if isinstance(value, (bool, int, float, str)) else repr(value)

    scenarios = {
        name: {"about": one.about, **{setting: plain(value) for setting, value in one.values.items()}}
        | ({"hops": one.hops} if one.hops else {})
        for name, one in SCENARIOS.items()
    }
    return {"benchmark": BENCHMARK, "root": ROOT, "steps": STEPS, "scenarios": scenarios}


def base_names(is_base: bool = True) -> list[str]:
    """Return the names of the scenarios that differ in N and R alone, or of all others."""
    return [name for name, one in SCENARIOS.items() if one.is_base is is_base]


_CITE = (
    f"teamsight {__version__}, benchmark {BENCHMARK}, analysis/benchmark.json; give the name and the version of the "
    "benchmark with each number"
)


def _check_team(team: Mapping[str, Any]) -> None:
    """Refuse what is no entry of a team."""
    for name in ("about", "order", "inputs", "transitions", "cpu_us_per_decision"):
        _ = team[name]
    for title, observed in team["observed"].items():
        most = STEPS * SCENARIOS[title].values["targets"]
        if not observed or not all(type(number) is int and 0 <= number <= most for number in observed):
            raise ValueError(f"{title}: needs whole numbers from 0 to {most}")


class Standing(NamedTuple):
    """How a team stands; all in % of the targets.

    Attributes
    ----------
    rank : int
        1 for the team that observes most over all scenarios; 0 for one that does not enter all.
    team : str
        Its name.
    score : Interval or None
        The mean over all scenarios, each with the same weight; None where it does not enter all.
    base, varied : Interval or None
        The means over the scenarios that differ in N and R alone, and over the others.
    less : Interval or None
        The score of the team that it is compared with, less this one, in the same worlds.
    way : Interval
        The share of the way from `FLOOR` to `CEILING`, over the scenarios and runs that a planner has.
    """

    rank: int
    team: str
    score: Interval | None
    base: Interval | None
    varied: Interval | None
    less: Interval | None
    way: Interval


@dataclass(frozen=True)
class Results:
    """The results of teams.

    Parameters
    ----------
    teams : mapping of str to mapping
        The entry of each team, by name; see `entry`.
    """

    teams: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    @classmethod
    def read(cls, path: str | os.PathLike[str] = REFERENCE) -> Results:
        """Return the results in a file; by default those that ship.

        Raises
        ------
        ValueError
            If it is no such file, or one of another version of the benchmark.
        """
        shown = f"reference={os.fspath(path)}"
        cure = "give a benchmark.json that teamsight wrote, or leave it out"
        try:
            content = json.loads(Path(path).read_text(encoding="utf-8"))
            version, teams = content["benchmark"], content["teams"]
        except (OSError, ValueError, KeyError, TypeError) as error:
            why = " ".join(f"{type(error).__name__}: {error}".split())
            raise ValueError(f"{shown}: holds no results of the benchmark ({why}); {cure}") from None
        made = content.get("teamsight")
        if version != BENCHMARK:
            raise ValueError(
                f"{shown}: is of the benchmark {version!r}, made by teamsight {made}, and this version has "
                f"{BENCHMARK!r}; install that version, or {cure}"
            )
        for name, value in json.loads(json.dumps(definition())).items():
            if content.get(name) != value:
                raise ValueError(f"{shown}: its {name} are not those of {BENCHMARK!r}; {cure}")
        try:
            name = COMPARED
            for name in (COMPARED, *teams):
                _check_team(teams[name])
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            why = " ".join(f"{type(error).__name__}: {error}".split())
            raise ValueError(f"{shown}: its team {checks.shown(name)} is damaged ({why}); {cure}") from None
        return cls(teams)

    def content(self) -> bytes:
        """Return the file."""
        whole = {
            "software": "teamsight", "teamsight": __version__, "cite": _CITE, **definition(),
            "seeds": "teamsight.analysis.runs.seeds.model_seed(root, replicate, robots, targets, radius)",
            "observed": "of each team, scenario and replicate: observed targets, summed over steps",
            "teams": dict(self.teams),
        }  # fmt: skip
        text = json.dumps(whole, indent=1, ensure_ascii=False, allow_nan=False)
        # The numbers of a scenario on one line.
        return (re.sub(r"\[[\d\s,]+\]", lambda found: " ".join(found[0].split()), text) + "\n").encode()

    def joined(self, other: Results) -> Results:
        """Return these results and others, which count where both have a team; those that ship stand first."""
        found = {**self.teams, **other.teams}
        return Results({name: found[name] for name in (*ENTRANTS, BOUND, *found) if name in found})

    def percent(self, team: str, scenarios: Iterable[str] = SCENARIOS, runs: int | None = None) -> Floats | None:
        """Return what a team observes [%], shape (scenarios, runs); None if it does not enter all."""
        observed, names = self.teams[team]["observed"], list(scenarios)
        if any(name not in observed for name in names):
            return None
        count = min(len(observed[name]) for name in names)
        shares = [
            np.array(observed[name][: min(count, runs or count)]) * (100.0 / STEPS / SCENARIOS[name].values["targets"])
            for name in names
        ]
        return np.array(shares)

    def mean(self, team: str, scenarios: Iterable[str]) -> Interval | None:
        """Return the mean over scenarios [%], with its interval over runs."""
        found = self.percent(team, scenarios)
        return None if found is None else interval_of(found.mean(axis=0))

    def difference(self, team: str, other: str, scenarios: Iterable[str] = SCENARIOS) -> Interval | None:
        """Return by how much a team observes more than another, in the same worlds [percentage points]."""
        found, against = (self.percent(one, scenarios) for one in (team, other))
        if found is None or against is None:
            return None
        runs = min(found.shape[1], against.shape[1])
        return interval_of((found[:, :runs] - against[:, :runs]).mean(axis=0))

    def way(self, team: str, scenarios: Iterable[str] | None = None) -> Interval:
        """Return the share of the way from `FLOOR` to `CEILING` [%]; NaN where either is missing.

        The interval is Student's, of the runs, to first order in the ratio of the means.
        """
        names = [name for name in scenarios or SCENARIOS if SCENARIOS[name].is_planned]
        found = [self.percent(one, names) if one in self.teams and names else None for one in (FLOOR, CEILING, team)]
        known = [one for one in found if one is not None]
        if len(known) < len(found):
            return Interval(math.nan, math.nan, math.nan)
        runs = min(one.shape[1] for one in known)
        floor, ceiling, own = (one[:, :runs].mean(axis=0) for one in known)
        share = (own - floor).mean() / (ceiling - floor).mean()
        return interval_of(100.0 * (share + (own - floor - share * (ceiling - floor)) / (ceiling - floor).mean()))

    def standings(self, against: str | None = None) -> list[Standing]:
        """Return how all teams stand: those that enter all scenarios by what they observe, then the others.

        Parameters
        ----------
        against : str, optional
            The team with which all are compared, and whose place their differences decide.
        """
        found = [
            Standing(
                0, team, self.mean(team, SCENARIOS), self.mean(team, base_names()), self.mean(team, base_names(False)),
                self.difference(against, team) if against and against != team else None, self.way(team),
            )
            for team in self.teams
        ]  # fmt: skip
        ranked = sorted((one for one in found if one.score), key=lambda one: -one.score.mean if one.score else 0.0)
        if own := next((one for one in ranked if one.team == against), None):
            # Its place is that of the differences: a team with fewer runs has met other worlds than the means are of.
            ranked.remove(own)
            ranked.insert(sum(one.less is not None and one.less.mean <= 0.0 for one in ranked), own)
        listed = [one._replace(rank=rank) for rank, one in enumerate(ranked, 1)]
        return listed + [one for one in found if one.score is None]


def run(
    entrants: Mapping[str, Entrant],
    runs: int = RUNS,
    *,
    pool: Executor | None = None,
    checkpoint: Checkpoint | None = None,
    progress: Progress = lambda done, total: None,
    timed: bool = True,
) -> Results:
    """Run teams, and return their results.

    Parameters
    ----------
    entrants : mapping of str to Entrant
        The teams by name.
    runs : int
        The number of runs in each scenario, from the first replicate on; of a team at most its `most`.
    pool, checkpoint, progress
        As for `run_rows`.
    timed : bool
        Whether to measure the CPU time of a decision.

    Raises
    ------
    TypeError, ValueError
        If a policy is none, or does not fit its degree of awareness in one of the scenarios.
    """
    for name, entrant in entrants.items():
        check(name, entrant)
    observed = counts(entrants, runs, pool=pool, checkpoint=checkpoint, progress=progress)
    teams = {
        name: entry(entrant, observed[name], cpu_time(entrant) if timed else None) for name, entrant in entrants.items()
    }
    if BOUND in observed:
        teams[BOUND] = {**entry(Entrant(CEILING, about=_BOUND), observed[BOUND], None), "policy": None}
    return Results(teams)


_BOUND = "proven bound: as many discs as robots, anywhere at once"


def check(name: str, entrant: Entrant) -> None:
    """Refuse a team that some scenario would refuse, before anything is run.

    Raises
    ------
    TypeError, ValueError
        Naming the scenario.
    """
    if entrant.is_planner or entrant.learned:
        return
    for title, scenario in SCENARIOS.items():
        try:
            CMOMMT(**entrant.parameters(scenario), rng=0).close()
        except (TypeError, ValueError) as error:
            raise type(error)(f"{error} (scenario {title!r} of {BENCHMARK})") from error


def outdated(results: Results) -> dict[str, Entrant]:
    """Return the declared teams that results lack, or declare otherwise."""
    kept = "cpu_us_per_decision", "observed", "about"

    def declared(one: Mapping[str, Any]) -> Any:
        return json.loads(json.dumps({name: value for name, value in one.items() if name not in kept}))

    return {
        name: entrant
        for name, entrant in ENTRANTS.items()
        if name not in results.teams or declared(results.teams[name]) != declared(entry(entrant, {}, None))
    }


def is_compiled(entrant: Entrant) -> bool:
    """Return whether a team decides without Python."""
    return bool(entrant.learned) or decides_in_kernel(policy_of(entrant.policy, entrant.options))


def agent_steps(runs: int) -> float:
    """Return the agents × steps of so many runs of one team in each scenario."""
    return float(runs * STEPS * sum(one.values["robots"] + one.values["targets"] for one in SCENARIOS.values()))


#: The team with which the figure and the page compare all others.
COMPARED = "a-cmommt, strongest"
_PAGE, _FIGURE, _JSON = "reference-results.md", "images/reference-results.png", REFERENCE.name
#: The files of results.
FILES = (_JSON, _PAGE, _FIGURE)


def checkpoint(folder: Path) -> Checkpoint:
    """Return the runs that an interrupted command left in a folder."""
    return Checkpoint(folder / "benchmark.checkpoint")


def contents(results: Results) -> dict[str, Content]:
    """Return all files of results: the numbers, the page and its figure."""
    return {_JSON: results.content(), _PAGE: page(results), _FIGURE: to_picture(draw(results))}


def draw(results: Results) -> Canvas:
    """Return the figure: by how much each team observes more than `COMPARED`, in each scenario."""
    import matplotlib
    from matplotlib.colors import CenteredNorm

    teams = [one.team for one in results.standings()][::-1]
    rows = [[results.difference(team, COMPARED, [title]) for title in SCENARIOS] for team in teams]
    grid = np.array([[math.nan if one is None else one.mean for one in row] for row in rows])
    ranked = [one for one in results.standings() if one.rank]
    figure, (axes,) = panels(
        f"{ranked[0].team} observes most: {ranked[0].score.mean:.1f} % on the mean of all scenarios",  # type: ignore[union-attr]
        f"Observed targets less those of {COMPARED}, in the same worlds [percentage points]; mean of {RUNS} runs, of "
        "planners fewer. In brackets: the 95 % interval includes 0. Empty: the planners do not know a setting",
        ("",), size=(11.5, 0.3 * len(teams) + 1.2), is_plain=False,
    )  # fmt: skip
    norm, colours = CenteredNorm(0.0, 30.0), matplotlib.colormaps[DIVERGING].resampled(11).with_extremes(bad="white")
    inks = colour_cells(axes, np.ma.masked_invalid(grid), norm, colours)
    for (x, y), one, ink in zip(zip(*places(grid.shape), strict=True), chain(*rows), inks, strict=True):
        if one is not None:
            text = f"{one.mean:+.0f}" if one.low > 0 or one.high < 0 else f"({one.mean:+.0f})"
            write_numbers(axes, np.array([x]), np.array([y]), [minus(text)], [ink])
    axes.set_xticks(range(len(SCENARIOS)), list(SCENARIOS), rotation=40, ha="right", fontsize=9)
    axes.set_yticks(range(len(teams)), teams, fontsize=9)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    colour_bar(figure, matplotlib.cm.ScalarMappable(norm, colours), [axes], "difference  [percentage points]")
    return figure


def page(results: Results) -> str:
    """Return the page."""

    def half(one: Interval | None) -> str:
        return "" if one is None or not math.isfinite(one.mean) else plus_minus(one.mean, one.high, ".1f", ".1f")

    listed = results.standings(COMPARED)
    standing = []
    for one in listed:
        team = results.teams[one.team]
        more = one.less and Interval(-one.less.mean, -one.less.high, -one.less.low)
        cpu = team["cpu_us_per_decision"]
        standing.append([
            str(one.rank or ""), f"`{one.team}`", team["about"], team["order"] or "",
            str(team["inputs"]["10"]) if team["inputs"] else "", _count(team["transitions"]), half(one.score),
            minus(plus_minus(more.mean, more.high, "+.1f", ".1f")) if more else "", way_text(one.way),
            "" if cpu is None else f"{cpu:.3g}",
        ])  # fmt: skip
    titles = (
        "", "team", "what it is", "awareness", "inputs", "transitions", "observed [%]", f"more than {COMPARED} [pp]",
        "way [%]", "µs",
    )  # fmt: skip
    tables = {"standing": markdown.table(titles, standing, align="rlllrrrrrr")}
    for part, names in (("base", base_names()), ("varied", base_names(False))):
        rows = []
        for one in listed:
            means = [results.mean(one.team, [name]) for name in names]
            rows.append([f"`{one.team}`", *("" if mean is None else f"{mean.mean:.1f}" for mean in means)])
        tables[part] = markdown.table(("team", *names), rows, align="l" + "r" * len(names))
    tables["varied_scenarios"] = "\n".join(f"- `{name}`: {SCENARIOS[name].about}" for name in base_names(False))
    widest = max(
        mean.high - mean.mean
        for one in listed if one.rank for name in SCENARIOS if (mean := results.mean(one.team, [name])) is not None
    )  # fmt: skip
    values = {"common": _in_words(), "widest": f"{widest:.1f}", "example": _EXAMPLE, **tables}
    return filled(_TEMPLATE, **values, **_findings(results))


def way_text(way: Interval) -> str:
    """Return a share of the way in percent, with half of its interval; nothing if it is not known."""
    if not math.isfinite(way.mean):
        return ""
    # The ends of the way are where they are in all runs.
    is_spread = math.isfinite(way.high) and way.high > way.mean
    return minus(plus_minus(way.mean, way.high, ".0f", ".0f") if is_spread else f"{way.mean:.0f}")


def _findings(results: Results) -> dict[str, str]:
    """Return the numbers of what the page says was found, and the table of what was tried."""

    def more(team: str, other: str, scenarios: Iterable[str] = SCENARIOS) -> str:
        found = results.difference(team, other, scenarios)
        return "unknown" if found is None else minus(plus_minus(found.mean, found.high, "+.1f", ".1f"))

    law, base = "follow-free", base_names()
    tried = [
        ("learning from 600 transitions what the law says", "`follow-free`", more("learned-600", law)),
        ("100,000 transitions in place of 600", "`learned-600`", more("learned-100000", "learned-600")),
        ("evolved constants where robots decide every 5 ticks", "`follow-free`", more("evolved", law, ["cycle-5"])),
        ("B-CMOMMT with its best options, which never help", f"`{COMPARED}`", more("b-cmommt, strongest", COMPARED)),
        ("P-CMOMMT with its best options, hardly even", f"`{COMPARED}`", more("p-cmommt, strongest", COMPARED)),
        (
            "going straight on when idle, not turning on the spot, in a 120° view", "`a-cmommt`",
            more(COMPARED, "a-cmommt", ["view-120"]),
        ),
    ]
    return {
        "evolved_base": more("evolved", law, base),
        "search": more("group-forces", law), "adaptive": more("adaptive-forces", law),
        "guess": more("group-forces", "group-forces, guessed"),
        "ppo": more("ppo", "a-cmommt", base), "ppo_varied": more("ppo", "a-cmommt", base_names(False)),
        "billion": more("ppo-many-teams", "ppo"),
        "evolved_way": f"{way_text(results.way('evolved'))} %", "law_way": f"{way_text(results.way(law))} %",
        "weak": more("informed", CEILING, ["own-speeds"]),
        "unaware": more(law, "follow-free, unaware"),
        "tried": markdown.table(("tried", "compared with", "difference [pp]"), tried, align="llr"),
    }  # fmt: skip


def _count(transitions: float | None) -> str:
    if transitions is None:
        return ""
    if not transitions:
        return "0"
    power = int(math.log10(transitions))
    return f"{transitions:,.0f}" if power < 6 else f"{transitions / 10**power:.1f} × 10{superscript(str(power))}"


def _in_words() -> str:
    return ", ".join(f"`{name}={value}`" for name, value in COMMON.items())


_FEW = ", ".join(f"`{name}` {one.most}" for name, one in ENTRANTS.items() if one.most < RUNS)
_EXAMPLE = "```sh\nteamsight benchmark --policy examples/enter.py:Chase --awareness none\n```"
_TEMPLATE = f"""
# Reference results for CMOMMT

What do known policies observe, in worlds that anybody can make again? `teamsight benchmark` shows it.

## Enter your policy

{{example}}

takes less than a minute for a policy with a kernel; `--quick` makes a fifth of the runs. `--policy` takes a name,
`module:Class` or `file.py:Class`, and `--policy.gain 4` sets an option of it. Only your policy runs: the results of the
others ship with the package, [benchmark.json](../analysis/benchmark.json), and since all meet the same worlds,
differences are paired. `--out FOLDER` writes this page, its figure and the JSON with your team in it.

## Rules

Committed before the runs, but for what µs are.

- **Scenarios.** N × R, and variations of N = 10, R = 5; {{common}}, if the scenario says nothing else. A run
has {STEPS} steps, a scenario {RUNS} runs; of planners fewer, {_FEW} (8 were
planned, and cut for time).
- **Seeds** come from the root {minus(str(ROOT))}, which served no other purpose: no shipped policy was trained or
tuned on these worlds.
- **Score.** Observed targets in %, equally weighted mean of all scenarios. A team is better than another if the 95 %
interval of their paired difference excludes 0.
- **Way.** The share of the way from the random walk to the [clairvoyant planner](ceilings.md), over the scenarios and
runs that planners have. They show what is possible at least; `teleport` is a proven bound, at every 20th tick.
- **Inputs** are those that the degree of awareness gives a robot in a team of 10, whether the policy reads them or not.
- **Learned teams** learn anew for each run, from an exploration of its own (root {minus(str(EXPLORED))}), so that
intervals contain the spread of explorations.
- **Hops.** In `hops` degrees that show each teammate hear reports over two hops; rings cannot.
- **CPU time** of a robot's step in n10-r5, with perception, decision and motion, on one machine; not reproducible.
`clairvoyant` plans before.
- A version, here `{BENCHMARK}`, never changes its scenarios, seeds and steps. Teams may be added, and planners improve.
- `b-cmommt` and `p-cmommt` are our reading of papers that we do not have ([what is known of them](relatives.md)).

Cite `{BENCHMARK}` and the version of teamsight.

## Standings

Means with half of their 95 % interval.

{{standing}}

![Differences to the strongest A-CMOMMT in each scenario](images/reference-results.png)

## By scenario

Observed targets [%]; no half interval of a ranked team is wider than {{widest}} points.

{{base}}

{{varied}}

{{varied_scenarios}}

## What was found

- **A law of one line is hard to beat.** `follow-free` makes full steps along the sum of the forces f = d of free
targets. `group-forces`, with 25 constants from a search in [imagined worlds](imagined-worlds.md), observes {{search}}
points more, but {{guess}} than its control, the same search without transitions: the gain is the search's (one search
each). [`adaptive-forces`](evolved.md), sought in true worlds: {{adaptive}}. Over N × R alone `evolved`
{{evolved_base}}.
- **`ppo`** observes {{ppo}} points more than A-CMOMMT's defaults over N × R, {{ppo_varied}} elsewhere; 500
times the steps add {{billion}}.
- **Awareness is worth {{unaware}} points** to the law, over the best unaware one.
- **There is room.** `follow-free` goes {{law_way}} of the way to the clairvoyant team, `evolved` {{evolved_way}}. In
own-speeds `informed` observes {{weak}} points more than it: plans are not optimal.

What failed:

{{tried}}

## What it does not say

- Worlds are discs with one kind of target, without obstacles. Robots know where they are going and
sense exactly, but in `view-120`, `noise` and `late`.
- Scenarios weigh equally, and nine of {len(SCENARIOS)} differ in N and R alone.
- Options of the teams were chosen for N × R without variations; `strongest` means strongest there: of A-CMOMMT those of
[the evolved policy's page](evolved.md), of the others those of `python benchmarks/cmommt_options.py`.
"""
