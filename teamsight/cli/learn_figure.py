"""``teamsight learn figure``: from how many transitions does awareness pay?"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from teamsight.analysis.runs.limits import Runs, Steps
from teamsight.cli import limits
from teamsight.cli.errors import when_stopped
from teamsight.cli.options import Works, Writes
from teamsight.cli.values import Agents, Folder, Learner, Matches, Reward
from teamsight.core.component import Allowed, Count, Flag, Probability, Seed
from teamsight.world.limits import Length

if TYPE_CHECKING:
    import pandas as pd

    from teamsight.analysis.learning.curves import Curves
    from teamsight.analysis.runs.checkpoint import Checkpoint

_FILES = ("learning-curves.parquet", "learning-curves-gains.parquet", "learning-curves-crossings.parquet")
_PICTURE = "learning-curves.png"
# What --quick sets where the option is not given.
_QUICK: dict[str, Any] = {"samples": (150, 600, 2400), "memories": 4, "worlds": 1}
# Rows of the table of tests.
_MOST_ROWS = 2e6
# Robots and steps of each explored world, as in the paper.
_EXPLORERS, _EXPLORED_STEPS = 5, 120


@dataclass(frozen=True, kw_only=True)
class FigureSettings(Works, Writes):
    """Options of ``teamsight learn figure``.

    Parameters
    ----------
    out : Path
        Folder for the results.
    learners : sequence of str
        Learners, separated by commas.
    samples : sequence of int
        Numbers of transitions to learn from, separated by commas.
    memories : int
        Number of explorations over which each curve is averaged.
    worlds : int
        Number of worlds in which each learner is tested, for each exploration and scenario.
    reward : str
        Reward of a transition. See docs/learning.md.
    k : int, optional
        Number k of nearest transitions that a learner uses.
    discount : float
        Discount factor γ, in [0, 1].
    robots : sequence of int
        Numbers of robots when tested, separated by commas.
    targets : int
        Number of targets.
    radius : sequence of float
        Radii of the arena when tested, in sensing ranges, separated by commas.
    steps : int
        Number of steps of each test.
    seed : int
        Seed of all explorations and tests.
    quick : bool
        Use --samples 150,600,2400 --memories 4 --worlds 1 where these are not given.
    """

    out: Folder = Path("results")
    learners: Annotated[tuple[Learner, ...], Allowed()] = ("lazy", "tabular", "linear", "regression")
    samples: Annotated[
        tuple[Count, ...], Allowed(most=100, is_sorted=True, shown="40,75,150,… doubled up to 38400")
    ] = (40, 75, 150, 300, 600, 1200, 2400, 4800, 9600, 19200, 38400)
    memories: Runs = 24
    worlds: Runs = 3
    reward: Reward = "keep"
    k: Matches = None
    discount: Probability = 0.7
    robots: Annotated[tuple[Count, ...], Allowed(most=6, is_sorted=True)] = (5, 10, 20)
    targets: Agents = 15
    radius: Annotated[tuple[Length, ...], Allowed(most=6, is_sorted=True)] = (3.0, 5.0)
    steps: Steps = 600
    seed: Seed = 9000
    quick: Flag = False

    def check(self) -> None:
        """Set what ``--quick`` sets, and refuse curves that are too much work."""
        if self.quick:
            for name, value in _QUICK.items():
                if name not in self.given:
                    object.__setattr__(self, name, value)
        explored = -(-max(self.samples) // (_EXPLORERS * _EXPLORED_STEPS))
        limits.check_transitions(_EXPLORERS, _EXPLORED_STEPS, explored, ("ring",), 16)
        scenarios = len(self.robots) * len(self.radius)
        tests = float(self.memories) * self.worlds * scenarios * (2 * len(self.learners) * len(self.samples) + 2)
        if tests > _MOST_ROWS:
            raise ValueError(
                f"memories={self.memories}, worlds={self.worlds}, {scenarios} scenarios, {len(self.samples)} samples: "
                f"makes {tests:.1e} rows, at most {_MOST_ROWS:g}; reduce one of them"
            )
        for radius in self.radius:
            limits.check_worlds(max(self.robots), self.targets, radius, self.steps, int(tests))


def figure(settings: FigureSettings) -> None:
    """Draw learning curves: the gain from awareness.

    Each learner learns from the same transitions with awareness, Θ(1), and without, Θ(0). Writes learning-curves.png
    and three tables: every test, the gain from awareness, and for each learner and scenario the number of transitions
    from which awareness pays. An interrupted command keeps what is finished in FOLDER, and the same command continues
    from there. It takes about four minutes on two idle cores; with --quick, seconds. Figure 11 of the paper is
    `teamsight reproduce 11`.

    \b
    Examples:
      teamsight learn figure
      teamsight learn figure --quick --out quick
      teamsight learn figure --learners lazy,pessimistic,regression \\
          --reward team --robots 8 --radius 2,4,8
    """
    from teamsight import __version__
    from teamsight.analysis.learning.curve_figure import draw
    from teamsight.analysis.learning.curve_points import awareness_gains, crossings
    from teamsight.analysis.learning.curves import curve_jobs, make_curves
    from teamsight.analysis.learning.learners import check_objective
    from teamsight.analysis.runs import files
    from teamsight.analysis.runs.checkpoint import Checkpoint
    from teamsight.cli.show import say, working

    curves = curves_of(settings)
    given = settings.discount if "discount" in settings.given else None
    check_objective(curves.learners, curves.reward, curves.k, max(curves.samples), discount=given)
    folder = files.prepare_folder(settings.out)
    about = {"curves": curves.conditions()}
    for name in _FILES:
        files.check_replaceable(folder / name, about, force=settings.force)
    # The figure has no settings; they are those of the tables beside it.
    files.check_replaceable(folder / _PICTURE, force=settings.force)
    checkpoint = Checkpoint(folder / "learning-curves.checkpoint")
    checkpoint.check()
    began = time.perf_counter()
    with when_stopped(lambda: _kept(curves, checkpoint)):
        with working(settings.workers) as (watch, pool):
            table = make_curves(curves, pool, checkpoint=checkpoint, progress=partial(watch, "learning"))
        gains = awareness_gains(table)
        crossing = crossings(gains)
        for name, found in zip(_FILES, (table, gains, crossing), strict=True):
            files.write_table(folder / name, found, about | {"version": __version__}, force=settings.force)
        files.write_bytes(folder / _PICTURE, draw(gains, crossing, curves), force=settings.force)
    checkpoint.forget(job.key for job in curve_jobs(curves))
    _show(gains, crossing)
    say(f"learning curves in {folder} after {time.perf_counter() - began:.0f} s")


def curves_of(settings: FigureSettings) -> Curves:
    """Return the curves that the settings describe."""
    from teamsight.analysis.learning.curves import Curves

    return Curves(**settings.values(without=("out", "workers", "force", "quick")))


def _kept(curves: Curves, checkpoint: Checkpoint) -> str:
    from teamsight.analysis.learning.curves import curve_jobs
    from teamsight.cli.show import plural

    jobs = curve_jobs(curves)
    if kept := checkpoint.count(job.key for job in jobs):
        place = f"{kept} of {plural(len(jobs), 'part')} are kept in {checkpoint.path}"
        return f"{place}; the same command continues from there"
    return "nothing was kept, since no part of the curves was finished"


def _show(gains: pd.DataFrame, crossing: pd.DataFrame) -> None:
    """Print for each learner, and for the best, from how many transitions awareness pays: on the mean, and in each."""
    from teamsight.analysis.learning.curve_points import mean_gains, pays_from
    from teamsight.cli.show import interval, say

    means = mean_gains(gains).set_index(["learner", "transitions"])
    for row in mean_gains(crossing).to_dict("records"):
        last = means.loc[(row["learner"], row["largest"])]
        gain = interval(last["gain"], last["low"], last["high"], "+.1f")
        say(
            f"{row['learner']}, mean of all scenarios: awareness {pays_from(row['crossing'], row['largest'])}; "
            f"Θ(1) minus Θ(0) from {row['largest']:,}: {gain} points"
        )
        single = crossing[(crossing["learner"] == row["learner"]) & crossing["robots"].notna()]
        for one in single.to_dict("records"):
            say(f"  N = {one['robots']:.0f}, R = {one['radius']:g}: {pays_from(one['crossing'], one['largest'])}")
