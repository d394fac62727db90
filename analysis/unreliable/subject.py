"""What is made unreliable: teams with and without awareness in scenarios of CMOMMT, or the skilled team of a task."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any, NamedTuple

from teamsight.tasks.registry import TASKS
from teamsight.tasks.task import Task

#: The task whose policies and scenarios were chosen by hand.
CMOMMT = "cmommt"
#: Its numbers of robots and arena radii: crowded, medium and sparse. They were chosen before any result.
SCENARIOS: tuple[tuple[int, float], ...] = ((10, 3.0), (10, 5.0), (20, 5.0))
TARGETS = 15
#: The name of the team of another task.
SKILLED = "skilled"


class Team(NamedTuple):
    """A policy and its degree of awareness."""

    policy: str
    awareness: str

    def __str__(self) -> str:
        return f"{self.policy} ({self.awareness})"


#: For each policy the teams that are compared: with information about teammates, and without. The evolved policy needs
#: it, so it is compared with A-CMOMMT without.
TEAMS: Mapping[str, tuple[Team, Team]] = MappingProxyType(
    {
        "a-cmommt": (Team("a-cmommt", "pairwise"), Team("a-cmommt", "none")),
        "evolved": (Team("evolved", "ring"), Team("a-cmommt", "none")),
    }
)


@dataclass(frozen=True)
class CmommtSubject:
    """Policies of CMOMMT.

    Parameters
    ----------
    cells : tuple of (int, float)
        Numbers of robots and radii of its scenarios.

    Attributes
    ----------
    columns : tuple of str
        The values that tell scenarios apart.
    about : str
        What all scenarios have in common, in words.
    scale : float
        Factor on the objective.
    observed, gained : str
        Labels of the objective and of its differences, with their units.
    """

    cells: tuple[tuple[int, float], ...] = SCENARIOS
    columns = ("robots", "radius")
    about = f"{TARGETS} targets, ranges 1, default speeds"
    scale = 100.0
    observed = "observed [%]"
    gained = "gain [points]"

    @cached_property
    def task(self) -> Task:
        """CMOMMT."""
        return TASKS[CMOMMT]

    @property
    def scenarios(self) -> tuple[dict[str, Any], ...]:
        """The scenarios, with their number of targets."""
        return tuple({"robots": robots, "targets": TARGETS, "radius": radius} for robots, radius in self.cells)

    def conditions(self) -> dict[str, Any]:
        """Return the settings, fit for JSON."""
        return {"scenarios": self.cells}

    def parameters(self, policy: str, aware: bool, scenario: Mapping[str, Any]) -> dict[str, Any]:
        """Return the parameters of a world."""
        return self.task.parameters(TEAMS[policy][not aware]._asdict(), scenario)

    def name(self, policy: str, aware: bool) -> str:
        """Return the policy and its degree."""
        return str(TEAMS[policy][not aware])

    def degree(self, policy: str, aware: bool) -> str:
        """Return the degree."""
        return TEAMS[policy][not aware].awareness

    def title(self, scenario: Mapping[Any, Any]) -> str:
        """Return N and R."""
        return f"N = {scenario['robots']}, R = {scenario['radius']:g}"


@dataclass(frozen=True)
class TaskSubject:
    """The team with skill of a task, under its own degree of awareness and under none.

    Parameters
    ----------
    task : Task
        The task.
    setting : mapping
        Values of its scenario.
    rng : int
        Root seed of the learning, if the team has to learn, which it does once under each degree.

    For its attributes, see `CmommtSubject`.
    """

    task: Task
    setting: Mapping[str, Any]
    rng: int
    scale = 1.0
    gained = "gain"

    @cached_property
    def observed(self) -> str:
        """The objective."""
        return self.task.objective.metric

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """N, and the values that were given."""
        return tuple(dict.fromkeys((self.task.size, *self.setting)))

    @cached_property
    def about(self) -> str:
        """The task."""
        return f"task {self.task.name}"

    @property
    def scenarios(self) -> tuple[dict[str, Any], ...]:
        """The one scenario."""
        full = self.task.full_scenario(self.setting)
        return ({name: full[name] for name in self.columns},)

    def conditions(self) -> dict[str, Any]:
        """Return the settings, fit for JSON."""
        return {"task": self.task.name, "scenario": self.task.full_scenario(self.setting)}

    @cached_property
    def _teams(self) -> dict[bool, dict[str, Any]]:
        return {
            aware: self.task.parameters("skilled", self.setting, awareness=None if aware else "none", rng=self.rng)
            for aware in (True, False)
        }

    def parameters(self, policy: str, aware: bool, scenario: Mapping[str, Any]) -> dict[str, Any]:
        """Return the parameters of a world."""
        return self._teams[aware]

    def name(self, policy: str, aware: bool) -> str:
        """Return the team."""
        return SKILLED if aware else f"{SKILLED} (none)"

    def degree(self, policy: str, aware: bool) -> str:
        """Return one degree for the team's own, whatever it is."""
        return "pairwise" if aware else "none"

    def title(self, scenario: Mapping[Any, Any]) -> str:
        """Return the names and values."""
        return ", ".join(f"{name} = {scenario[name]}" for name in self.columns)


#: Teams and scenarios.
Subject = CmommtSubject | TaskSubject


def subject_of(
    task: Task, setting: Mapping[str, Any], cells: tuple[tuple[int, float], ...], rng: int
) -> CmommtSubject | TaskSubject:
    """Return what is made unreliable.

    Raises
    ------
    ValueError
        If values of the scenario are given for CMOMMT, whose scenarios are fixed.
    """
    if task.name != CMOMMT:
        return TaskSubject(task, setting, rng)
    if setting:
        raise ValueError(f"set={dict(setting)}: the scenarios of {CMOMMT} are fixed; leave it out")
    return CmommtSubject(cells)
