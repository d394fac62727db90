"""How fast environments for reinforcement learning are, beside VMAS's simulator where it is installed.

python benchmarks/environments.py [--vmas PYTHON]

It measures CPU time on one core: agent-steps a second of `vector_env`, with ring observations of 10 robots and 15
targets, and the time of a step of `parallel_env`. With ``--vmas PYTHON``, an interpreter that can import vmas, also two
scenarios of VMAS with as many agents: "discovery", with as many targets, in which agents observe targets and teammates
by lidars of 16 rays; and "simple_spread", in which they observe the places of all others, without lidars.
"""

from __future__ import annotations

import argparse
import json
import subprocess
from collections.abc import Callable

import numpy as np
from measure import Row, cpu_seconds, interleave, median

from teamsight.env import parallel_env, vector_env

ROBOTS, TARGETS = 10, 15
WORLDS = (1, 32, 256, 1024)
#: VMAS gains from more worlds.
VMAS_WORLDS = (*WORLDS, 8192)
#: Agent-steps that one measurement makes, so that each takes about a quarter of a second.
WORK = 200_000
LEAST, MOST = 300_000.0, 150.0

VMAS = """
import json, sys, time, torch, vmas
torch.set_num_threads(1)
robots, targets, found = int(sys.argv[1]), int(sys.argv[2]), {}
lidars = dict(n_targets=targets, n_lidar_rays_entities=16, n_lidar_rays_agents=16, use_agent_lidar=True,
              x_semidim=5, y_semidim=5, lidar_range=1.0)
for name, worlds in [(name, n) for name in ("discovery", "simple_spread") for n in json.loads(sys.argv[3])]:
    more = lidars if name == "discovery" else {}
    env = vmas.make_env(name, num_envs=worlds, device="cpu", continuous_actions=True, n_agents=robots, **more)
    env.reset(seed=0)
    actions = [torch.rand(worlds, 2) * 2 - 1 for _ in range(robots)]
    env.step(actions)
    taken = []
    for _ in range(3):
        begin, steps = time.process_time(), 0
        while time.process_time() - begin < 1.0:
            env.step(actions)
            steps += 1
        taken.append(worlds * robots * steps / (time.process_time() - begin))
    found[f"{name}, {worlds:,} worlds"] = taken
print(json.dumps(found))
"""


def measure_environments(rounds: int) -> list[Row]:
    """Measure agent-steps a second for several numbers of worlds, and the time of a PettingZoo step.

    Parameters
    ----------
    rounds : int
        How often each is measured, in turn.
    """
    taken = interleave({**{f"{worlds}": _many(worlds) for worlds in WORLDS}, "one": _one()}, rounds)
    rows = [
        median(
            f"vector_env, {worlds:,} worlds", "agent-steps/s", taken[f"{worlds}"],
            **({"least": LEAST} if worlds > 1 else {}),
        )
        for worlds in WORLDS
    ]  # fmt: skip
    return [*rows, median("a step of parallel_env", "µs", taken["one"], most=MOST)]


def _many(worlds: int) -> Callable[[], float]:
    env = vector_env(worlds, robots=ROBOTS, targets=TARGETS, max_cycles=600)
    env.reset(seed=0)
    actions = np.random.default_rng(0).uniform(-1, 1, (worlds, ROBOTS, 2))
    steps = max(WORK // (worlds * ROBOTS), 1)

    def run() -> float:
        return worlds * ROBOTS * steps / cpu_seconds(lambda: [env.step(actions) for _ in range(steps)])

    run()
    return run


def _one() -> Callable[[], float]:
    env, steps = parallel_env(robots=ROBOTS, targets=TARGETS, max_cycles=1_000_000), 2_000
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    actions = [{agent: rng.uniform(-1, 1, 2).astype(np.float32) for agent in env.agents} for _ in range(steps)]

    def run() -> float:
        return 1e6 * cpu_seconds(lambda: [env.step(one) for one in actions]) / steps

    run()
    return run


def measure_vmas(python: str) -> list[Row]:
    """Measure VMAS in the interpreter that has it; an error of that interpreter is raised."""
    command = [python, "-c", VMAS, str(ROBOTS), str(TARGETS), json.dumps(VMAS_WORLDS)]
    out = subprocess.run(command, capture_output=True, text=True)
    if out.returncode:
        raise SystemExit(f"{python} cannot run VMAS: {out.stderr.strip().splitlines()[-1]}")
    found = json.loads(out.stdout.strip().splitlines()[-1])
    return [median(f"VMAS, {name}", "agent-steps/s", taken) for name, taken in found.items()]


def main() -> int:
    """Print the table; the exit status is 1 when a goal is missed."""
    from rich.console import Console
    from run import table_of

    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--vmas", metavar="PYTHON", help="an interpreter that can import vmas")
    parser.add_argument("--rounds", type=int, default=5, help="how often each is measured; 5 by default")
    options = parser.parse_args()
    rows = measure_environments(options.rounds)
    if options.vmas:
        rows += measure_vmas(options.vmas)
        best = {name: max(row.value for row in rows if row.name.startswith(name)) for name in ("vector_env", "VMAS")}
        rows.append(Row("vector_env beside VMAS, the best of each", "times", best["vector_env"] / best["VMAS"]))
    Console(width=130).print(table_of(rows))
    return 0 if all(row.is_met is not False for row in rows) else 1


if __name__ == "__main__":
    raise SystemExit(main())
