"""Record teams of other simulators under random actions: SISL pursuit of PettingZoo, or VMAS discovery.

python examples/other_simulators.py pursuit --agents 8 --runs 200 --out pursuit.parquet
teamsight delta --trajectories pursuit.parquet --awareness-range 3 --range-shape square --risk 0.05
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from importlib import import_module
from typing import Any

import numpy as np
import pandas as pd


def pursuit(agents: int, runs: int, steps: int, seed: int) -> Iterator[tuple[int, int, Any]]:
    """Yield run, time and the cells of all pursuers, shape (agents, 2); needs pettingzoo[sisl]."""
    try:
        make = import_module("pettingzoo.sisl.pursuit_v5").parallel_env
    except ModuleNotFoundError as error:
        # Before PettingZoo 1.27.
        if error.name != "pettingzoo.sisl.pursuit_v5":
            raise
        make = import_module("pettingzoo.sisl.pursuit_v4").parallel_env
    env = make(n_pursuers=agents, max_cycles=steps)
    noise = np.random.default_rng(seed)
    for run in range(runs):
        env.reset(seed=seed + run)
        pursuers = env.unwrapped.env.pursuers
        for time in range(steps + 1):
            yield run, time, np.array([one.current_position() for one in pursuers], float)
            if not env.agents:
                break
            env.step(dict(zip(env.agents, noise.integers(0, 5, len(env.agents)).tolist(), strict=True)))
    env.close()


def discovery(agents: int, runs: int, steps: int, seed: int) -> Iterator[tuple[int, int, Any]]:
    """Yield run, time and the positions of all agents, shape (agents, 2); needs vmas."""
    # Both lack types.
    torch, vmas = import_module("torch"), import_module("vmas")

    env = vmas.make_env("discovery", num_envs=runs, seed=seed, n_agents=agents)
    torch.manual_seed(seed)
    for time in range(steps + 1):
        places = torch.stack([agent.state.pos for agent in env.agents], dim=1).numpy()
        for run, place in enumerate(places):
            yield run, time, place.astype(float)
        env.step([2.0 * torch.rand(runs, 2) - 1.0 for _ in env.agents])


SIMULATORS = {"pursuit": (pursuit, 8, 500), "discovery": (discovery, 5, 200)}


def main(arguments: list[str] | None = None) -> None:
    """Record the runs and write their positions: columns run, time, robot, x, y."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("simulator", choices=SIMULATORS)
    parser.add_argument("--agents", type=int, help="number of robots; by default that of the simulator")
    parser.add_argument("--runs", type=int, default=200, help="number of recordings")
    parser.add_argument("--steps", type=int, help="steps of each; by default 500 of pursuit, 200 of discovery")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", required=True, help="the Parquet file to write")
    given = parser.parse_args(arguments)
    record, agents, steps = SIMULATORS[given.simulator]
    frames = list(record(given.agents or agents, given.runs, given.steps or steps, given.seed))
    places = np.concatenate([place for *_, place in frames])
    size = len(frames[0][2])
    run, time = (np.repeat([frame[column] for frame in frames], size) for column in (0, 1))
    table = {"run": run, "time": time.astype(float), "robot": np.tile(np.arange(size), len(frames))}
    pd.DataFrame({**table, "x": places[:, 0], "y": places[:, 1]}).to_parquet(given.out, index=False)
    print(f"{given.out}: {size} robots, {given.runs} runs, {len(frames):,} frames")


if __name__ == "__main__":
    main()
