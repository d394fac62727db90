"""``teamsight ceilings``: what could a team observe at most, and how far do policies go?"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Annotated, Literal

from teamsight.analysis.runs.limits import Runs, Steps
from teamsight.cli.options import Agents, Folder, Works, Writes
from teamsight.core.component import Allowed, Seed
from teamsight.world.limits import Length

_Planner = Literal["sharing", "informed", "clairvoyant"]


@dataclass(frozen=True, kw_only=True)
class CeilingSettings(Works, Writes):
    """Options of ``teamsight ceilings``.

    Parameters
    ----------
    policies : tuple of str
        Policies to compare, with options after a colon; the first is the reference.
    ceilings : tuple of str
        Teams that know more.
    robots : tuple of int
        Numbers of robots.
    targets : int
        Number of targets.
    radius : tuple of float
        Radii of the arena, in sensing ranges.
    runs : int
        Number of runs of each team in each cell.
    steps : int
        Number of steps of each run.
    seed : int
        Seed of all runs.
    out : Path, optional
        Folder for the table of all runs and a figure.
    """

    policies: Annotated[
        tuple[str, ...], Allowed(metavar="[POLICY]...", is_argument=True, is_repeated=True, shown="a-cmommt, …")
    ] = ("a-cmommt", "random-walk", "evolved")
    ceilings: Annotated[tuple[_Planner, ...], Allowed()] = ("sharing", "informed", "clairvoyant")
    robots: tuple[Agents, ...] = (10,)
    targets: Agents = 15
    radius: tuple[Length, ...] = (5.0,)
    runs: Runs = 5
    steps: Steps = 600
    seed: Seed = 0
    out: Annotated[Folder | None, Allowed(shown="none")] = None  # type: ignore[assignment]


def ceilings(settings: CeilingSettings) -> None:
    """Compare policies with what is possible.

    On the same worlds as the policies run teams that know more than robots can: "sharing", a central planner that knows
    what some robot senses; "informed", where all targets are; "clairvoyant", where they will be. "teleport" is the
    share of the targets that the robots could cover if they were anywhere at once: no team passes it. With several
    numbers of robots or radii the lines are means over all cells. With --out all runs are kept as they end, and the
    same command continues.

    \b
    Examples:
      teamsight ceilings
      teamsight ceilings a-cmommt:gain=4,idle=wander evolved \\
          --robots 5,10 --radius 3,5,8 --out results
    """
    from teamsight.analysis.ceilings import OBSERVED, RESULTS, compare, draw, share_text, standings
    from teamsight.analysis.plot.style import to_picture
    from teamsight.analysis.runs.checkpoint import Checkpoint
    from teamsight.analysis.runs.files import Content, check_results, prepare_folder, write_results
    from teamsight.cli.show import interval, kept_in, say, show_table, working

    teams = [*settings.policies, *settings.ceilings]
    cells = [(robots, settings.targets, radius) for robots, radius in product(settings.robots, settings.radius)]
    folder = prepare_folder(settings.out) if settings.out else None
    checkpoint = Checkpoint(folder / f"{RESULTS}.checkpoint", OBSERVED) if folder else None
    about = {
        "teams": teams, "robots": list(settings.robots), "targets": settings.targets, "radius": list(settings.radius),
        "runs": settings.runs, "steps": settings.steps, "root": settings.seed,
    }  # fmt: skip
    picture = f"images/{RESULTS}.png"
    if folder:
        check_results(folder, (f"{RESULTS}.parquet", picture), about, checkpoint=checkpoint, force=settings.force)
    kept = (lambda: kept_in(checkpoint.path, checkpoint.count())) if checkpoint else (lambda: "nothing was kept")
    with working(settings, kept) as (watch, pool):
        table = compare(
            cells, teams, runs=settings.runs, steps=settings.steps, seed=settings.seed, pool=pool,
            progress=partial(watch, "running"), checkpoint=checkpoint,
        )  # fmt: skip
    first = teams[0]
    rows = [
        (
            one.team, interval(one.observed._asdict(), ".1f"),
            "" if one.team == first else interval(one.more._asdict(), "+.1f"),
            share_text(one.share),
        )
        for one in standings(table, overall=True)
    ]  # fmt: skip
    show_table(rows, ("team", "observed [%]", f"more than {first}", "of the way"))
    if folder and checkpoint:
        prepare_folder(folder / "images")
        contents: dict[str, Content] = {f"{RESULTS}.parquet": table, picture: to_picture(draw(table))}
        write_results(folder, contents, about, force=settings.force)
        checkpoint.forget()
        say(f"table and figure in {folder}")
