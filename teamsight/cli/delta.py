"""``teamsight delta``: choose δ by simulation, or from recorded positions."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from teamsight.agents.presets import PRESETS
from teamsight.analysis.runs.limits import MOST_RUNS, Runs, Steps
from teamsight.cli.options import Agents, File, Folder, Risk, Works, Writes, check_apart
from teamsight.cli.world_settings import TaskOptions, Treatment
from teamsight.core.component import Allowed, Flag, Seed, declared
from teamsight.policies.registry import POLICIES
from teamsight.world.limits import SHAPES, Length, length

if TYPE_CHECKING:
    from teamsight.analysis.delta.report import DeltaReport

_RECORDED = ("window", "sort")
_OF_CMOMMT = ("robots", "targets", "radius", "policy", "preset")
_OF_TASK = ("task", "set", "treatment")
_SIMULATED = (*_OF_CMOMMT, *_OF_TASK, "runs", "steps", "seed", "workers")
# Recorded positions may be in any unit.
_SHORTEST, _LONGEST = 1e-15, 1e18


@dataclass(frozen=True, kw_only=True)
class DeltaSettings(TaskOptions, Works, Writes):
    """Options of ``teamsight delta``.

    Parameters
    ----------
    robots : int
        Number of robots.
    targets : int
        Number of targets; only policies that follow targets depend on it.
    radius : float
        Radius of the arena, in sensing ranges.
    policy : str
        Policy of the robots.
    preset : str, optional
        Values for what the paper leaves open. See docs/calibration.md.
    treatment : str
        The team of the task.
    awareness_range : float
        Distance within which two robots are neighbours.
    range_shape : {"disc", "square"}
        Shape of ranges.
    risk : float
        Maximum probability that any robot has more than δ neighbours during a run.
    runs : int, optional
        Number of runs to simulate.
    steps : int, optional
        Number of steps of each run.
    seed : int
        Seed of all runs.
    trajectories : Path, optional
        Read recorded positions instead of simulating: CSV or Parquet with the columns time, robot, x, y and, for
        several recordings, run.
    window : float, optional
        Duration for which the risk is stated, in the unit of the time column.
    sort : bool
        Sort recorded positions whose times are out of order.
    out : Path, optional
        Write tables, report and figure to this folder.
    """

    robots: Agents = 30
    targets: Agents = 15
    radius: Length = 5.0
    policy: Annotated[str, Allowed(choices=POLICIES)] = "random-walk"
    preset: Annotated[str | None, Allowed(choices=PRESETS)] = None
    treatment: Treatment = "explore"
    awareness_range: Annotated[
        float, Allowed(least=_SHORTEST, most=_LONGEST, shown="1; required with --trajectories")
    ] = 1.0
    range_shape: Annotated[str, Allowed(choices=SHAPES)] = "disc"
    risk: Risk = 0.01
    runs: Annotated[Runs | None, Allowed(shown="10 / risk")] = None
    steps: Annotated[Steps | None, Allowed(shown="600, or that of the task")] = None
    seed: Seed = 0
    trajectories: File | None = None
    window: Annotated[
        float | None,
        Allowed(least=_SHORTEST, most=_LONGEST,
                shown="a run if there are ten or more, otherwise 1/20 of the record"),
    ] = None  # fmt: skip
    sort: Flag = False
    out: Folder | None = None

    def check(self) -> None:
        """Refuse options of a simulation with recorded positions, and the other way round."""
        if self.trajectories:
            self.refuse(_SIMULATED, "cannot be combined with --trajectories, which determines it")
            if "awareness_range" not in self.given:
                raise ValueError("awareness_range: missing; give --awareness-range in the unit of the positions")
            return
        self.check_task()
        self.refuse(_RECORDED, "is for recorded positions, and needs --trajectories")
        length("awareness_range", self.awareness_range)
        self.check_size(self.length(), self.runs_needed(), awareness_range=self.awareness_range)

    def runs_needed(self) -> int:
        """Return the number of runs: the given one, or the 10 / risk that a risk needs.

        Raises
        ------
        ValueError
            If the risk needs too many runs.
        """
        needed = math.ceil(10 / self.risk) if self.runs is None else self.runs
        if needed > MOST_RUNS:
            raise ValueError(
                f"risk={self.risk:g}: needs 10 / risk = {needed:.1e} runs, at most {MOST_RUNS}; give a risk of "
                f"at least {10 / MOST_RUNS:g}, or --runs"
            )
        return needed

    def about(self) -> dict[str, Any]:
        """Return the settings that distinguish a report from others, fit for JSON."""
        unused = _SIMULATED if self.trajectories else (*_RECORDED, *(_OF_CMOMMT if self.task else _OF_TASK))
        found = self.values(without=(*unused, *declared(Works), "out", "force"))
        if not self.trajectories:
            found |= {"steps": self.length(), **({"set": self.parameters} if self.task else {}), **self.brought}
        return {name: str(value) if isinstance(value, Path) else value for name, value in found.items()}


def delta(settings: DeltaSettings) -> None:
    """Choose δ: how many neighbours does a robot have at most?

    Simulates a world many times, or reads recorded positions. Prints the smallest δ for which the probability that any
    robot has more than δ neighbours during a run is at most the risk, and confidence bounds of this probability. Also
    prints how many of these neighbours a ring of δ sectors shows, and the number of inputs that each degree of
    awareness adds.

    \b
    Examples:
      teamsight delta --robots 30 --radius 5
      teamsight delta --robots 30 --radius 2 --policy a-cmommt --risk 0.001
      teamsight delta --task cmommt --treatment skilled --set robots=30
      teamsight delta --trajectories trajectories.csv --awareness-range 1.0 \\
          --window 60
      teamsight delta --trajectories pursuit.parquet --awareness-range 3 \\
          --range-shape square
    """
    from teamsight.analysis.delta.report import check_report, files_in
    from teamsight.analysis.runs.files import prepare_folder
    from teamsight.cli.show import say, wide_console

    if settings.out:
        if settings.trajectories:
            for file in files_in(settings.out):
                check_apart("out", file, "trajectories", settings.trajectories)
        check_report(settings.out, {"settings": settings.about()}, force=settings.force)
        prepare_folder(settings.out)
    report = _recorded(settings) if settings.trajectories else _simulated(settings)
    files = []
    if settings.out:  # before anything is printed, since printing may fail
        files = report.save(settings.out, force=settings.force, settings=settings.about())
    wide_console().print(report, crop=False)
    if settings.out:
        say(f"{len(files)} files in {settings.out}")


def _simulated(settings: DeltaSettings) -> DeltaReport:
    from teamsight.analysis.delta.choose import choose_delta
    from teamsight.cli.show import working

    # The number of neighbours does not depend on the degree of awareness, only on how the policy moves the robots.
    world: Any = settings.values((*_OF_CMOMMT, "awareness_range", "range_shape")) | settings.world()
    how: dict[str, Any] = {}
    agents, steps, runs = settings.robots + settings.targets, settings.length(), settings.runs_needed()
    if settings.task:
        agents, world, how = settings.task_size(), settings.task, _of_task(settings)
    with working(settings, agent_steps=agents * steps * runs) as (watch, pool):
        return choose_delta(
            world, **how, runs=runs, steps=steps, risk=settings.risk, rng=settings.seed, pool=pool,
            progress=partial(watch, "simulating"),
        )  # fmt: skip


def _of_task(settings: DeltaSettings) -> dict[str, Any]:
    """Return the treatment and the scenario as `choose_delta` takes them; other parameters belong to the team."""
    task, given = settings.task_given(), settings.parameters
    scenario = {name: value for name, value in given.items() if name in task.scenario}
    if len(scenario) == len(given):
        return {"treatment": settings.treatment, "scenario": scenario}
    full = settings.model_of(settings.treatment).parameters(given)
    team = {name: value for name, value in full.items() if name not in task.scenario}
    return {"treatment": team, "scenario": scenario}


def _recorded(settings: DeltaSettings) -> DeltaReport:
    from teamsight.analysis.delta import TrajectoryWarning, delta_from_trajectories, read_trajectories
    from teamsight.cli.show import Watch

    assert settings.trajectories is not None
    with Watch() as watch, warnings.catch_warnings():
        # The report begins with it.
        warnings.simplefilter("ignore", TrajectoryWarning)
        progress = partial(watch, "reading")
        trajectories = read_trajectories(settings.trajectories, sort=settings.sort, progress=progress)
        return delta_from_trajectories(
            trajectories,
            settings.awareness_range,
            range_shape=settings.range_shape,
            risk=settings.risk,
            window=settings.window,
            progress=partial(watch, "counting"),
        )
