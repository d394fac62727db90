"""What lets PPO learn to observe targets: rewards, layouts, actions and settings, one after the other.

It needs teamsight[env,rl]: python benchmarks/ppo.py FILE [SEEDS [FIRST]], with the number of the first row, from the
end if it is below 0. Each row adds a line of JSON to FILE: what was changed, the share that the team observed while it
was trained, by agent-steps, and what its most probable actions observe in 32 worlds of other seeds. `NEWCOMER` is what
a newcomer would have taken with the former defaults: a normal distribution of standard deviation 1 and the settings
that CleanRL has; then come two with the action and reward that are the defaults now, in both encodings. The last gives
environments no settings at all, and clips actions as CleanRL does. All others change one or two things of a tuned
training.
"""

import json
import sys
import time
from typing import Any

import numpy as np
import torch
from torch import nn
from torch.distributions import Categorical, Independent, Normal

from teamsight.env import vector_env

TEAM = {"robots": 5, "targets": 10}
CLEANRL: dict[str, Any] = {
    "worlds": 16, "rollout": 128, "discount": 0.99, "rate": 3e-4, "minibatches": 4, "spread": 0.0,
}  # fmt: skip
NEWCOMER: dict[str, Any] = CLEANRL | {
    "action": "continuous", "reward": "observed", "layout": "sectors", "max_cycles": 600, "total": 300_000,
    "encoding": "distance",
}  # fmt: skip
TUNED = NEWCOMER | {
    "action": "vector", "reward": "share", "worlds": 64, "rollout": 64, "total": 600_000, "discount": 0.95,
    "rate": 1e-3, "minibatches": 8, "encoding": "nearness", "spread": -0.7,
}  # fmt: skip
#: Two of what environments have by default now.
DEFAULTS: dict[str, Any] = {"action": "vector", "reward": "alone"}
ACTIONS, REWARDS = ("vector", "continuous", "grid"), ("share", "alone", "observed", "gain")
ROWS: list[dict[str, Any]] = [
    *({"action": action, "reward": reward} for action in ACTIONS for reward in REWARDS),
    *({"layout": "nearest", "reward": reward} for reward in ("share", "alone", "observed")),
    {"encoding": "distance"}, {"discount": 0.9}, {"discount": 0.99}, {"spread": 0.0}, {"max_cycles": 100},
    {"rate": 3e-4}, NEWCOMER, {"reward": "alone", "encoding": "distance"},
    *({**NEWCOMER, **DEFAULTS, "total": 1_200_000, "encoding": one} for one in ("distance", "nearness")),
    {**CLEANRL, "action": "default", "total": 1_200_000},
]  # fmt: skip


def network(inputs: int, outputs: int, last: float) -> Any:
    """Return a network of two hidden layers."""
    sizes = (inputs, 64, 64, outputs)
    layers: list[Any] = []
    for k, gain in enumerate((2**0.5, 2**0.5, last)):
        layers += [nn.Linear(sizes[k], sizes[k + 1]), nn.Tanh()]
        nn.init.orthogonal_(layers[-2].weight, gain)
        nn.init.zeros_(layers[-2].bias)
    return nn.Sequential(*layers[:-1])


def made(settings: dict[str, Any], worlds: int, **more: Any) -> Any:
    """Return the worlds; a vector is given as a rotation and a distance, unless all is by default."""
    if settings["action"] == "default":
        return vector_env(worlds, **TEAM, **more)
    action = "grid" if settings["action"] == "grid" else "continuous"
    chosen = {name: settings[name] for name in ("reward", "layout", "encoding", "max_cycles")}
    return vector_env(worlds, **TEAM, **(chosen | {"action": action} | more))


def given(settings: dict[str, Any], actions: Any) -> Any:
    """Return actions as the worlds take them."""
    if settings["action"] == "grid":
        return actions
    if settings["action"] in ("continuous", "default"):
        return np.clip(actions, -1, 1)
    x, y = actions[..., 0], actions[..., 1]
    return np.stack([np.arctan2(y, x) / np.pi, 2 * np.minimum(np.hypot(x, y), 1) - 1], -1)


def evaluated(settings: dict[str, Any], actor: Any) -> float:
    """Return the share that the most probable actions observe."""
    env, total = made(settings, 32, autoreset="disabled", max_cycles=600), 0.0
    observations, _ = env.reset(range(900_000, 900_032))
    with torch.no_grad():
        for _ in range(600):
            found = actor(torch.from_numpy(observations))
            step = env.step(given(settings, (found.argmax(-1) if settings["action"] == "grid" else found).numpy()))
            observations, total = step.observations, total + step.info["observed"].mean() / 600
    return float(total)


def trained(settings: dict[str, Any], seed: int) -> tuple[Any, list[tuple[int, float]]]:
    """Return the network that acts, and the share observed in each rollout by the number of agent-steps."""
    torch.manual_seed(seed)
    is_grid, steps, discount = settings["action"] == "grid", settings["rollout"], settings["discount"]
    env = made(settings, settings["worlds"], stagger=True)
    shape, inputs = (steps, env.worlds, env.robots), env.observation_space.shape[0]
    actor, critic = network(inputs, 16 if is_grid else 2, 0.01), network(inputs, 1, 1.0)
    spread = nn.Parameter(torch.full((2,), settings["spread"]))
    parameters = [*actor.parameters(), *critic.parameters(), spread]
    optimizer = torch.optim.Adam(parameters, lr=settings["rate"], eps=1e-5)

    def distribution(means: Any) -> Any:
        return Categorical(logits=means) if is_grid else Independent(Normal(means, spread.exp()), 1)

    observations, _ = env.reset(seed=1000 * seed + 17)
    seen, actions = torch.zeros(*shape, inputs), torch.zeros(shape if is_grid else (*shape, 2))
    chances, values, rewards, after, over = torch.zeros(5, *shape)
    updates, curve = max(1, settings["total"] // chances.numel()), []
    for update in range(updates):
        optimizer.param_groups[0]["lr"] = settings["rate"] * (1 - update / updates)
        observed = 0.0
        with torch.no_grad():
            for t in range(steps):
                seen[t] = torch.from_numpy(observations)
                policy = distribution(actor(seen[t]))
                action = policy.sample()
                actions[t], chances[t], values[t] = action, policy.log_prob(action), critic(seen[t])[..., 0]
                step = env.step(given(settings, action.numpy()))
                observations, rewards[t] = step.observations, torch.from_numpy(step.rewards)
                over[t] = torch.from_numpy(step.terminated | step.truncated)[:, None]
                if over[t].any():
                    after[t] = critic(torch.from_numpy(step.info["final_observations"]))[..., 0]
                observed += step.info["observed"].mean() / steps
            following, carried = critic(torch.from_numpy(observations))[..., 0], torch.zeros(shape[1:])
            advantage = torch.zeros(shape)
            for t in reversed(range(steps)):
                following = torch.where(over[t] > 0, after[t], following)
                error = rewards[t] + discount * following - values[t]
                advantage[t] = carried = error + discount * 0.95 * (1 - over[t]) * carried
                following = values[t]
            rows = [one.flatten(0, 2) for one in (seen, actions, chances, advantage, advantage + values)]
        for _ in range(4):
            for picked in torch.randperm(len(rows[0])).chunk(settings["minibatches"]):
                situation, action, chance, gain, wanted = (one[picked] for one in rows)
                policy = distribution(actor(situation))
                gain = (gain - gain.mean()) / (gain.std() + 1e-8)
                ratio = (policy.log_prob(action) - chance).exp()
                gains = torch.min(gain * ratio, gain * ratio.clamp(0.8, 1.2))
                loss = 0.25 * (critic(situation)[:, 0] - wanted).square().mean() - gains.mean()
                optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(parameters, 0.5)
                optimizer.step()
        curve.append(((update + 1) * len(rows[0]), round(float(observed), 4)))
    return actor, curve


def main() -> None:
    torch.set_num_threads(1)
    seeds, first = (*map(int, sys.argv[2:4]), *(1, 0)[len(sys.argv) - 2 :])
    for seed in range(1, seeds + 1):
        for row in ROWS[first:]:
            settings, begun = TUNED | row, time.process_time()
            actor, curve = trained(settings, seed)
            taken = round(time.process_time() - begun, 1)
            line = {"seed": seed, **row, "at the end": round(evaluated(settings, actor), 3), "CPU [s]": taken}
            with open(sys.argv[1], "a", encoding="utf-8") as file:
                file.write(json.dumps(line | {"curve": curve}) + "\n")
            print(line, flush=True)


main()
