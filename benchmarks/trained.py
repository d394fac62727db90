"""Compare trained networks with A-CMOMMT on teams and arenas of several sizes, paired by worlds.

python benchmarks/trained.py SEED RUNS POLICY …: each policy is the file of a network, or a name such as ppo or evolved,
under "ring"; A-CMOMMT is under "pairwise". The worlds have the seeds from SEED on. It prints the mean over all teams,
and for each team the difference from A-CMOMMT with its 95 % interval.
"""

import sys
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight import CMOMMT
from teamsight.policies import Trained

TEAMS: list[dict[str, Any]] = [
    {"robots": 5, "targets": 10}, {"robots": 10, "targets": 15}, {"robots": 2, "targets": 6, "radius": 3.5},
    {"robots": 10, "targets": 10}, {"robots": 20, "targets": 30, "radius": 7.0}, {"robots": 20, "targets": 20},
    {"robots": 5, "targets": 20},
]  # fmt: skip


def observed(policy: Any, awareness: str, first: int, runs: int) -> npt.NDArray[np.float64]:
    """Return what each team observes in each run, shape (teams, runs)."""
    found = np.zeros((len(TEAMS), runs))
    for team, settings in enumerate(TEAMS):
        for run in range(runs):
            model = CMOMMT(**settings, policy=policy, awareness=awareness, seed=first + run)
            model.run(600)
            found[team, run] = model.observed_fraction
    return found


def main() -> None:
    first, runs = int(sys.argv[1]), int(sys.argv[2])
    base = observed("a-cmommt", "pairwise", first, runs)
    print(f"a-cmommt: {base.mean():.3f}", *(f"{share:.3f}" for share in base.mean(axis=1)))
    for given in sys.argv[3:]:
        found = observed(Trained(given) if given.endswith(".npz") else given, "ring", first, runs)
        gain = found - base
        error = 1.96 * gain.std(axis=1, ddof=1) / runs**0.5
        shown = [f"{one:+.3f} ± {spread:.3f}" for one, spread in zip(gain.mean(axis=1), error, strict=True)]
        print(f"{given}: {found.mean():.3f},", ", ".join(shown))


main()
