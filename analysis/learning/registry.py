"""Learners and rewards by name; each is imported when it is first used."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from teamsight.core.registry import Registry

if TYPE_CHECKING:
    from teamsight.policies.learner import Learner
    from teamsight.policies.rewards import Reward

#: Learners by name.
LEARNERS: Mapping[str, type[Learner]] = Registry(
    {
        "regression": "teamsight.policies.lazy.lazy_regression:LazyRegression",
        "lazy": "teamsight.policies.lazy.lazy_q:LazyQ",
        "pessimistic": "teamsight.policies.lazy.lazy_q:PessimisticLazyQ",
        "sheppard": "teamsight.policies.lazy.sheppard_lazy_q:SheppardLazyQ",
        "tabular": "teamsight.policies.eager:TabularQ",
        "linear": "teamsight.policies.eager:LinearQ",
    }
)
#: Rewards by name. They differ in whose targets count, and in whether gained targets count as well as lost ones; the
#: last is what interactions gave.
REWARDS: Registry[Reward] = Registry(
    {
        "own": "teamsight.policies.rewards:own_reward",
        "team": "teamsight.policies.rewards:team_reward",
        "alone": "teamsight.policies.rewards:alone_reward",
        "keep": "teamsight.policies.rewards:keep_reward",
        "interaction": "teamsight.policies.rewards:interaction_reward",
    },
    group="teamsight.rewards",
)
