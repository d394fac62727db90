"""Train a policy that all robots share by PPO, in one file as CleanRL has it; then try it on other seeds.

It needs teamsight[env,rl]: python examples/train_ppo.py [STEPS [SEEDS [many]]], with the number of agent-steps of each
training; "many" trains on teams and arenas of several sizes. It draws train_ppo.png, and writes the weights of the
first seed, trained.npz, which ``Trained("trained.npz")`` runs in any world without torch.
"""

import sys
import time
from itertools import pairwise
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import numpy.typing as npt
import torch
from torch import nn
from torch.distributions import Normal

from teamsight import CMOMMT
from teamsight.env import vector_env
from teamsight.policies import Trained

ONE: list[dict[str, Any]] = [{"robots": 5, "targets": 10}]
MANY: list[dict[str, Any]] = [
    *ONE, {"robots": 10, "targets": 15}, {"robots": 2, "targets": 6, "radius": 3.5}, {"robots": 10, "targets": 10},
    {"robots": 20, "targets": 30, "radius": 7.0}, {"robots": 20, "targets": 20}, {"robots": 5, "targets": 20},
]  # fmt: skip
# Robots of all worlds of a scenario, steps of a rollout, how often it is used, and agent-steps of a minibatch. Where
# steps are many, to use each once is as good, and faster.
ROBOTS, ROLLOUT, EPOCHS, MINIBATCH = (640, 64, 1, 10240) if "many" in sys.argv else (320, 64, 4, 2560)
DISCOUNT, LAMBDA, CLIP, RATE, HIDDEN, TRIALS = 0.95, 0.95, 0.2, 1e-3, 64, 100
Network = Any  # torch has types only if it is installed


def network(inputs: int, outputs: int, last: float) -> Network:
    """Return a network of two hidden layers of rectified linear units, of orthogonal weights."""
    sizes = (inputs, HIDDEN, HIDDEN, outputs)
    linear = [nn.Linear(*pair) for pair in pairwise(sizes)]
    for layer, gain in zip(linear, (2**0.5, 2**0.5, last), strict=True):
        nn.init.orthogonal_(layer.weight, gain)
        nn.init.zeros_(layer.bias)
    return nn.Sequential(linear[0], nn.ReLU(), linear[1], nn.ReLU(), linear[2])


class Teams:
    """The robots of several vector environments in a row, shape (robots, …)."""

    def __init__(self, scenarios: list[dict[str, Any]], seed: int) -> None:
        # First episodes end at different steps, so that a batch has situations of all ages.
        self.envs = [vector_env(ROBOTS // one["robots"], stagger=True, **one) for one in scenarios]
        self.ends = np.cumsum([env.worlds * env.robots for env in self.envs])
        self.first = self._row([env.reset(seed * 1_000_000)[0] for env in self.envs])

    def _row(self, parts: list[npt.NDArray[Any]]) -> Any:
        return torch.from_numpy(np.concatenate([one.reshape(-1, one.shape[-1]) for one in parts]))

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, float]:
        """Return observations, rewards, ends of episodes, last observations of those, and the share observed."""
        # A way that is longer than 1 keeps its direction.
        way = (actions / actions.norm(dim=-1, keepdim=True).clamp(min=1)).numpy()
        pairs = zip(self.envs, np.split(way, self.ends[:-1]), strict=True)
        steps = [env.step(part.reshape(env.worlds, env.robots, 2)) for env, part in pairs]
        rewards = np.concatenate([one.rewards.ravel() for one in steps])
        over = [np.repeat(one.terminated | one.truncated, one.rewards.shape[1]) for one in steps]
        final = self._row([one.info.get("final_observations", one.observations) for one in steps])
        observed = float(np.mean([one.info["observed"].mean() for one in steps]))
        row = self._row([one.observations for one in steps])
        return row, torch.from_numpy(rewards).float(), torch.from_numpy(np.concatenate(over)).float(), final, observed


def train(scenarios: list[dict[str, Any]], total: int, seed: int) -> tuple[Network, list[tuple[int, float]]]:
    """Return the network that acts, and the share observed in each rollout by the number of agent-steps."""
    torch.manual_seed(seed)
    teams, begun = Teams(scenarios, seed), time.process_time()
    seen = teams.first
    size, inputs = seen.shape
    actor, critic = network(inputs, 2, 0.01), network(inputs, 1, 1.0)
    spread = nn.Parameter(torch.full((2,), -0.7))
    parameters = [*actor.parameters(), *critic.parameters(), spread]
    optimizer = torch.optim.Adam(parameters, lr=RATE, eps=1e-5)
    situations, actions = torch.zeros(ROLLOUT, size, inputs), torch.zeros(ROLLOUT, size, 2)
    chances, values, rewards, after, over = torch.zeros(5, ROLLOUT, size)
    curve: list[tuple[int, float]] = []
    updates = max(total // (ROLLOUT * size), 1)
    for update in range(updates):
        optimizer.param_groups[0]["lr"] = RATE * (1 - update / updates)
        observed = 0.0
        with torch.no_grad():
            for t in range(ROLLOUT):
                policy = Normal(actor(seen), spread.exp())
                situations[t], actions[t] = seen, policy.sample()
                chances[t], values[t] = policy.log_prob(actions[t]).sum(-1), critic(seen)[:, 0]
                seen, rewards[t], over[t], final, now = teams.step(actions[t])
                # An episode that ends by its length goes on for the value of its last situation.
                after[t] = critic(final)[:, 0] if over[t].any() else 0.0
                observed += now / ROLLOUT
            following, advantage = critic(seen)[:, 0], torch.zeros(ROLLOUT, size)
            carried = torch.zeros(size)
            for t in reversed(range(ROLLOUT)):
                following = torch.where(over[t] > 0, after[t], following)
                error = rewards[t] + DISCOUNT * following - values[t]
                advantage[t] = carried = error + DISCOUNT * LAMBDA * (1 - over[t]) * carried
                following = values[t]
            rows = [one.flatten(0, 1) for one in (situations, actions, chances, advantage, advantage + values)]
        for _ in range(EPOCHS):
            for picked in torch.randperm(ROLLOUT * size).split(MINIBATCH):
                situation, action, chance, gain, wanted = (one[picked] for one in rows)
                gain = (gain - gain.mean()) / (gain.std() + 1e-8)
                ratio = (Normal(actor(situation), spread.exp()).log_prob(action).sum(-1) - chance).exp()
                gains = torch.min(gain * ratio, gain * ratio.clamp(1 - CLIP, 1 + CLIP))
                loss = 0.25 * (critic(situation)[:, 0] - wanted).square().mean() - gains.mean()
                optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(parameters, 0.5)
                optimizer.step()
        curve.append(((update + 1) * ROLLOUT * size, observed))
        if update % max(updates // 20, 1) == 0 or update == updates - 1:
            taken = time.process_time() - begun
            print(f"seed {seed}: {curve[-1][0]:,} agent-steps, {observed:.3f} observed, {taken:.0f} s of CPU time")
    return actor, curve


def save(actor: Network, path: str) -> None:
    """Write the weights as `Trained` reads them."""
    layers = {f"{name.split('.')[1]}_{int(name[0]) // 2}": one.numpy() for name, one in actor.state_dict().items()}
    np.savez(path, degree="ring", encoding="nearness", **layers)


def observed(policy: Any, awareness: str) -> npt.NDArray[np.float64]:
    """Return the share that a team observes in each of the trials, on seeds that no training has."""
    models = [CMOMMT(**ONE[0], policy=policy, awareness=awareness, seed=10**9 + seed) for seed in range(TRIALS)]
    for model in models:
        model.run(600)
    return np.array([model.observed_fraction for model in models])


def main() -> None:
    torch.set_num_threads(1)
    given = [int(one) for one in sys.argv[1:3]]
    total, seeds = [*given, *(2_000_000, 1)[len(given) :]]
    others = {"a-cmommt": "pairwise", "evolved": "ring", "random-walk": "none"}
    levels = {name: observed(name, awareness) for name, awareness in others.items()}
    for (name, level), line in zip(levels.items(), ("-", "--", ":"), strict=True):
        print(f"{name}: {level.mean():.3f} observed")
        plt.axhline(float(level.mean()), color="grey", linestyle=line, label=name)
    plt.xlabel("agent-steps"), plt.ylabel("observed fraction"), plt.ylim(0, 0.7)
    for seed in range(1, seeds + 1):
        actor, curve = train(MANY if "many" in sys.argv else ONE, total, seed)
        save(actor, path := "trained.npz" if seed == 1 else f"trained-{seed}.npz")
        found = observed(Trained(path), "ring")
        gain, shown = found - levels["a-cmommt"], "PPO, while it trains" if seed == 1 else None
        error = 1.984 * gain.std(ddof=1) / TRIALS**0.5
        print(f"seed {seed}: {found.mean():.3f} on other seeds, {gain.mean():+.3f} ± {error:.3f} (95 %) to A-CMOMMT")
        plt.plot(*zip(*curve, strict=True), color="C0", alpha=0.7, label=shown)
        plt.legend(loc="lower right")
        plt.savefig("train_ppo.png", dpi=100)


main()
