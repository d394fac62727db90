"""Making a policy from a memory and an objective: what learners need, and the degree under which they act."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from teamsight.agents.awareness import AWARENESS, Awareness, NoAwareness
from teamsight.analysis.learning.registry import LEARNERS
from teamsight.core import checks
from teamsight.policies.lazy.action_values import MOST_MATCHES, check_constants, next_matches
from teamsight.policies.lazy.learner import LazyLearner
from teamsight.policies.memory import LazyMemory
from teamsight.policies.rewards import Reward, own_reward

#: Called with the work done and the work in all.
Progress = Callable[[float, float], None]

# Transitions² × inputs that are compared in a second.
_COMPARED_A_SECOND = 30_000.0**2 * 32


class Objective(NamedTuple):
    """What is to be learnt.

    Attributes
    ----------
    reward : callable
        Reward of each transition; see `teamsight.policies.rewards`.
    k : int or None
        Number of transitions that match a situation, for lazy learners; None for the learner's default.
    discount : float
        Discount factor γ, in [0, 1].
    """

    reward: Reward = own_reward
    k: int | None = None
    discount: float = 0.7


def check_objective(learners: Sequence[str], reward: str, k: int | None, transitions: int | None = None) -> None:
    """Raise an error if one of the learners cannot learn this.

    Parameters
    ----------
    learners : sequence of str
        Names of learners.
    reward : str
        Name of the reward.
    k : int or None
        Number of transitions that match a situation; None for the default of each learner.
    transitions : int, optional
        Smallest number of transitions to learn from, if it is known.

    Raises
    ------
    ValueError
        Naming the value, the limit and the cure.
    """
    if "sheppard" in learners and reward != "own":
        raise ValueError(
            f"reward={reward}: sheppard learns while it acts, from the robot's own gains and losses only; give the "
            "reward own, or another learner"
        )
    matching = {name: usual for name in learners if (usual := _usual_matches(name)) is not None}
    if k is not None and not matching:
        verb = "matches" if len(learners) == 1 else "match"
        raise ValueError(f"k={k}: {' and '.join(learners)} {verb} no fixed number of transitions; leave it out")
    for name, usual in matching.items():
        wanted = usual if k is None else k
        if wanted > MOST_MATCHES:
            raise ValueError(f"k={wanted}: must be at most {MOST_MATCHES}, the number that a decision can hold")
        if transitions is not None and wanted > transitions:
            raise ValueError(
                f"k={wanted}: {name} matches so many transitions, but the memory has only {transitions}; use a smaller "
                "k, or more transitions"
            )


def _usual_matches(name: str) -> int | None:
    """Return by default how many transitions a learner matches with a situation; None if it matches no fixed number."""
    kind = LEARNERS[name]
    return kind.k if issubclass(kind, LazyLearner) else None


def search_seconds(name: str, memory: LazyMemory, objective: Objective) -> float:
    """Return the expected duration of a learner's search, with all inputs and with the robot's own ones [s]."""
    if _usual_matches(name) is None or objective.discount == 0:
        return 0.0
    inputs = memory.own + (memory.inputs if memory.added else 0)
    return float(len(memory)) ** 2 * inputs / _COMPARED_A_SECOND


def learn(
    name: str,
    memory: LazyMemory,
    objective: Objective | None = None,
    *,
    inputs: int | None = None,
    progress: Progress = lambda done, total: None,
) -> Any:
    """Return the policy that a learner makes from a memory.

    Parameters
    ----------
    name : str
        A key of `LEARNERS`.
    memory : LazyMemory
        The transitions.
    objective : Objective, optional
        What is to be learnt; by default the reward "own" and the default constants.
    inputs : int, optional
        Number of components of a situation that are used; by default all.
    progress : callable
        Called with the transitions searched and the transitions in all, by learners that search.

    Raises
    ------
    TypeError, ValueError
        If the name is unknown, or the learner cannot use its arguments.
    """
    kind, chosen = LEARNERS[checks.choice("learner", name, LEARNERS)], objective or Objective()
    width = memory.inputs if inputs is None else inputs
    if not issubclass(kind, LazyLearner):
        return kind(memory, chosen.reward, width, chosen.discount)
    k = kind.k if chosen.k is None else chosen.k
    check_constants(memory, k, chosen.discount, kind.sweeps)
    if chosen.discount > 0:
        # The learner would make this search too, but without reporting progress.
        next_matches(memory, k, width, progress)
    return kind(memory, chosen.reward, width, chosen.discount, k=k)


def awareness_for(memory: LazyMemory, inputs: int | None = None) -> Awareness:
    """Return the degree of awareness under which robots perceive the situations of a memory.

    Parameters
    ----------
    memory : LazyMemory
        The transitions; its settings name the degree.
    inputs : int, optional
        Number of components that are used; the robot's own ones need no awareness.

    Raises
    ------
    ValueError
        If the memory does not name the degree, or names one that is not of this package.
    """
    if (memory.inputs if inputs is None else inputs) == memory.own:
        return NoAwareness()
    name = memory.settings.get("degree")
    if not isinstance(name, str) or name not in AWARENESS:
        raise ValueError(
            f"memory: was explored under the degree of awareness {checks.shown(name)}, which is not one of "
            f"{', '.join(AWARENESS)}; give the policy and its degree to CMOMMT as objects"
        )
    return AWARENESS[name].adding(memory.added)
