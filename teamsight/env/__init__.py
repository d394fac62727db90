"""Environments for reinforcement learning: one world for PettingZoo, or many worlds in one compiled call.

`parallel_env` and `env` follow PettingZoo's interfaces, `vector_env` takes and returns arrays of all robots of many
worlds, and `gymnasium_env` is Gymnasium's vector interface, with one sub-environment for each robot. They need the
optional packages pettingzoo and gymnasium: ``pip install 'teamsight[env]'``. The import registers each task with
Gymnasium, for ``gymnasium.make_vec("teamsight/CMOMMT-v0")``. `stable_baselines_env` also needs stable-baselines3.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.core.extras import extra
from teamsight.core.lazy_names import lazy_names
from teamsight.tasks.registry import TASKS

# Their environments would fail later, in the middle of a user's script.
extra("pettingzoo", "teamsight.env", "env")
gymnasium = extra("gymnasium", "teamsight.env", "env")

if TYPE_CHECKING:
    from teamsight.env.observations import Nearest
    from teamsight.env.parallel import TeamParallelEnv, env, parallel_env
    from teamsight.env.rewards import REWARDS, Facts
    from teamsight.env.stable_baselines import stable_baselines_env
    from teamsight.env.vector import SharedPolicyEnv, TeamVectorEnv, gymnasium_env, vector_env
    from teamsight.policies.actions import ActionGrid

_HOMES = {
    "ActionGrid": "teamsight.policies.actions",
    "Facts": "teamsight.env.rewards",
    "Nearest": "teamsight.env.observations",
    "REWARDS": "teamsight.env.rewards",
    "SharedPolicyEnv": "teamsight.env.vector",
    "TeamParallelEnv": "teamsight.env.parallel",
    "TeamVectorEnv": "teamsight.env.vector",
    "env": "teamsight.env.parallel",
    "gymnasium_env": "teamsight.env.vector",
    "parallel_env": "teamsight.env.parallel",
    "stable_baselines_env": "teamsight.env.stable_baselines",
    "vector_env": "teamsight.env.vector",
}

__all__ = [
    "REWARDS", "ActionGrid", "Facts", "Nearest", "SharedPolicyEnv", "TeamParallelEnv", "TeamVectorEnv", "env",
    "gymnasium_env", "parallel_env", "stable_baselines_env", "vector_env",
]  # fmt: skip

for _task in TASKS:
    _id = f"teamsight/{'CMOMMT' if _task == 'cmommt' else _task.title()}-v0"
    if _id not in gymnasium.registry:
        gymnasium.register(
            _id, entry_point="teamsight.env.vector:one_robot", vector_entry_point="teamsight.env.vector:many_robots",
            kwargs={"model": _task},
        )  # fmt: skip

__getattr__ = lazy_names(__name__, _HOMES, globals())
