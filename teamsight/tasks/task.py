"""A task: a class of worlds, its scenario, objective, metrics, and two teams: one that explores, one with skill."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from teamsight.core import checks
from teamsight.core.component import Allowed, Component, Count, Flag
from teamsight.tasks import treatments
from teamsight.tasks.objective import Objective
from teamsight.tasks.treatments import Treatment

if TYPE_CHECKING:
    from teamsight.agents.awareness import Awareness
    from teamsight.agents.world import World

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
        team = treatments.parameters_of(self.name, self.teams, treatment, full, awareness, rng)
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
