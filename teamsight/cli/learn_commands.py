"""The commands of ``teamsight learn`` and their options. Nothing slow is imported here; see `teamsight.cli.main`."""

from __future__ import annotations

from typing import Any

import click

from teamsight.cli.options import Commands, text


@click.group(cls=Commands, short_help="Explore once, and learn from it whatever is asked for.")
def learn() -> None:
    """Explore once, keep what the robots met, and learn from it whatever is asked for.

    \b
      teamsight learn explore --out pairs.safetensors     600 pairs, as the paper has them
      teamsight learn evaluate pairs.safetensors          what robots observe that learn from them
      teamsight learn figure --out curves                 learners under each degree, from more and more samples
    """


@learn.command(short_help="Let robots explore, and keep what they met.")
@text("--out", metavar="FILE", required=True, help="Where to write the memory.")
@text("--robots", default=5, metavar="INTEGER", help="Robots that explore each world.")
@text("--targets", default=10, metavar="INTEGER", help="Targets in each world.")
@text("--radius", default=3.0, metavar="NUMBER", help="Radius of the arena, in sensing ranges.")
@text("--steps", default=120, metavar="INTEGER", help="Steps in each world.")
@text("--runs", default=1, metavar="INTEGER", help="Worlds; each gives robots × steps pairs.")
@text("--awareness", default="ring", metavar="NAME", help="What situations show: none, ring, pairwise, shared.")
@text("--delta", metavar="INTEGER", help="Sectors of the ring, at most 360.  [default: 16]")
@text("--policy", default="random-walk", metavar="NAME", help="What the robots do meanwhile.")
@text("--distance", default="random", metavar="NAME", help="How far random walkers go: a random share, or full.")
@text("--robot-speed", default=0.1, metavar="NUMBER", help="The farthest that exploring robots go a step.")
@text("--seed", default=0, metavar="INTEGER", help="Seed of the exploration.")
@text("--workers", default=1, metavar="INTEGER", help="Processes.")
@click.option("--merge", multiple=True, metavar="FILE", help="Put the pairs of this memory in too; may be repeated.")
@click.option("--append", is_flag=True, help="Add to the pairs that FILE holds.")
@click.option("--force", is_flag=True, help="Replace what stands at FILE, whatever it is.")
def explore(**given: Any) -> None:
    """Let robots explore, and keep situation, action and what followed as a lazy memory.

    The random walk turns any way and goes any distance within its speed, as in the paper. When a long exploration is
    interrupted, what is done stays beside FILE, and the same command goes on from there. A file of other settings is
    never replaced without --force.

    \b
    Examples:
      teamsight learn explore --out pairs.safetensors
      teamsight learn explore --out many.safetensors --runs 1000 --workers 2
      teamsight learn explore --out pairs.safetensors --seed 1 --append
      teamsight learn explore --out shared.safetensors --awareness shared --runs 16 --robots 8
    """
    from teamsight.cli import learn_explore as command

    command.execute(**given)


@learn.command(short_help="Learn from a memory, and tell what robots then observe.")
@click.argument("memory", metavar="MEMORY")
@text("--learner", default="lazy", metavar="NAME", help="lazy, pessimistic, sheppard, tabular or linear.")
@text("--reward", default="own", metavar="NAME", help="Whose targets count: own, team, alone (nobody else's); or keep.")
@text("--k", metavar="INTEGER", help="Pairs that match a situation.  [default: the learner's]")
@text("--discount", default=0.7, metavar="NUMBER", help="Discount factor γ, in [0, 1].")
@text("--robots", metavar="INTEGER", help="Robots of the team.  [default: as many as explored]")
@text("--targets", default=15, metavar="INTEGER", help="Targets to observe.")
@text("--radius", default=3.0, metavar="NUMBER", help="Radius of the arena, in sensing ranges.")
@text("--runs", default=30, metavar="INTEGER", help="Worlds.")
@text("--steps", default=600, metavar="INTEGER", help="Steps in each world.")
@text("--seed", default=0, metavar="INTEGER", help="Seed of the worlds; none of them was explored, whatever its seed.")
@text("--workers", default=1, metavar="INTEGER", help="Processes.")
@text("--sample", metavar="INTEGER", help="Learn from so many of the pairs, drawn by the seed.  [default: all]")
@text("--save", metavar="FILE", help="Write a row for each policy and world as Parquet.")
@click.option("--force", is_flag=True, help="Replace what stands there, whatever it is.")
def evaluate(**given: Any) -> None:
    """Learn from a memory, and tell what robots then observe.

    Beside the learner stand, on the same worlds: the collective one, which knows no teammates and learns from the
    robot's own inputs of the same pairs; A-CMOMMT; the policy that ships as learned; and a random walk. Robots are as
    fast and as far-sighted as they were when they explored.

    \b
    Examples:
      teamsight learn evaluate pairs.safetensors
      teamsight learn evaluate pairs.safetensors --learner tabular --reward team --robots 10 --radius 4
      teamsight learn evaluate many.safetensors --sample 30000
      teamsight learn evaluate pairs.safetensors --k 20 --discount 0.9 --runs 100 --save runs.parquet
    """
    from teamsight.cli import learn_evaluate as command

    command.execute(**given)


@learn.command(short_help="Draw learning curves of learners and degrees of awareness.")
@text("--out", default="results", metavar="FOLDER", help="Where to write.")
@text("--learners", default="lazy,tabular,linear", metavar="NAMES", help="Which learners, with commas between them.")
@text("--samples", metavar="NUMBERS", help="Numbers of pairs.  [default: 150,300,… doubled up to 38400]")
@text("--memories", metavar="INTEGER", help="Explorations that each curve is the mean of.  [default: 10]")
@text("--worlds", metavar="INTEGER", help="Worlds on which each is put to the test.  [default: 4]")
@text("--reward", default="own", metavar="NAME", help="Whose targets count: own, team, alone (nobody else's); or keep.")
@text("--k", metavar="INTEGER", help="Pairs that match a situation.  [default: the learner's]")
@text("--discount", default=0.7, metavar="NUMBER", help="Discount factor γ, in [0, 1].")
@text("--robots", default=5, metavar="INTEGER", help="Robots, exploring and put to the test.")
@text("--targets", default=15, metavar="INTEGER", help="Targets to observe.")
@text("--radius", default=3.0, metavar="NUMBER", help="Radius of the arena, in sensing ranges.")
@text("--steps", default=600, metavar="INTEGER", help="Steps of each test.")
@text("--seed", default=0, metavar="INTEGER", help="Seed of everything.")
@text("--workers", metavar="INTEGER", help="Processes.  [default: the cores of this machine]")
@click.option("--quick", is_flag=True, help="Unless given: samples 150,600,2400, memories 3, worlds 2.")
@click.option("--force", is_flag=True, help="Replace curves of other settings.")
def figure(**given: Any) -> None:
    """Draw learning curves: each learner under each degree of awareness, from equal numbers of samples.

    Writes learning-curves.png, a table of every test, one of the curves' points and one of what awareness adds. Ctrl-C
    keeps what is done in FOLDER; the same command goes on from there. All of it takes some eight
    minutes on two cores, with --quick seconds. Figure 11 of the paper is `teamsight reproduce 11`.

    \b
    Examples:
      teamsight learn figure
      teamsight learn figure --quick --out quick
      teamsight learn figure --learners lazy,pessimistic,linear --reward team --robots 8
    """
    from teamsight.cli import learn_figure as command

    command.execute(**given)
