"""The ids of the tasks in Gymnasium's registry, such as "teamsight/CMOMMT-v0"."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NoReturn

import gymnasium

from teamsight.tasks.registry import TASKS

if TYPE_CHECKING:
    from teamsight.env.shared_policy import SharedPolicyEnv

_ACRONYMS = {"cmommt": "CMOMMT"}


def register_tasks() -> None:
    """Register each task of `TASKS`, once."""
    for task in TASKS:
        if (name := f"teamsight/{_ACRONYMS.get(task, task.title())}-v0") not in gymnasium.registry:
            gymnasium.register(
                name,
                entry_point=f"{__name__}:one_robot",
                vector_entry_point=f"{__name__}:many_robots",
                kwargs={"model": task},
            )


def many_robots(num_envs: int, **settings: Any) -> SharedPolicyEnv:
    """Return the environment that `gymnasium.make_vec` makes of an id; `num_envs` is the number of worlds."""
    from teamsight.env.shared_policy import gymnasium_env

    return gymnasium_env(num_envs, **settings)


def one_robot(**_: Any) -> NoReturn:
    """Refuse `gymnasium.make`, whose environments have one robot that acts alone."""
    raise ValueError(
        "gymnasium.make: a team is several environments, one for each robot; use gymnasium.make_vec(id, "
        "num_envs=WORLDS)"
    )
