"""The parameters of a task's teams: the one that explores, and the one with skill, which may have to learn."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal, get_args

from teamsight.core import checks

if TYPE_CHECKING:
    from teamsight.agents.awareness import Awareness

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
