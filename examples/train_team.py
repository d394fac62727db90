"""Train a policy that all robots share, by an evolution strategy on many worlds at once; then try it on other seeds.

It needs teamsight[env,evolve]: python examples/train_team.py [GENERATIONS]. It draws train_team.png. The policy gives
16 directions scores from what is sensed around each, with the same weights for all, and goes where the scores pull.
"""

import sys

import cma
import matplotlib.pyplot as plt
import numpy as np
import numpy.typing as npt

from teamsight import CMOMMT
from teamsight.env import TeamVectorEnv, vector_env

Floats = npt.NDArray[np.float64]
SECTORS, WORLDS, STEPS, TRIALS = 16, 4, 300, 100
DIRECTIONS = np.exp(2j * np.pi * np.arange(SECTORS) / SECTORS)
# For each direction, the sectors in the order of their angle from it; to both sides they weigh the same.
AROUND = (np.arange(SECTORS)[:, None] + np.arange(SECTORS)) % SECTORS
SIDE = np.minimum(np.arange(SECTORS), SECTORS - np.arange(SECTORS))
SIZE = 3 * (SECTORS // 2 + 1)


def decide(weights: Floats, observations: npt.NDArray[np.float32]) -> Floats:
    """Return actions, shape (candidates, …, 2), for weights (candidates, SIZE), observations (candidates, …, 32)."""
    of_targets, of_teammates, ahead = np.split(weights, 3, axis=-1)
    near = observations.reshape(len(weights), -1, 2 * SECTORS)
    scores = near[..., :SECTORS] @ of_targets[:, SIDE][:, AROUND].swapaxes(1, 2)
    scores += near[..., SECTORS:] @ of_teammates[:, SIDE][:, AROUND].swapaxes(1, 2)
    pull = (scores + ahead[:, None, SIDE]) @ DIRECTIONS
    actions = np.stack([np.angle(pull) / np.pi, 2 * np.tanh(np.abs(pull)) - 1], axis=-1)
    return actions.reshape(*observations.shape[:-1], 2)


def returns(env: TeamVectorEnv, weights: Floats, seeds: range) -> Floats:
    """Return the mean observed fraction of each world, shape (candidates, seeds); all have the same seeds."""
    shape, total = (len(weights), len(seeds), env.robots, -1), np.zeros(env.worlds)
    observations, _ = env.reset([*seeds] * len(weights))
    for _ in range(env.max_cycles):
        actions = decide(weights, observations.reshape(shape))
        observations, _, _, _, info = env.step(actions.reshape(env.worlds, env.robots, 2))
        total += info["observed"]
    return np.asarray(total.reshape(len(weights), len(seeds)) / env.max_cycles)


def train(generations: int) -> tuple[Floats, list[float]]:
    """Return the mean of the last distribution of weights, and the mean return of each generation."""
    strategy = cma.CMAEvolutionStrategy(np.zeros(SIZE), 0.3, {"seed": 1, "verbose": -9})
    env = vector_env(strategy.popsize * WORLDS, max_cycles=STEPS, autoreset="disabled", action="continuous")
    curve: list[float] = []
    for first in range(0, generations * WORLDS, WORLDS):
        candidates = strategy.ask()
        # New worlds in each generation, so that none is learned by heart.
        found = returns(env, np.array(candidates), range(first, first + WORLDS)).mean(axis=1)
        strategy.tell(candidates, -found)
        curve.append(float(found.mean()))
    return strategy.result.xfavorite, curve


def main() -> None:
    weights, curve = train(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
    seeds = range(1_000_000, 1_000_000 + TRIALS)
    env = vector_env(TRIALS, max_cycles=600, autoreset="disabled", action="continuous")
    learned = returns(env, weights[None], seeds)[0]
    for name in ("random-walk", "a-cmommt"):
        models = [CMOMMT(policy=name, awareness="ring", seed=seed) for seed in seeds]
        for model in models:
            model.run(600)
        other = np.array([model.observed_fraction for model in models])
        gain, error = np.mean(learned - other), np.std(learned - other, ddof=1) / TRIALS**0.5
        print(f"{name}: {np.mean(other):.3f}; learned {learned.mean():.3f}, {gain:+.3f} ± {1.984 * error:.3f} (95 %)")
        plt.axhline(float(np.mean(other)), color="grey", linestyle=":" if name == "a-cmommt" else "--", label=name)
    plt.plot(curve, label="learned, mean of a generation")
    plt.xlabel("generation"), plt.ylabel("observed fraction"), plt.legend(loc=(0.4, 0.1))
    plt.savefig("train_team.png", dpi=100)


main()
