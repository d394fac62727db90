"""The settings of explorations, evaluations, curves and diagnoses. Nothing slow is imported: commands show them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from teamsight.agents.awareness.registry import AWARENESS
from teamsight.analysis.learning.registry import LEARNERS, REWARDS
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.files import as_json
from teamsight.analysis.runs.seeds import root
from teamsight.core.component import Allowed, Component, Count, Probability, Seed
from teamsight.world.limits import Length

if TYPE_CHECKING:
    from teamsight.agents.awareness import Awareness
    from teamsight.policies.memory import LazyMemory
    from teamsight.policies.rewards import Reward

#: The worlds of the paper's exploration (§8.2); it does not give the radius.
EXPLORED: dict[str, Any] = {"robots": 5, "targets": 10, "radius": 3.0}
#: Fewest explorations with an interval: with two its half-width is 13 standard errors.
LEAST_FOR_INTERVAL = 3
#: Each generation of a search has its own worlds; more would meet those of the next seed.
MOST_GENERATIONS = 10_000
_ROOT = root("learning curves")
# Rows of a table of tests.
_MOST_ROWS = 2e6

# A function, because a registry has no hash, which an annotation that may be None needs.
RewardName = Annotated[str, Allowed(choices=lambda: REWARDS)]
LearnerName = Annotated[str, Allowed(choices=LEARNERS)]
Matches = Annotated[int | None, Allowed(least=1, shown="that of the learner")]
# A sample needs as many transitions, which must fit in memory.
_Samples = Annotated[
    tuple[Annotated[int, Allowed(least=1, most=10_000_000)], ...], Allowed(most=100, is_sorted=True)
]
_Learned = Annotated[int, Allowed(least=0, most=limits.MOST_STEPS, cure=("", "let teams learn for less long"))]


class Objective(NamedTuple):
    """What is to be learnt.

    Attributes
    ----------
    reward : callable or None
        Reward of each transition; see `teamsight.policies.rewards`.
    k : int or None
        Number of transitions that match a situation, for learners that match.
    discount : float or None
        Discount factor γ, in [0, 1], for learners that look ahead.

    None stands for the learner's default.
    """

    reward: Reward | None = None
    k: int | None = None
    discount: float | None = None


@dataclass(frozen=True, kw_only=True)
class Exploring(Component):
    """How long robots explore, and what they know of their teammates meanwhile.

    Parameters
    ----------
    steps : int
        Number of steps in each world.
    runs : int
        Number of worlds; each gives robots × steps transitions.
    awareness : str or Awareness
        Degree of awareness that determines the situations.
    seed : int
        Root seed, from which the seeds of the worlds derive.
    """

    steps: limits.Steps = 120
    runs: limits.Runs = 1
    awareness: Annotated[Awareness | str, Allowed(choices=AWARENESS)] = "ring"
    seed: Seed = 0


@dataclass(frozen=True, kw_only=True)
class Evaluation(Component):
    """On how many worlds teams are compared; no exploration uses them, whatever its seed.

    Parameters
    ----------
    runs : int
        Number of worlds.
    steps : int, optional
        Number of steps in each world.
    seed : int
        Root seed of the worlds.
    """

    runs: limits.Runs = 30
    steps: Annotated[limits.Steps | None, Allowed(shown="that of the task")] = None
    seed: Seed = 0


@dataclass(frozen=True, kw_only=True)
class Training(Component):
    """For how long teams learn while they act, with which degrees of awareness, and how they are tested.

    Parameters
    ----------
    learned : sequence of int
        Numbers of steps of learning, or of whatever unit the team's function counts.
    awareness : sequence of str or Awareness
        Degrees of awareness with which teams learn; gains are over the first.
    trainings : int
        How often each team learns, with other seeds.
    runs : int
        Number of test runs of each training, in the same worlds for all teams.
    steps : int, optional
        Number of steps of each test run.
    seed : int
        Root seed of the learning and of the tests.
    """

    learned: Annotated[tuple[_Learned, ...], Allowed(most=50, is_sorted=True)] = (1000, 10000, 100000)
    awareness: Annotated[
        tuple[Annotated[Awareness | str, Allowed(choices=AWARENESS)], ...], Allowed()
    ] = ("none", "pairwise")  # fmt: skip
    trainings: Annotated[int, Allowed(least=1, most=1000)] = 5
    runs: limits.Runs = 20
    steps: Annotated[limits.Steps | None, Allowed(shown="that of the task")] = None
    seed: Seed = 0


@dataclass(frozen=True, kw_only=True)
class _Learning(Component):
    """What learners learn from samples of explorations.

    The explorations are the paper's, 5 robots × 120 steps among 10 targets in an arena of radius 3 under Θ(1), as often
    as the largest sample needs.

    Parameters
    ----------
    learners : sequence of str
        Learners, by name.
    samples : sequence of int
        Numbers of transitions to learn from.
    memories : int
        Number of explorations; all learners learn from the same ones.
    reward : str
        Reward of a transition. See docs/learning.md.
    k : int, optional
        Number k of nearest transitions that a learner uses.
    discount : float
        Discount factor γ, in [0, 1].
    seed : int
        Seed of the first exploration; the others follow.
    """

    learners: Annotated[tuple[LearnerName, ...], Allowed()] = ("lazy", "regression")
    samples: _Samples = (600, 2400, 9600, 38400)
    memories: limits.Runs = 24
    reward: RewardName = "own"
    k: Matches = None
    discount: Probability = 0.7
    seed: Seed = 0

    @property
    def objective(self) -> Objective:
        """What is to be learnt."""
        return Objective(REWARDS[self.reward], self.k, self.discount)

    def exploration(self, memory: int, transitions: int | None = None) -> dict[str, Any]:
        """Return runs and seed of an exploration with as many transitions; by default as the largest sample."""
        each = EXPLORED["robots"] * Exploring.steps
        return {"runs": -(-(transitions or max(self.samples)) // each), "seed": self.seed + memory}

    def conditions(self) -> dict[str, Any]:
        """Return all settings as JSON values."""
        return as_json(self)


@dataclass(frozen=True, kw_only=True)
class Curves(_Learning):
    """Settings of learning curves: what is learnt, from how many transitions, and where it is evaluated.

    A situation under Θ(1) does not depend on the number of robots, so one exploration serves all scenarios; under Θ(0)
    learners get the robot's own inputs of the same transitions. Smaller samples are subsets of larger ones.

    Parameters
    ----------
    worlds : int
        Number of worlds of each scenario in which each learner is tested, for each exploration.
    robots : sequence of int
        Numbers of robots when tested; each with each radius is a scenario.
    targets : int
        Number of targets.
    radius : sequence of float
        Radii of the arena when tested, in sensing ranges.
    steps : int
        Number of steps of each test.

    Raises
    ------
    TypeError, ValueError
        If a name is unknown, a number is outside its limits, or there would be too many tests.
    """

    learners: Annotated[tuple[LearnerName, ...], Allowed()] = ("lazy", "tabular", "linear", "regression")
    samples: Annotated[_Samples, Allowed(shown="40,75,150,… doubled up to 38400")] = (
        40, 75, 150, 300, 600, 1200, 2400, 4800, 9600, 19200, 38400,
    )  # fmt: skip
    worlds: limits.Runs = 3
    robots: Annotated[tuple[Count, ...], Allowed(most=6, is_sorted=True)] = (5, 10, 20)
    targets: Count = 15
    radius: Annotated[tuple[Length, ...], Allowed(most=6, is_sorted=True)] = (3.0, 5.0)
    steps: Annotated[limits.Steps, Allowed(unit="ticks")] = 600
    reward: RewardName = "keep"
    seed: Seed = _ROOT

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.tests > _MOST_ROWS:
            raise ValueError(
                f"memories={self.memories}, worlds={self.worlds}, {len(self.scenarios)} scenarios, "
                f"{len(self.samples)} samples: makes {self.tests:.1e} rows, at most {_MOST_ROWS:g}; reduce one of them"
            )

    @property
    def scenarios(self) -> list[tuple[int, float]]:
        """Number of robots and radius of each scenario."""
        return list(product(self.robots, self.radius))

    @property
    def tests(self) -> int:
        """Number of tests with and without awareness."""
        return self.memories * self.worlds * len(self.scenarios) * (2 * len(self.learners) * len(self.samples) + 2)


@dataclass(frozen=True, kw_only=True)
class Diagnosis(_Learning):
    """Settings of a diagnosis. Of the learners, "sheppard" cannot be diagnosed, since its moves are partly random.

    Raises
    ------
    TypeError, ValueError
        If a name is unknown, a number is outside its limits, or samples are too small.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        if "sheppard" in self.learners:
            raise ValueError("learner=sheppard: moves at random now and then, and learns meanwhile; leave it out")
        if min(self.samples) < self.matches:
            raise ValueError(
                f"samples={min(self.samples)}: fewer than the {self.matches} transitions that eq. 1 matches; give "
                "larger samples, or a smaller k"
            )

    @property
    def matches(self) -> int:
        """Number of transitions that are matched with a situation: k, or that of `LazyQ`."""
        kind: Any = LEARNERS["lazy"]
        usual: int = kind.k
        return usual if self.k is None else self.k

    def in_words(self, memory: LazyMemory | None = None) -> str:
        """Return the settings in a line; with `memory`, those of its diagnosis."""
        if memory is None:
            number = f"{self.memories} exploration" + ("s" if self.memories != 1 else "")
            source = f"mean and 95 % interval over {number}" if self.memories > 1 else f"{number}, no interval"
        else:
            source = f"samples of {len(memory)} transitions, digest {memory.digest}, no interval"
        k = "" if self.k is None else f", k = {self.k}"
        return f"{source}; reward {self.reward}, γ = {self.discount:g}{k}, seed {self.seed}"


@dataclass(frozen=True, kw_only=True)
class Imagining(Component):
    """How long a policy is sought in imagined worlds, and for which teams and arenas.

    Parameters
    ----------
    generations : int
        Number of generations of the search.
    population : int
        Number of policies in each generation; each is tried in all worlds of the generation.
    robots : sequence of int
        Numbers of robots; each with each radius is a world, unless nearly all targets are observed in it under any
        policy, with more than a robot for each square of the radius.
    targets : int
        Number of targets.
    radius : sequence of float
        Radii of the arena.
    steps : int
        Number of steps in each world.
    seed : int
        Seed of the search and of the imagined worlds.
    """

    generations: Annotated[int, Allowed(least=1, most=MOST_GENERATIONS - 100)] = 36
    population: Annotated[int, Allowed(least=4, most=1000)] = 14
    robots: Annotated[tuple[Count, ...], Allowed(most=30, is_sorted=True)] = (5, 10, 20)
    targets: Count = 15
    radius: Annotated[tuple[Length, ...], Allowed(most=30, is_sorted=True)] = (2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0)
    steps: limits.Steps = 600
    seed: Seed = 0

    @property
    def cells(self) -> list[tuple[int, float]]:
        """Number of robots and radius of each world."""
        return [(robots, radius) for robots, radius in product(self.robots, self.radius) if robots <= radius**2]
