"""`Task`: what a team is to achieve in which world, how it is measured, and how it explores and acts with skill."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, get_args

from teamsight.core import checks
from teamsight.core.component import Allowed, Component, Count, Flag

if TYPE_CHECKING:
    from teamsight.agents.awareness import Awareness
    from teamsight.agents.world import World

#: Whether more or less of a metric is better.
Better = Literal["more", "less"]


class Objective(NamedTuple):
    """What a team is to achieve.

    Attributes
    ----------
    metric : str
        The name of a metric of the task.
    better : "more" or "less"
        Whether more or less of it is better.

    Notes
    -----
    A duration, of which less is better, is infinite if what was to happen did not happen during the run. Analyses then
    count the length of the run (a *censored* run), so that its mean is the restricted mean duration, and give the share
    of such runs.
    """

    metric: str
    better: Better = "more"

    @property
    def sign(self) -> float:
        """1 if more is better, −1 if less is."""
        return 1.0 if self.better == "more" else -1.0

    def counted(self, value: float, steps: int) -> float:
        """Return the value that enters means: that of a censored run of this length is `steps`."""
        return float(steps) if self.is_censored(value) else value

    def is_censored(self, value: float) -> bool:
        """Return whether what was to happen did not happen during the run."""
        return self.better == "less" and value == math.inf

    def checked(self, name: str, value: object) -> float:
        """Return what a metric returned as a float.

        Raises
        ------
        TypeError
            If it is no number.
        ValueError
            If it is NaN, or infinite without being a duration.
        """
        what = f"the metric {name!r} of the task returned {checks.shown(value)}"
        try:
            found = checks.number(name, value) if value != math.inf else math.inf
        except (TypeError, ValueError):
            cure = "return a finite number, or math.inf for a duration that did not end during the run"
            raise type(_error(value))(f"{what}: is no number; {cure}") from None
        if found == math.inf and name == self.metric and self.better == "more":
            raise ValueError(f"{what}: more of it is better, so it must be finite; return a finite number")
        return found


def _error(value: object) -> Exception:
    """Return an error of the kind that fits what is no finite number."""
    return ValueError() if isinstance(value, float) else TypeError()


#: The teams that a task names.
Named = Literal["explore", "skilled"]
TREATMENTS: tuple[Named, ...] = get_args(Named)
#: Which team acts: one that the task names, or one with these parameters of the world.
Treatment = Named | Mapping[str, Any]
#: The parameter of worlds that is their degree of awareness.
AWARENESS = "awareness"


def parameters_of(
    task: str,
    teams: Mapping[str, Any],
    treatment: Treatment,
    scenario: Mapping[str, Any],
    awareness: Awareness | str | None,
    rng: int,
) -> dict[str, Any]:
    """Return the parameters of a team that are not in the scenario.

    Parameters
    ----------
    task : str
        The name of the task.
    teams : mapping
        What it says of each team that it names.
    treatment : "explore", "skilled" or mapping
        Which team.
    scenario : mapping
        The whole scenario, for a team that has to learn.
    awareness : Awareness, str or None
        The degree of awareness in place of the team's own.
    rng : int
        The root seed of the learning.

    Raises
    ------
    TypeError, ValueError
        If the task has no such team, or a parameter is one of the scenario.
    """
    given = _given(task, teams, treatment)
    if callable(given):
        from teamsight.agents.resolve import awareness_of

        degree = None if awareness is None else awareness_of(awareness)
        found = given(scenario, degree, rng)
        if not isinstance(found, Mapping):
            raise TypeError(
                f"skilled of the task {task} returned {checks.shown(found)}: must be a mapping of parameters of "
                "the world, such as {'policy': …}"
            )
    else:
        found = given
    team = dict(found) if awareness is None else {**found, AWARENESS: awareness}
    for name in team:
        if name in scenario:
            raise ValueError(
                f"{name}: is a parameter of the scenario of {task}, not of a team; leave it out of the treatment"
            )
    return team


def _given(task: str, teams: Mapping[str, Any], treatment: Treatment) -> Any:
    """Return what a task says of a team."""
    if isinstance(treatment, Mapping):
        return treatment
    given = teams[checks.choice("treatment", treatment, TREATMENTS)]
    if given is None:
        what = "exploration treatment" if treatment == "explore" else "skilled team"
        example = "explore={'policy': 'random-walk'}" if treatment == "explore" else "skilled={'policy': 'a-cmommt'}"
        raise ValueError(f"the task {task} has no {what}; give it one, as in Task(…, {example})")
    if not (isinstance(given, Mapping) or (callable(given) and treatment == "skilled")):
        raise TypeError(f"{treatment}={checks.shown(given)}: must be a mapping of parameters of the world")
    return given


#: Returns a measure of a finished world.
Metric = Callable[["World"], float]
#: Called as ``train(scenario, awareness, rng)``; returns the parameters of a team that has learned.
Train = Callable[[Mapping[str, Any], "Awareness | None", int], Mapping[str, Any]]


@dataclass(frozen=True, eq=False, kw_only=True)
class Task(Component):
    """What a team is to achieve, in which worlds, and how this is measured.

    Every analysis takes a task: `choose_delta`, `run_many`, studies, recordings, environments and the commands. Its
    name is enough where it is registered in `TASKS`.

    Parameters
    ----------
    name : str
        The name of the task, a key of `TASKS` or any other.
    title : str
        What it is, in a few words.
    world : callable
        The class of its worlds, or a function that makes one; called as ``world(**parameters, rng=seed)``.
    scenario : mapping of str to number, text or bool
        The parameters of the world that make the scenario, with their defaults. Two teams under one scenario and seed
        meet the same noise, so their differences are paired.
    objective : Objective or (str, str)
        The name of a metric and whether "more" or "less" of it is better.
    metrics : mapping of str to callable
        What is measured, by name: ``metric(world) -> float`` of a world after its last step. A duration that did not
        end during the run is ``math.inf``.
    explore : mapping, optional
        The other parameters of the world for the exploration from which δ is chosen: a random policy.
    skilled : mapping or callable, optional
        The same for a team with skill: its parameters, or a function that lets a team learn and returns them,
        ``train(scenario, awareness, rng)``. `scenario` has all parameters; `awareness` is the degree with which it
        learns, None for that of the task. The function is called once for each scenario and degree.
    team : str, optional
        The team whose neighbours count; by default all do.
    size : str
        The parameter of the scenario that is N, the number of robots of this team.
    steps : int
        T, the length of a run.
    gathers : bool, optional
        Whether success brings the team together (True) or spreads it out (False), as the literature has it; None if it
        is unknown.
    about : str
        What it is, and its source, in some sentences.

    Raises
    ------
    TypeError, ValueError
        If a value is of the wrong type; `check_task` also runs the worlds.
    """

    name: Annotated[str, Allowed()]
    title: Annotated[str, Allowed()]
    world: Callable[..., World]
    scenario: Mapping[str, Any]
    objective: Objective
    metrics: Mapping[str, Metric]
    explore: Mapping[str, Any] | None = None
    skilled: Mapping[str, Any] | Train | None = None
    team: Annotated[str, Allowed()] | None = None
    size: Annotated[str, Allowed()] = "robots"
    steps: Annotated[Count, Allowed(unit="ticks")] = 600
    gathers: Flag | None = None
    about: Annotated[str, Allowed()] = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        # Copies, because their owner may change them.
        for name in ("scenario", "metrics", "explore", "skilled"):
            if isinstance(value := getattr(self, name), Mapping):
                object.__setattr__(self, name, dict(value))
        if isinstance(self.objective, tuple) and len(self.objective) == 2:
            object.__setattr__(self, "objective", Objective(*self.objective))

    def __repr__(self) -> str:
        return f"Task({self.name!r})"

    @property
    def teams(self) -> dict[str, Any]:
        """What the task says of each team, by name: parameters, a function that lets it learn, or None."""
        return {"explore": self.explore, "skilled": self.skilled}

    def parameters(
        self,
        treatment: Treatment = "skilled",
        scenario: Mapping[str, Any] | None = None,
        *,
        awareness: Awareness | str | None = None,
        rng: int = 0,
    ) -> dict[str, Any]:
        """Return all keyword parameters of a world, without its seed.

        Parameters
        ----------
        treatment : "explore", "skilled" or mapping
            Which team: the one that explores, the one with skill, or one with these parameters.
        scenario : mapping, optional
            Values of the scenario; the others are its defaults.
        awareness : Awareness or str, optional
            The degree of awareness in place of the team's own.
        rng : int
            The root seed of the learning, if a skilled team has to learn.

        Raises
        ------
        ValueError
            If a name is no parameter of the scenario, or the task has no such team.
        """
        full = self.full_scenario(scenario)
        team = parameters_of(self.name, self.teams, treatment, full, awareness, rng)
        return {**full, **team}

    def full_scenario(self, scenario: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Return the whole scenario: the given values, and the defaults of the others.

        Raises
        ------
        ValueError
            If a name is no parameter of the scenario; the message suggests the nearest.
        """
        given = dict(scenario or {})
        for name in given:
            if name not in self.scenario:
                hint = checks.suggestion(name, self.scenario)
                known = ", ".join(self.scenario)
                raise ValueError(f"{name}: is no parameter of the scenario of {self.name}; {hint}they are {known}")
        return {**self.scenario, **given}

    def build(
        self,
        treatment: Treatment = "skilled",
        *,
        rng: int | None = None,
        awareness: Awareness | str | None = None,
        **scenario: Any,
    ) -> World:
        """Return a world before its first step.

        Parameters
        ----------
        treatment, awareness
            See `parameters`.
        rng : int, optional
            The seed of the world; a random one by default.
        **scenario
            Values of the scenario.
        """
        return self.world(**self.parameters(treatment, scenario, awareness=awareness), rng=rng)

    def measure(self, world: World) -> dict[str, float]:
        """Return the metrics of a world after its last step, by name.

        Raises
        ------
        TypeError, ValueError
            If a metric returns no number; the message names it.
        """
        return {name: self.objective.checked(name, metric(world)) for name, metric in self.metrics.items()}
