"""``teamsight ceilings``: what could a team observe at most, and how far do policies go?"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Annotated, Literal

from teamsight.analysis.runs.limits import Runs, Steps
from teamsight.cli.options import Agents, Folder, Works, Writes
from teamsight.core.component import Allowed, Seed
from teamsight.world.limits import Length

if TYPE_CHECKING:
    import pandas as pd

_Planner = Literal["sharing", "informed", "clairvoyant"]


@dataclass(frozen=True, kw_only=True)
class CeilingSettings(Works, Writes):
    """Options of ``teamsight ceilings``.

    Parameters
    ----------
    policies : tuple of str
        Policies to compare, also as module:Class or file.py:Class, with options after a colon; the first is the
        reference.
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
      teamsight ceilings evolved examples/enter.py:Chase:gain=0.5
    """
    from teamsight.analysis.ceilings import OBSERVED, RESULTS, compare, draw
    from teamsight.analysis.plot.style import to_picture
    from teamsight.analysis.runs.checkpoint import Checkpoint
    from teamsight.analysis.runs.files import Content, check_results, prepare_folder, write_results
    from teamsight.cli.show import kept_in, say, working

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
    _show(table, teams[0])
    if folder and checkpoint:
        prepare_folder(folder / "images")
        contents: dict[str, Content] = {f"{RESULTS}.parquet": table, picture: to_picture(draw(table))}
        write_results(folder, contents, about, force=settings.force)
        checkpoint.forget()
        say(f"table and figure in {folder}")


def _show(table: pd.DataFrame, first: str) -> None:
    """Print what each team observes, and how far the first one is from what nobody can pass."""
    from teamsight.analysis.ceilings import CEILING, share_text, standings
    from teamsight.cli.show import interval, say, show_table

    found = standings(table, overall=True)
    most = [one.observed.mean for one in found if one.team == "teleport"]
    at_most = "".join(f"; no team observes more than {mean:.1f} %" for mean in most)
    say(f"{first} observes {interval(found[0].observed._asdict(), '.1f')} % of the targets{at_most}")
    rows = []
    for one in found:
        more = "" if one.team == first else interval(one.more._asdict(), "+.1f")
        # A hyphen stands before numbers that a program may read.
        share, _, bounds = share_text(one.share).replace("−", "-").partition(" (")
        # Options can be broken between two.
        team = one.team.replace(",", ", ")
        rows.append((team, interval(one.observed._asdict(), ".1f"), more, share, f"({bounds}" * bool(bounds)))
    titles = ("team", "observed [%]", "more [points]", "of the way", "its interval")[: 5 if most else 3]
    show_table([row[: len(titles)] for row in rows], titles, spare=(*range(4, len(titles)), 2))
    way = f", 'of the way' from it to {CEILING}" * bool(most)
    say(f"means with 95 % intervals; 'more' is than {first}{way}")
