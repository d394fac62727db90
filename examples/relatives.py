"""A-CMOMMT, B-CMOMMT, P-CMOMMT and a random walk: what they observe, how evenly, and with how many robots.

``python examples/relatives.py [STUDY [REPLICATES]]`` makes the runs of `relatives.toml` or `crowds.toml`, and prints
each measure under the first policy, and the paired differences of the others from it.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path

import pandas as pd

from teamsight import Box, Robot, Study, Target, World
from teamsight.analysis.plot.markdown import table
from teamsight.analysis.runs.evenness import evenness
from teamsight.analysis.stats.paired import interval_of
from teamsight.policies import BCmommt
from teamsight.policies.handmade.b_cmommt import most_requests

TURNING = {"turn_probability": 0.05}
MEASURES, UNHELPFUL = ("observed_fraction", "spread", "entropy", "redundancy", "requests"), "BCmommt(answer=0)"


def boxed(robots: int, targets: int, policy: str, target_policy: str, rng: int) -> World:
    """Return a team in a box of 40 x 40 with ranges 5 and 6 and speeds 1 and 0.5; here the sensing range is 1."""
    world = World(Box(8, 8), rng=rng)
    team = world.add(Robot, robots, policy=policy, awareness="shared", awareness_range=1.2, speed=0.2)
    prey = world.add(Target, targets, policy=target_policy, policy_options=TURNING, speed=0.1, sensing_range=1.4)
    world.senses(team, prey)
    if target_policy == "evasive":
        world.senses(prey, team)
    return world


def measured(world: World, steps: int) -> dict[str, float | None]:
    """Run a world, and return the columns of its row; requests are the most that any robot has received at once."""
    found: dict[str, float | None] = evenness(world, steps)._asdict()
    robots = world.groups[0]
    asked = most_requests(robots.policy_state) if isinstance(robots.policy, BCmommt) else None
    return found | {"requests": None if asked is None else float(asked.max())}


def label(policy: str) -> str:
    """Return the name of a policy of a study, such as "BCmommt(answer=0)"."""
    options = json.loads(policy) if policy.startswith("{") else {"use": f":{policy}"}
    name = options.pop("use").partition(":")[2]
    return name + (f"({', '.join(f'{key}={value}' for key, value in options.items())})" if options else "")


def compared(runs: pd.DataFrame, measure: str, axes: list[str]) -> str:
    """Return a table with a row for each scenario, and a column for each policy."""
    scenario = [name for name in axes if name != "policy"]
    wide = runs.pivot(index=[*scenario, "replicate"], columns="policy", values=measure)
    wide = wide[[*dict.fromkeys(runs["policy"])]].rename(columns=label).dropna(axis=1, how="all")
    first, *others = wide.columns
    if measure != "requests":
        helped = {"help": wide["b-cmommt"] - wide[UNHELPFUL]} if UNHELPFUL in wide else {}
        wide = wide.assign(**{name: wide[name] - wide[first] for name in others}, **helped)
    rows: list[list[str]] = []
    for place, cells in wide.groupby(level=scenario, sort=False):
        rows.append([str(one).removesuffix(".0") for one in place])
        for name in wide.columns:
            mean, _, high = interval_of(cells[name].dropna().to_numpy())
            sign = "" if name == first or measure == "requests" else "+"
            rows[-1].append(f"{mean:{sign}.3f} ± {high - mean:.3f}".replace("-", "−"))
    return table([*scenario, *wide.columns], rows)


def main() -> None:
    file, *replicates = sys.argv[1:] or ["relatives.toml"]
    study = Study.from_file(Path(__file__).with_name(file))
    study = Study.from_dict(study.as_dict() | {"replicates": int(one) for one in replicates})
    with tempfile.TemporaryDirectory() as folder:
        runs = study.run(Path(folder) / "results", workers=2).frame
    print("\n\n".join(f"{measure}\n\n{compared(runs, measure, [*study.axes])}" for measure in MEASURES))


# Worker processes import this file.
if __name__ == "__main__":
    main()
