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
from teamsight.analysis.runs.run_many import evenness
from teamsight.analysis.stats.paired import interval_of
from teamsight.policies import BCmommt, Policy
from teamsight.policies.handmade.b_cmommt import most_requests

MEASURES, UNHELPFUL = ("observed_fraction", "spread", "entropy", "redundancy", "requests"), "BCmommt(answer=0)"


def boxed(robots: int, targets: int, policy: Policy, target_policy: Policy, rng: int) -> World:
    """Return a team in a box of 40 x 40 with ranges 5 and 6 and speeds 1 and 0.5; here the sensing range is 1."""
    world = World(Box(8, 8), rng=rng)
    team = world.add(Robot, robots, policy=policy, awareness="shared", awareness_range=1.2, speed=0.2)
    prey = world.add(Target, targets, policy=target_policy, speed=0.1, sensing_range=1.4)
    world.senses(team, prey)
    world.senses(prey, team)
    return world


def measured(world: World, steps: int) -> dict[str, float | None]:
    """Run a world, and return the columns of its row; requests are the most that any robot has received at once."""
    found: dict[str, float | None] = evenness(world, steps)._asdict()
    team = world.groups[0]
    return found | {"requests": most_requests(team.policy_state).max() if isinstance(team.policy, BCmommt) else None}


def label(policy: str) -> str:
    """Return the name of a policy of a study, such as "BCmommt(answer=0)"."""
    options = json.loads(policy) if policy.startswith("{") else {"use": f":{policy}"}
    name = options.pop("use").partition(":")[2]
    return f"{name}({', '.join(f'{key}={value}' for key, value in options.items())})".removesuffix("()")


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
        rows.append([label(str(one)).removesuffix(".0") for one in place])
        for name in wide.columns:
            mean, _, high = interval_of(cells[name].dropna().to_numpy())
            sign = "" if name == first or measure == "requests" else "+"
            rows[-1].append(f"{mean:{sign}.3f} ± {high - mean:.3f}".replace("-", "−"))
    return table([*scenario, *wide.columns], rows)


def main() -> None:
    file, *replicates = sys.argv[1:] or ["relatives.toml"]
    study = Study.from_file(Path(__file__).with_name(file))
    study = Study.from_dict(study.as_dict() | dict(zip(["replicates"], map(int, replicates), strict=False)))
    with tempfile.TemporaryDirectory() as folder:
        runs = study.run(Path(folder) / "results", workers=2).frame
    print("\n\n".join(f"{measure}\n\n{compared(runs, measure, [*study.axes])}" for measure in MEASURES))


if __name__ == "__main__":
    main()
