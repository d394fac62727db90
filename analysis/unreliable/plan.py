"""The sweeps over failure rates and sensing periods: which worlds are run, and what is measured in them."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import pandas as pd

from teamsight.analysis.runs.checkpoint import JSON, Checkpoint, Codec
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.seeds import model_seed, root
from teamsight.analysis.runs.simulate import Progress, run_all
from teamsight.analysis.runs.workers import WorkerPool

if TYPE_CHECKING:
    from teamsight.agents.model import World

#: Numbers of robots and arena radii: crowded, medium and sparse. They were chosen before any result.
SCENARIOS: tuple[tuple[int, float], ...] = ((10, 3.0), (10, 5.0), (20, 5.0))
TARGETS = 15
#: Shares of the time in which a robot works, MTTF / (MTTF + MTTR).
AVAILABILITIES = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5)
#: Sensing periods [ticks].
PERIODS = (1, 2, 5, 10, 20, 50)


class Team(NamedTuple):
    """A policy and its degree of awareness."""

    policy: str
    awareness: str

    def __str__(self) -> str:
        return f"{self.policy} ({self.awareness})"


#: For each policy the teams that are compared: with information about teammates, and without. The evolved policy needs
#: it, so it is compared with A-CMOMMT without.
TEAMS: Mapping[str, tuple[Team, Team]] = MappingProxyType(
    {
        "a-cmommt": (Team("a-cmommt", "pairwise"), Team("a-cmommt", "none")),
        "evolved": (Team("evolved", "ring"), Team("a-cmommt", "none")),
    }
)
#: The sweeps, and the column with their values.
SWEEPS: Mapping[str, str] = MappingProxyType({"failures": "availability", "periods": "period"})


class Measured(NamedTuple):
    """Result of a run."""

    observed_fraction: float
    max_neighbours: int
    mean_neighbours: float


def _measured_of(content: bytes) -> Measured:
    fraction, largest, mean = json.loads(content)
    if (type(fraction), type(largest), type(mean)) != (float, int, float):
        raise TypeError("not a result")
    return Measured(fraction, largest, mean)


#: Conversion of results for a checkpoint.
MEASURED = Codec(JSON.encode, _measured_of)


def measure(world: World, steps: int) -> Measured:
    """Run a world and return what was observed, and the largest and the mean number of neighbours."""
    world.run(steps)
    recording = world.recording
    return Measured(float(world.observed_fraction), int(world.max_neighbours), float(recording.mean_neighbours))


@dataclass(frozen=True)
class Plan:
    """What to simulate.

    Parameters
    ----------
    runs : int
        Runs of each condition. Run r of every condition of a scenario has the same seed, so all differences are paired.
    steps : int
        Steps of each run.
    seed : int
        Root seed.
    repair : float
        Mean time to repair [ticks].
    policies : tuple of str
        Names in `TEAMS`.
    availabilities, periods : tuple of float
        The values of the two sweeps.
    scenarios : tuple of (int, float)
        Numbers of robots and radii.
    """

    runs: int = 60
    steps: int = 600
    seed: int = root("unreliable")
    repair: float = 50.0
    policies: tuple[str, ...] = tuple(TEAMS)
    availabilities: tuple[float, ...] = AVAILABILITIES
    periods: tuple[float, ...] = PERIODS
    scenarios: tuple[tuple[int, float], ...] = SCENARIOS

    def conditions(self) -> dict[str, Any]:
        """Return the settings, fit for JSON."""
        found: dict[str, Any] = json.loads(json.dumps(asdict(self)))
        return found

    def planned(self) -> Iterator[tuple[dict[str, Any], Run]]:
        """Yield each run with the columns of the table that identify it.

        The conditions without failures and with period 1 are the same runs, which are made once; so are those of one
        team that several are compared with.
        """
        for sweep, value, changed in self._treatments():
            for policy in self.policies:
                for aware, team in zip((True, False), TEAMS[policy], strict=True):
                    for robots, radius in self.scenarios:
                        world = {"robots": robots, "targets": TARGETS, "radius": radius}
                        parameters = {**world, **team._asdict(), **changed}
                        for replicate in range(self.runs):
                            seed = model_seed(self.seed, replicate, robots, TARGETS, radius)
                            named = {"sweep": sweep, "value": value, "policy": policy, "aware": aware}
                            named |= {**world, "replicate": replicate, "seed": seed}
                            yield named, Run(parameters, seed, self.steps, measure)

    def _treatments(self) -> Iterator[tuple[str, float, dict[str, Any]]]:
        """Yield the sweep, its value and the parameters of CMOMMT that it changes."""
        from teamsight import Cycle
        from teamsight.agents.components import Failures

        for value in self.availabilities:
            # One object for all runs, by which they recognise that they can share a world.
            failures = Failures(time_to_failure(value, self.repair), self.repair) if value < 1.0 else None
            yield "failures", value, {} if failures is None else {"events": failures}
        for period in self.periods:
            # Robots are not in step, as in a team without a common clock.
            yield "periods", float(period), {} if period == 1 else {"cycle": Cycle(period, phase="random")}


def time_to_failure(availability: float, repair: float) -> float:
    """Return the mean time to failure [ticks] that gives an availability below 1 with a mean time to repair."""
    return repair * availability / (1.0 - availability)


def simulate(
    plan: Plan,
    pool: WorkerPool | None = None,
    *,
    progress: Progress = lambda done, total: None,
    checkpoint: Checkpoint | None = None,
) -> pd.DataFrame:
    """Run all worlds of a plan.

    Parameters
    ----------
    plan : Plan
        What to simulate.
    pool, progress, checkpoint
        See `run_all`.

    Returns
    -------
    DataFrame
        One row a run: sweep, value (the availability, or the period [ticks]), policy, aware (whether it is the first of
        the policy's `TEAMS`), robots, targets, radius, replicate, seed, and the fields of `Measured`.
    """
    planned = list(plan.planned())
    measured = run_all([run for _, run in planned], pool, progress=progress, checkpoint=checkpoint)
    return pd.DataFrame([named | one._asdict() for (named, _), one in zip(planned, measured, strict=True)])
