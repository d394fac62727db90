"""Making a policy from a memory and an objective: what learners need, and the degree under which they act."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from teamsight.agents.awareness import AWARENESS, Awareness, NoAwareness
from teamsight.analysis.learning.plans import Objective
from teamsight.analysis.learning.registry import LEARNERS, REWARDS
from teamsight.analysis.runs.checkpoint import Checkpoint, code_digest
from teamsight.analysis.runs.executor import Executor
from teamsight.analysis.runs.simulate import Job, Progress, run_all
from teamsight.core import checks
from teamsight.policies.lazy.learner import MOST_MATCHES, LazyLearner, check_constants, next_matches
from teamsight.policies.memory import LazyMemory


@dataclass(frozen=True)
class LearningJob:
    """What is made of one memory, with one learner or all; see `Job`.

    Parameters
    ----------
    settings : Curves or Diagnosis
        The settings.
    memory : int
        Number of the memory.
    learner : str
        Name of the learner; empty for all, or for the policies that do not learn.
    """

    settings: Any
    memory: int
    learner: str = ""
    # Of a job for the runner, which puts each into a chunk of its own.
    cost = 250_000.0

    @property
    def key(self) -> tuple[str, ...]:
        """See `Job`."""
        home = type(self)
        of = str(self.settings.conditions()), self.learner, str(self.memory)
        return (home.__name__, *of, code_digest(home.__module__))

    def describe(self) -> str:
        """See `Job`."""
        return f"{type(self).__name__}, memory {self.memory} {self.learner}".strip()


def made_rows(
    jobs: Sequence[Job],
    pool: Executor | None = None,
    *,
    checkpoint: Checkpoint | None = None,
    progress: Progress = lambda done, total: None,
) -> pd.DataFrame:
    """Make jobs that return rows, and return the table of all; see `run_all`."""
    rows = run_all(jobs, pool, progress=progress, checkpoint=checkpoint)
    return pd.DataFrame([row for part in rows for row in part])


def default_of(learner: str, constant: str) -> Any:
    """Return a learner's default for a parameter, such as "k" or "discount"; None if it has no such parameter."""
    return getattr(LEARNERS[learner], constant, None)


def default_reward(learner: str) -> str:
    """Return the name of a learner's default reward."""
    return next(name for name, reward in REWARDS.items() if reward == default_of(learner, "reward"))


def check_objective(
    learners: Sequence[str],
    reward: str | None,
    k: int | None,
    transitions: int | None = None,
    *,
    discount: float | None = None,
) -> None:
    """Raise an error if one of the learners cannot learn this.

    Parameters
    ----------
    learners : sequence of str
        Names of learners.
    reward : str or None
        Name of the reward; None, as for the other constants, for the default of each learner.
    k : int or None
        Number of transitions that match a situation.
    transitions : int, optional
        Smallest number of transitions to learn from, if it is known.
    discount : float, optional
        Discount factor γ.

    Raises
    ------
    ValueError
        Naming the value, the limit and the cure.
    """
    if "sheppard" in learners and reward not in (None, "own"):
        raise ValueError(
            f"reward={reward}: sheppard learns while it acts, from the robot's own gains and losses only; give the "
            "reward own, or another learner"
        )
    if discount is not None and all(default_of(name, "discount") is None for name in learners):
        verb = "uses" if len(learners) == 1 else "use"
        raise ValueError(f"discount={discount:g}: {' and '.join(learners)} {verb} immediate rewards only; leave it out")
    matching = {name: usual for name in learners if (usual := default_of(name, "k")) is not None}
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
        What is to be learnt; constants that the learner does not have are ignored.
    inputs : int, optional
        Number of components of a situation that are used; by default all.
    progress : callable
        Called with the transitions searched and the transitions in all, by learners that search.

    Raises
    ------
    TypeError, ValueError
        If the name is unknown, or the learner cannot use its arguments.
    """
    kind = LEARNERS[checks.choice("learner", name, LEARNERS)]
    width = memory.inputs if inputs is None else inputs
    wanted = {constant: value for constant, value in (objective or Objective())._asdict().items() if value is not None}
    given = {constant: value for constant, value in wanted.items() if default_of(name, constant) is not None}
    if issubclass(kind, LazyLearner):
        k, discount = given.get("k", kind.k), given.get("discount", kind.discount)
        check_constants(memory, k, discount, kind.sweeps)
        if discount > 0:
            # The learner would make this search too, but without reporting progress.
            next_matches(memory, k, width, progress)
    return kind(memory, inputs=width, **given)


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
