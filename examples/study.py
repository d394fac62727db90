"""A study with a model, a measure and a policy of its own: `study.toml` names what this file defines.

The same from the command line: `teamsight sweep examples/study.toml --out results`.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from teamsight import CMOMMT, Failures, Study
from teamsight.policies import Policy

FILE = Path(__file__).with_name("study.toml")


def failing(robots: int, mean_time: float, policy: Policy, rng: int) -> CMOMMT:
    """Return a team whose robots fail, and are repaired after 20 ticks on average."""
    return CMOMMT(robots=robots, targets=15, radius=5.0, policy=policy, events=Failures(mean_time, 20), rng=rng)


def final(world: CMOMMT, steps: int) -> dict[str, float]:
    """Run a world, and return the columns of its row."""
    world.run(steps)
    return {"observed_fraction": world.observed_fraction, "failures": int((world.events["what"] == "failed").sum())}


def main() -> None:
    study = Study.from_file(FILE)
    # A folder that is kept makes a second call continue, or add what is new in the file.
    with tempfile.TemporaryDirectory() as folder:
        results = study.run(Path(folder) / "results", workers=2)
        print(results)
        table = results.summary("observed_fraction")
        table["policy"] = ["A-CMOMMT" if "use" in str(one) else one for one in table["policy"]]
        print(table[table["robots"] == 10][["policy", "mean_time", "n", "mean", "low", "high"]].to_string(index=False))


# Worker processes import this file; without this line each of them would start the study again.
if __name__ == "__main__":
    main()
