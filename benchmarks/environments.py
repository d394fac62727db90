"""How fast environments for reinforcement learning are, beside VMAS and JaxMARL where they are installed.

python benchmarks/environments.py [--vmas PYTHON] [--jaxmarl PYTHON]

It measures CPU time on one core, and with two threads time on the clock: agent-steps a second of `vector_env`, with
ring observations of 10 robots and 15 targets; what more worlds, the first reset, the ends of episodes and memory cost;
and the time of a step of `parallel_env`. Every measurement of steps has ends of episodes, of 600 steps each.

With ``--vmas PYTHON``, an interpreter that can import vmas, also two scenarios of VMAS with as many agents:
"discovery", with as many targets, in which agents observe targets and teammates by lidars of 16 rays; and
"simple_spread", in which they observe the places of all others, without lidars. With ``--jaxmarl PYTHON`` that scenario
of JaxMARL too, whose steps JAX compiles, 100 in a call. Both are other tasks, with collisions and forces.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import time
import tracemalloc
from collections.abc import Callable, Iterator, Sequence
from itertools import cycle
from typing import Any

import numpy as np
from measure import Row, cpu_seconds, interleave, median, ratio

from teamsight.env import TeamVectorEnv, parallel_env, vector_env

ROBOTS, TARGETS, CYCLES = 10, 15, 600
WORLDS = (1, 64, 256, 1024, 4096)
OTHERS_WORLDS = (64, 1024, 8192)
#: Agent-steps that one measurement makes, so that each takes about a quarter of a second.
WORK = 400_000
LEAST, MOST = 300_000.0, 150.0

# Episodes of VMAS end together, and are begun anew by a reset of all worlds, whose share is added.
VMAS = """
import json, sys, time, torch, vmas
torch.set_num_threads(1)
robots, targets, cycles, found = int(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), {}
lidars = dict(n_targets=targets, n_lidar_rays_entities=16, n_lidar_rays_agents=16, use_agent_lidar=True,
              x_semidim=5, y_semidim=5, lidar_range=1.0)
for name, worlds in [(name, n) for name in ("discovery", "simple_spread") for n in json.loads(sys.argv[4])]:
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
        step, begin = (time.process_time() - begin) / steps, time.process_time()
        env.reset()
        taken.append(worlds * robots * cycles / (cycles * step + time.process_time() - begin))
    found[f"{name}, {worlds:,} worlds"] = taken
print(json.dumps(found))
"""
# JaxMARL begins an episode within the step that ends the one before.
JAXMARL = """
import json, os, sys, time
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
os.environ["JAX_PLATFORMS"] = "cpu"
import jax, jaxmarl
robots, targets, cycles, found = int(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), {}
env = jaxmarl.make("MPE_simple_spread_v3", num_agents=robots, num_landmarks=targets, max_steps=cycles)
spaces, steps = {agent: env.action_space(agent) for agent in env.agents}, 100
for worlds in json.loads(sys.argv[4]):
    def act(key):
        keys = jax.random.split(key, len(spaces))
        return {agent: space.sample(one) for (agent, space), one in zip(spaces.items(), keys)}
    actions = jax.vmap(act)(jax.random.split(jax.random.PRNGKey(1), worlds))
    def step(carried, key):
        states, _ = carried
        seen, states, rewards, dones, _ = jax.vmap(env.step)(jax.random.split(key, worlds), states, actions)
        # All that is returned has to be computed.
        return (states, seen), sum(rewards.values())
    run = jax.jit(lambda carried, key: jax.lax.scan(step, carried, jax.random.split(key, steps)))
    seen, states = jax.jit(jax.vmap(env.reset))(jax.random.split(jax.random.PRNGKey(0), worlds))
    carried = (states, seen)
    jax.block_until_ready(run(carried, jax.random.PRNGKey(2)))
    taken = []
    for _ in range(3):
        begin = time.process_time()
        (carried, rewards) = jax.block_until_ready(run(carried, jax.random.PRNGKey(3)))
        taken.append(worlds * robots * steps / (time.process_time() - begin))
    found[f"simple_spread, {worlds:,} worlds"] = taken
print(json.dumps(found))
"""


def measure_environments(rounds: int) -> list[Row]:
    """Measure agent-steps a second for several numbers of worlds, what else costs time, and a PettingZoo step.

    Parameters
    ----------
    rounds : int
        How often each is measured, in turn.
    """
    taken = interleave({**{f"{worlds}": _many(worlds) for worlds in WORLDS}, "one": _one()}, rounds)
    rows = [
        median(
            f"vector_env, {worlds:,} worlds", "agent-steps/s", [ROBOTS / one for one in taken[f"{worlds}"]],
            **({"least": LEAST} if worlds > 1 else {}),
        )
        for worlds in WORLDS
    ]  # fmt: skip
    rows.append(ratio("a world-step with 1,024 worlds beside one with 64", taken["1024"], taken["64"], most=1.2))
    rows += [*_ends(rounds), *_threads(rounds), *_first_reset(min(rounds, 3)), *_memory()]
    return [*rows, median("a step of parallel_env", "µs", taken["one"], most=MOST)]


def _made(worlds: int, **settings: Any) -> tuple[TeamVectorEnv, Iterator[Any]]:
    """Return an environment that has begun, and actions of several steps.

    With the same actions at each step robots would circle, and late in an episode there would be less to compute.
    """
    env = vector_env(worlds, robots=ROBOTS, targets=TARGETS, **({"max_cycles": CYCLES} | settings))
    env.reset(seed=0)
    return env, cycle(np.random.default_rng(0).uniform(-1, 1, (16, worlds, ROBOTS, 2)))


def _many(worlds: int) -> Callable[[], float]:
    """Return what measures the CPU time of a world-step; episodes end in every measurement."""
    # Of one world, an episode is shorter than a measurement.
    env, actions = _made(worlds, stagger=True)
    steps = max(WORK // (worlds * ROBOTS), 1)

    def run() -> float:
        return cpu_seconds(lambda: [env.step(next(actions)) for _ in range(steps)]) / (worlds * steps)

    run()
    return run


def _in_turn(kinds: dict[str, dict[str, Any]], worlds: int, clock: Callable[[], float]) -> dict[str, list[float]]:
    """Return the times of the steps of an episode of environments, step by step in turn: less disturbs one alone."""
    made = {name: _made(worlds, **settings) for name, settings in kinds.items()}
    taken: dict[str, list[float]] = {name: [] for name in kinds}
    for _ in range(CYCLES):
        for name, (env, actions) in made.items():
            given = next(actions)
            begin = clock()
            env.step(given)
            taken[name].append(clock() - begin)
    return taken


def _ends(rounds: int) -> list[Row]:
    """Measure what ends of episodes cost: one of each world in a measurement, beside none."""
    kinds: dict[str, dict[str, Any]] = {
        "none": {"copy": False, "max_cycles": 1_000_000_000}, "together": {"copy": False},
        "staggered": {"copy": False, "stagger": True},
    }  # fmt: skip
    found = [_in_turn(kinds, 1024, time.process_time) for _ in range(min(rounds, 3))]
    sums = {name: [sum(one[name]) for one in found] for name in kinds}
    return [
        ratio(f"steps with ends of episodes, {name}, beside none", sums[name], sums["none"], most=1.05)
        for name in ("together", "staggered")
    ]


def _threads(rounds: int) -> list[Row]:
    """Measure how much sooner two threads are done, on the clock; for this the machine has to be idle."""
    kinds: dict[str, dict[str, Any]] = {"one": {"copy": False}, "two": {"copy": False, "threads": 2}}
    found = [_in_turn(kinds, 1024, time.perf_counter) for _ in range(rounds)]
    # The least is the step that others disturbed least.
    least = {name: [min(one[name]) for one in found] for name in kinds}
    return [ratio("two threads, 1,024 worlds: times as fast", least["one"], least["two"], least=1.8)]


def _first_reset(rounds: int) -> list[Row]:
    """Measure the first reset of many worlds, of an environment that is new."""
    taken = []
    for _ in range(rounds):
        env = vector_env(4096, robots=ROBOTS, targets=TARGETS)
        taken.append(cpu_seconds(lambda env=env: env.reset(seed=0)))  # type: ignore[misc]
    return [median("the first reset of 4,096 worlds", "s", taken, most=2.0)]


def _memory() -> list[Row]:
    """Measure what a world more takes, and what of it is its state."""
    taken = []
    for worlds in (64, 1024):
        actions = np.zeros((worlds, ROBOTS, 2))
        tracemalloc.start()
        env = vector_env(worlds, robots=ROBOTS, targets=TARGETS, max_cycles=CYCLES)
        env.reset(seed=0)
        env.step(actions)
        taken.append(tracemalloc.get_traced_memory()[0] / 1024)
        tracemalloc.stop()
        block = env._batch._block
    assert block is not None
    state = block.rows[0].nbytes / 1024
    more = (taken[1] - taken[0]) / (1024 - 64)
    return [
        Row("the state of a world", "KiB", state, most=10.0),
        Row(f"all that a world takes, with a history of {CYCLES} steps", "KiB", more),
    ]


def _one() -> Callable[[], float]:
    """Return what measures a step of one world, with ends of episodes."""
    env, steps = parallel_env(robots=ROBOTS, targets=TARGETS, max_cycles=CYCLES), 2 * CYCLES
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    actions = [{agent: rng.uniform(-1, 1, 2).astype(np.float32) for agent in env.agents} for _ in range(steps)]

    def all_steps() -> None:
        for one in actions:
            env.step(one)
            if not env.agents:
                env.reset()

    def run() -> float:
        return 1e6 * cpu_seconds(all_steps) / steps

    run()
    return run


def measure_other(name: str, python: str, script: str) -> list[Row]:
    """Measure another simulator in the interpreter that has it; an error of that interpreter is raised."""
    numbers = [str(ROBOTS), str(TARGETS), str(CYCLES), json.dumps(OTHERS_WORLDS)]
    out = subprocess.run([python, "-c", script, *numbers], capture_output=True, text=True)
    if out.returncode:
        raise SystemExit(f"{python} cannot run {name}: {out.stderr.strip().splitlines()[-1]}")
    found = json.loads(out.stdout.strip().splitlines()[-1])
    return [median(f"{name}, {what}", "agent-steps/s", taken) for what, taken in found.items()]


def beside(rows: Sequence[Row], name: str) -> Row:
    """Return how many times as fast `vector_env` is as another simulator, the best of each."""
    best = {one: max(row.value for row in rows if row.name.startswith(f"{one}, ")) for one in ("vector_env", name)}
    return Row(f"vector_env beside {name}, the best of each", "times", best["vector_env"] / best[name])


def main() -> int:
    """Print the table; the exit status is 1 when a goal is missed."""
    from rich.console import Console
    from run import table_of

    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--vmas", metavar="PYTHON", help="an interpreter that can import vmas")
    parser.add_argument("--jaxmarl", metavar="PYTHON", help="an interpreter that can import jaxmarl")
    parser.add_argument("--rounds", type=int, default=5, help="how often each is measured; 5 by default")
    options = parser.parse_args()
    rows = measure_environments(options.rounds)
    for name, python, script in (("VMAS", options.vmas, VMAS), ("JaxMARL", options.jaxmarl, JAXMARL)):
        if python:
            rows += measure_other(name, python, script)
            rows.append(beside(rows, name))
    Console(width=130).print(table_of(rows))
    return 0 if all(row.is_met is not False for row in rows) else 1


if __name__ == "__main__":
    raise SystemExit(main())
