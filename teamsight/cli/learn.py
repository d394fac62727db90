"""``teamsight learn``: explore once, and learn from the recorded transitions."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

from teamsight.agents import settings as cmommt
from teamsight.analysis.learning.plans import (
    EXPLORED,
    Curves,
    Diagnosis,
    Evaluation,
    Exploring,
    Imagining,
    LearnerName,
    Matches,
    RewardName,
    Training,
)
from teamsight.cli.options import Agents, Divides, File, Folder, Format, TaskName, Works, Writes, check_apart
from teamsight.cli.world_settings import TaskOptions, check_sectors, check_worlds
from teamsight.core.component import Allowed, Flag, Probability
from teamsight.policies.registry import POLICIES
from teamsight.world.limits import Length

if TYPE_CHECKING:
    import pandas as pd

    from teamsight.analysis.learning.explore import Exploration
    from teamsight.policies.memory import LazyMemory
    from teamsight.tasks.task import Task

# What --quick sets where the option is not given.
_QUICK: dict[str, Any] = {"samples": (150, 600, 2400), "memories": 4, "worlds": 1}


@dataclass(frozen=True, kw_only=True)
class ExploreSettings(TaskOptions, Exploring, cmommt.Settings, Works, Writes):
    """Options of ``teamsight learn explore``.

    Parameters
    ----------
    out : Path
        Where to write the memory.
    distance : str
        Distance that random walkers move per step, as a fraction of their speed.
    merge : sequence of Path
        Add the transitions of this memory; may be repeated.
    append : bool
        Add to the transitions that FILE holds.
    """

    out: File
    robots: Agents = EXPLORED["robots"]
    targets: Agents = EXPLORED["targets"]
    radius: Length = EXPLORED["radius"]
    policy: Annotated[str, Allowed(choices=POLICIES)] = "random-walk"
    distance: Literal["random", "full"] = "random"
    merge: Annotated[tuple[File, ...], Allowed(is_repeated=True)] = ()
    append: Flag = False

    @classmethod
    def world_options(cls) -> frozenset[str]:
        """Return the options that are parameters of a world; the degree of awareness is that of the situations."""
        return super().world_options() - {"awareness", "delta"}

    def check(self) -> None:
        """Refuse options that do not fit together, and explorations that are too large."""
        self.check_task(others=("distance",))
        check_sectors(self)
        if self.policy != "random-walk":
            self.refuse(("distance",), f"applies to the policy random-walk only, and policy={self.policy}")
        elif not self.task and "random_distance" in self.world().get("policy_options", {}):
            self.refuse(("distance",), "is given as the option random_distance of the policy too")
        self.check_size(self.steps, self.runs, degrees=(str(self.awareness),))

    def plan(self) -> Exploration:
        """Return the exploration that the options describe."""
        from teamsight.agents.awareness.registry import awareness_named
        from teamsight.analysis.learning.explore import Exploration

        world = self.parameters if self.task else self.world()
        if not self.task and self.policy == "random-walk":
            options = {"random_distance": self.distance == "random", **world.get("policy_options", {})}
            world |= {"policy": self.policy, "policy_options": options}
        awareness = world.pop("awareness", self.awareness)
        if isinstance(awareness, str):
            awareness = awareness_named(awareness, {"delta": self.delta})
        return Exploration(
            task=self.task, world=world, awareness=awareness, steps=self.steps, runs=self.runs, seed=self.seed
        )


def explore(settings: ExploreSettings) -> None:
    """Let robots explore, and record their transitions.

    A transition is a situation, the action taken and the next situation. The random walk turns in any direction and
    moves any distance within its speed, as in the paper. A long exploration that is interrupted keeps its finished
    parts beside FILE, and the same command continues from there. A memory of other settings in FILE is replaced only
    with --force.

    \b
    Examples:
      teamsight learn explore --out memory.safetensors
      teamsight learn explore --out many.safetensors --runs 1000 --workers 2
      teamsight learn explore --out memory.safetensors --seed 1 --append
      teamsight learn explore --task cmommt --robots 8 --out eight.safetensors
      teamsight learn explore --out shared.safetensors --awareness shared \\
          --runs 16 --robots 8
    """
    from teamsight.analysis.learning import explore as exploring
    from teamsight.analysis.runs.checkpoint import Checkpoint
    from teamsight.analysis.runs.files import prepare_folder
    from teamsight.cli.show import kept_in, say, working
    from teamsight.policies.memory import LazyMemory

    plan, out = settings.plan(), settings.out
    checkpoint = Checkpoint(out.with_name(out.name + ".checkpoint"), exploring.TRANSITIONS) if plan.is_long else None
    if checkpoint is not None:
        checkpoint.check()
    sources = [LazyMemory.load(path) for path in settings.merge]
    held = _held(settings)
    prepare_folder(out.parent)
    if held is not None:
        wanted = [plan.settings(), *(one for source in sources for one in exploring.explorations_of(source))]
        if all(one in exploring.explorations_of(held) for one in wanted):
            _describe(out, held, "already holds these transitions: ")
            return
        if not settings.append:
            raise ValueError(
                f"out={out}: holds {exploring.unlike(held, plan)}; give --append to add to it, --force to replace it, "
                "or another file"
            )
        sources.insert(0, held)
    sources = exploring.distinct(sources)
    exploring.check_alike(plan, sources)

    def kept() -> str:
        if checkpoint is None or not (runs := checkpoint.count(plan.keys)):
            return "nothing was kept, since no part of the exploration was finished"
        count = f"{runs * plan.robots * plan.steps} of {plan.transitions}"
        return kept_in(checkpoint.path, count, "transitions")

    # A short exploration is made in this process.
    with working(settings, kept, agent_steps=math.inf if plan.is_long else 0) as (watch, pool):
        if not any(plan.settings() in exploring.explorations_of(source) for source in sources):
            found = exploring.explore(plan, pool=pool, checkpoint=checkpoint, progress=partial(watch, "exploring"))
            sources.append(found)
        memory = sources[0].merge(*sources[1:])
        memory.save(out, force=settings.force)
    if checkpoint is not None:
        checkpoint.forget(plan.keys)
    _describe(out, memory)
    for name, values in exploring.differing(memory).items():
        say(f"note: {name} differs between the explorations: {', '.join(map(str, values))}")


def _held(settings: ExploreSettings) -> LazyMemory | None:
    """Return the memory that the output file holds, or None if there is none or it is to be replaced."""
    from teamsight.core.files import check_place
    from teamsight.policies.memory import LazyMemory

    if settings.out.is_dir():
        raise ValueError(f"out={settings.out}: is a folder; give a file, such as {settings.out / 'memory.safetensors'}")
    if not check_place(settings.out) or (settings.force and not settings.append):
        return None
    try:
        return LazyMemory.load(settings.out)
    except ValueError as error:
        if settings.force:
            return None
        # The message says what is wrong with the file, but here the cure is another.
        wrong = str(error).partition(";")[0]
        raise ValueError(f"{wrong}; give --force to replace it, or another file") from error


def _describe(path: Path, memory: LazyMemory, before: str = "") -> None:
    from teamsight.cli.show import plural, say

    size = path.stat().st_size / 1e6
    say(
        f"{path}: {before}{plural(len(memory), 'transition')}, {memory.own} + {memory.added} inputs, {size:.1f} MB, "
        f"digest {memory.digest}"
    )


@dataclass(frozen=True, kw_only=True)
class EvaluateSettings(TaskOptions, Evaluation, Works, Writes):
    """Options of ``teamsight learn evaluate``.

    Parameters
    ----------
    memory : Path
        Memory to learn from.
    learner : str
        What learns.
    reward : str, optional
        Reward of a transition. See docs/learning.md.
    k : int, optional
        Number k of nearest transitions that a learner uses.
    discount : float, optional
        Discount factor γ, in [0, 1].
    task : str, optional
        Task in whose worlds robots are evaluated.
    set : mapping of str to object
        A value of the scenario of the task. May be given several times.
    robots : int, optional
        Number of robots.
    targets : int, optional
        Number of targets.
    radius : float, optional
        Radius of the arena, in sensing ranges.
    sample : int, optional
        Number of transitions to learn from, drawn at random with --seed.
    save : Path, optional
        Write one row per policy and world to this Parquet file.
    """

    memory: Annotated[File, Allowed(metavar="MEMORY", is_argument=True)]
    learner: LearnerName = "regression"
    reward: Annotated[
        RewardName | None,
        Allowed(shown="keep for regression, own for others; interaction with a task other than cmommt"),
    ] = None
    k: Matches = None
    discount: Annotated[Probability | None, Allowed(shown="0.7; regression uses none")] = None
    task: Annotated[TaskName | None, Allowed(shown="that of the exploration")] = None
    robots: Annotated[Agents | None, Allowed(shown="as many as explored")] = None
    targets: Annotated[Agents | None, Allowed(shown="15")] = None
    radius: Annotated[Length | None, Allowed(shown="3")] = None
    sample: Annotated[int | None, Allowed(least=1, shown="all")] = None
    save: File | None = None


def evaluate(settings: EvaluateSettings) -> None:
    """Learn from a memory, and measure how much robots then observe, or achieve in another task.

    Compares in the same worlds: the cooperative learner, which uses all inputs; the collective learner, which uses the
    robot's own inputs of the same transitions; the team of the task with skill, and the one that explores. In CMOMMT:
    teams in which the force of free targets is set by hand and nothing is learned; A-CMOMMT; the policy 'evolved'; and
    a random walk. The scenario is that of the exploration, if that was of the same task.

    \b
    Examples:
      teamsight learn evaluate memory.safetensors
      teamsight learn evaluate memory.safetensors --learner tabular \\
          --reward team --robots 10 --radius 4
      teamsight learn evaluate many.safetensors --learner lazy --sample 30000
      teamsight learn evaluate memory.safetensors --learner lazy --k 20 \\
          --discount 0.9 --runs 100 --save runs.parquet
      teamsight learn evaluate pursuit.safetensors --task pursuit \\
          --set prey=1 --runs 100
    """
    from teamsight.analysis.runs.files import check_results, prepare_folder, write_results
    from teamsight.cli.show import say

    case, save = _case(settings), settings.save
    about = case.about(settings)
    if save:
        prepare_folder(save.parent)
        check_results(save.parent, [save.name], about, force=settings.force)
    table, taken = _evaluated(settings, case)
    if save:  # before anything is printed, since printing may fail
        write_results(save.parent, {save.name: table}, about, force=settings.force)
    _show_evaluation(settings, case, table)
    say(taken)
    if save:
        say(f"every run in {save}")


class _Case(NamedTuple):
    """What is evaluated, and in which worlds."""

    memory: LazyMemory
    task: Task
    scenario: Mapping[str, Any]
    steps: int
    reward: str

    def about(self, settings: EvaluateSettings) -> dict[str, Any]:
        """Return what a file of the results holds."""
        return settings.values(("learner", "k", "discount", "sample", "runs", "seed")) | {
            "reward": self.reward, "steps": self.steps, "task": self.task.name, "scenario": self.scenario,
            "memory": self.memory.digest, "explored": dict(self.memory.settings),
        }  # fmt: skip


def _case(settings: EvaluateSettings) -> _Case:
    """Return the case that the settings describe; refuse what does not go together, and worlds that are too large."""
    from teamsight.analysis.learning import evaluation
    from teamsight.analysis.learning.learners import check_objective, default_reward
    from teamsight.tasks.named import task_of

    learner = settings.learner
    if settings.save:
        check_apart("save", settings.save, "memory", settings.memory)
    check = partial(check_objective, (learner,), settings.reward, settings.k, discount=settings.discount)
    check()
    memory = _sampled(settings)
    check(len(memory))
    task = task_of(settings.task or memory.settings.get("task") or evaluation.CMOMMT)
    scenario = evaluation.scenario_of(memory, task, settings.parameters)
    steps = settings.steps or task.steps
    check_worlds(
        scenario[task.size], scenario.get("targets", 0), scenario.get("radius", 1.0), steps, settings.runs
    )  # fmt: skip
    usual = "interaction" if task.name != evaluation.CMOMMT and learner != "sheppard" else default_reward(learner)
    return _Case(memory, task, scenario, steps, settings.reward or usual)


def _evaluated(settings: EvaluateSettings, case: _Case) -> tuple[pd.DataFrame, str]:
    """Return one row for each policy and world, and how long they took."""
    from teamsight.analysis.learning import evaluation
    from teamsight.analysis.learning.plans import Objective
    from teamsight.analysis.learning.registry import REWARDS
    from teamsight.cli.show import working

    memory, task, scenario, steps, reward = case
    objective = Objective(REWARDS[reward], settings.k, settings.discount)
    with working(settings, agent_steps=10.0 * scenario[task.size] * steps * settings.runs) as (watch, pool):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            learning = partial(watch, "learning")
            teams = evaluation.contenders(
                settings.learner, memory, objective, task, scenario, learning, rng=settings.seed
            )  # fmt: skip
        for note in dict.fromkeys(str(warning.message) for warning in caught):
            watch.emit(f"note: {note}")
        table = evaluation.evaluate(teams, task, scenario, settings, pool, partial(watch, "simulating"))
    return table, watch.passed()


def _show_evaluation(settings: EvaluateSettings, case: _Case, table: pd.DataFrame) -> None:
    """Print what each policy achieves: first the one that uses all inputs, then all, then what they were tested on."""
    from teamsight.analysis.learning import evaluation
    from teamsight.analysis.learning.explore import differing
    from teamsight.analysis.learning.learners import default_of
    from teamsight.cli.show import interval, plural, say, show_table

    memory, task, scenario, steps, reward = case
    metric, better = task.objective
    # Shares are printed in percent.
    unit, how, scale = (" [%]", ".1f", 100.0) if metric.endswith("fraction") else ("", ".4g", 1.0)
    more = partial(interval, how=f"+{how}", scale=scale, names=("more", "more_low", "more_high"))
    first, *others = evaluation.summary(table, task).to_dict("records")
    ahead = "".join(f"; better than {other['policy']} by {more(other)}" for other in others[:1])
    say(f"{settings.learner}: {metric} {interval(first, how, scale)}{unit.replace('[%]', '%')}{ahead}")
    rows = [
        (row["policy"], interval(row, how, scale), f"{row['censored']:.0%}", "" if row is first else more(row))
        for row in (first, *others)
    ]
    titles = ("policy", f"{metric}{unit} ({better} is better)", "censored", f"{first['policy']} better by")
    show_table(rows, titles, spare=(2,))
    discount = default_of(settings.learner, "discount") if settings.discount is None else settings.discount
    constants = f"reward {reward}" + ("" if discount is None else f", discount {discount:g}")
    say(f"{settings.learner} on {plural(len(memory), 'transition')}, {constants}")
    values = ", ".join(f"{name} = {value}" for name, value in scenario.items())
    say(f"{task.name}: {values}, {plural(settings.runs, 'world')} of {plural(steps, 'step')}, seed {settings.seed}")
    for name, found in differing(memory).items():
        if name in scenario:
            say(f"note: {name} differs between the explorations: {', '.join(map(str, found))}")
    if "Lattice" in str(memory.settings.get("policy")):
        say(
            "note: robots explored from cell to cell, and those that have learned may move in any direction, which the "
            "others cannot; a difference between them may be due to that"
        )


def _sampled(settings: EvaluateSettings) -> LazyMemory:
    from teamsight.policies.memory import LazyMemory

    memory = LazyMemory.load(settings.memory)
    if settings.sample is None:
        return memory
    if settings.sample > len(memory):
        raise ValueError(
            f"sample={settings.sample}: the memory has only {len(memory)} transitions; give a smaller sample, or "
            "explore longer"
        )
    return memory.sample(settings.sample, settings.seed)


@dataclass(frozen=True, kw_only=True)
class ImagineSettings(Imagining, Works, Writes):
    """Options of ``teamsight learn imagine``.

    Parameters
    ----------
    memory : Path
        Memory to learn from.
    out : Path
        File for the model and the constants of the policy.
    """

    memory: Annotated[File, Allowed(metavar="MEMORY", is_argument=True)]
    out: File = Path("constants.json")


def imagine(settings: ImagineSettings) -> None:
    """Learn a model of the world, and seek a policy in worlds that it imagines.

    Speeds, turns and ranges are learned from the transitions of a random walk under ring awareness. The constants of
    the policy 'group-forces' are then sought by CMA-ES in worlds of the model; these steps cost no transitions. It
    needs the package cma: pip install 'teamsight[evolve]'.

    \b
    Examples:
      teamsight learn explore --runs 16 --out memory.safetensors
      teamsight learn imagine memory.safetensors
    """
    from teamsight.analysis.learning import imagination
    from teamsight.analysis.runs.files import as_json, check_replaceable, write_json
    from teamsight.cli.show import say, working
    from teamsight.core.extras import extra
    from teamsight.policies.memory import LazyMemory

    extra("cma", "evolution", "learn imagine")
    memory, plan = LazyMemory.load(settings.memory), settings.part(Imagining)
    about = {"memory": memory.digest, "imagining": as_json(plan)}
    check_replaceable(settings.out, about, force=settings.force)
    explored = memory.settings["radius"]
    with working(settings) as (watch, pool):
        watch("learning", 0, 1)
        model = imagination.learn_model(memory)
        watch("learning", 1, 1)
        policy = imagination.imagine(model, plan, explored, pool, partial(watch, "imagining"))
    content = {"software": "teamsight", "settings": about, "model": model._asdict()}
    constants = {name: part.tolist() for name, part in policy.parts(policy.constants).items()}
    write_json(settings.out, content | {"constants": constants}, force=settings.force)
    say(", ".join(f"{name} = {value:.4g}" for name, value in model._asdict().items()))
    say(f"constants in {settings.out}")


@dataclass(frozen=True, kw_only=True)
class FigureSettings(Curves, Divides, Writes):
    """Options of ``teamsight learn figure``.

    Parameters
    ----------
    out : Path
        Folder for the results.
    quick : bool
        Use --samples 150,600,2400 --memories 4 --worlds 1 where these are not given.
    """

    out: Folder = Path("results")
    quick: Flag = False

    def check(self) -> None:
        """Set what ``--quick`` sets, and refuse worlds that are too large."""
        for name, value in _QUICK.items() if self.quick else ():
            if name not in self.given:
                object.__setattr__(self, name, value)
        for radius in self.radius:
            check_worlds(max(self.robots), self.targets, radius, self.steps, self.tests)


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
    from teamsight.analysis.learning import curves as learning
    from teamsight.analysis.learning.curve_figure import draw
    from teamsight.analysis.learning.learners import check_objective
    from teamsight.analysis.plot.style import to_picture
    from teamsight.analysis.runs.checkpoint import Checkpoint
    from teamsight.analysis.runs.files import check_results, prepare_folder, write_results
    from teamsight.cli.show import kept_in, plural, say, working

    curves = settings.part(Curves)
    given = settings.discount if "discount" in settings.given else None
    check_objective(curves.learners, curves.reward, curves.k, max(curves.samples), discount=given)
    folder, about = prepare_folder(settings.out), {"curves": curves.conditions()}
    name = "learning-curves"
    checkpoint = Checkpoint(folder / f"{name}.checkpoint")
    files = [f"{name}{which}" for which in (".parquet", "-gains.parquet", "-crossings.parquet", ".png")]
    check_results(folder, files, about, checkpoint=checkpoint, force=settings.force)
    keys = [job.key for job in learning.curve_jobs(curves)]

    def kept() -> str:
        count = f"{found} of {plural(len(keys), 'part')}" if (found := checkpoint.count(keys)) else ""
        return kept_in(checkpoint.path, count, "", "nothing was kept, since no part of the curves was finished")

    with working(settings, kept) as (watch, pool):
        table = learning.make_curves(curves, pool, checkpoint=checkpoint, progress=partial(watch, "learning"))
        gains = learning.awareness_gains(table)
        crossings = learning.crossings(gains)
        made = table, gains, crossings, to_picture(draw(gains, crossings, curves))
        write_results(folder, dict(zip(files, made, strict=True)), about, force=settings.force)
    checkpoint.forget(keys)
    _show_curves(gains, crossings)
    say(f"learning curves in {folder} after {watch.passed()}")


def _show_curves(gains: pd.DataFrame, crossings: pd.DataFrame) -> None:
    """Print from how many transitions awareness pays: for the best learner, then for each in all scenarios."""
    from teamsight.analysis.learning import curves as learning
    from teamsight.cli.show import interval, say, show_table

    def pays(row: Mapping[Any, Any]) -> str:
        return "not shown" if math.isnan(row["crossing"]) else f"from {int(row['crossing']):,}"

    means = learning.mean_gains(gains).set_index(["learner", "transitions"])
    overall, rows = learning.mean_gains(crossings).to_dict("records"), []
    for row in overall:
        if row["learner"] == learning.BEST:
            say(f"best learner, mean of all scenarios: awareness {learning.pays_from(row['crossing'], row['largest'])}")
        gain = interval(means.loc[(row["learner"], row["largest"])], "+.1f", 100.0, ("gain", "low", "high"))
        rows.append((row["learner"], "all", "all", pays(row), gain))
        single = crossings[(crossings["learner"] == row["learner"]) & crossings["robots"].notna()]
        rows += [("", f"{one['robots']:.0f}", f"{one['radius']:g}", pays(one), "") for one in single.to_dict("records")]
    last = f"Θ(1) minus Θ(0) from {overall[0]['largest']:,} [points]"
    show_table(rows, ("learner", "N", "R", "awareness pays [transitions]", last))


@dataclass(frozen=True, kw_only=True)
class DiagnoseSettings(Diagnosis, Works, Writes):
    """Options of ``teamsight learn diagnose``.

    Parameters
    ----------
    memory : Path, optional
        Memory to diagnose, of which samples are taken, in place of explorations.
    out : Path
        Folder for the results.
    """

    memory: Annotated[File | None, Allowed(metavar="[MEMORY]", is_argument=True)] = None
    out: Folder = Path("results")

    def check(self) -> None:
        """Refuse explorations of a memory."""
        if self.memory is not None:
            self.refuse(("memories",), "with MEMORY nothing is explored")


def diagnose(settings: DiagnoseSettings) -> None:
    """Show why learners do or do not learn to follow a target.

    For situations that show a single target, against its distance: the effect of the action on the reward; what eq. 1
    matches, as the lazy learners do; and whether the moves that are learned approach the target. Explores as the paper
    does, or takes samples of MEMORY. Writes diagnosis.png, diagnosis.parquet with every measurement, and diagnosis.md
    with tables. docs/lazy-q.md is about the result. An interrupted command keeps what is finished in FOLDER, and the
    same command continues from there. It takes about two minutes on two cores.

    \b
    Examples:
      teamsight learn diagnose --out diagnosis
      teamsight learn diagnose --samples 600 --reward keep \\
          --learners lazy,pessimistic,linear
      teamsight learn diagnose memory.safetensors --out diagnosis
    """
    from teamsight.analysis.learning import diagnosis as learning
    from teamsight.analysis.learning.diagnosis_figure import draw, page
    from teamsight.analysis.learning.learners import check_objective
    from teamsight.analysis.plot.style import to_picture
    from teamsight.analysis.runs.checkpoint import Checkpoint
    from teamsight.analysis.runs.files import check_results, prepare_folder, write_results
    from teamsight.cli.show import interval, kept_in, say, show_table, working
    from teamsight.policies.memory import LazyMemory

    memory = None if settings.memory is None else LazyMemory.load(settings.memory)
    diagnosis = _diagnosis_of(settings, memory)
    given = settings.discount if "discount" in settings.given else None
    check_objective(diagnosis.learners, diagnosis.reward, diagnosis.k, min(diagnosis.samples), discount=given)
    about = {"diagnosis": diagnosis.conditions() | ({} if memory is None else {"memory": memory.digest})}
    folder = prepare_folder(settings.out)
    checkpoint = Checkpoint(folder / "diagnosis.checkpoint")
    files = "diagnosis.parquet", "diagnosis.md", "diagnosis.png"
    check_results(folder, files, about, checkpoint=checkpoint, force=settings.force)
    keys = [job.key for job in learning.diagnosis_jobs(diagnosis)]

    def kept() -> str:
        count = f"{found} of {len(keys)}" if memory is None and (found := checkpoint.count(keys)) else ""
        otherwise = "nothing was kept, since no exploration was finished"
        return kept_in(checkpoint.path, count, "explorations", otherwise)

    with working(settings, kept, agent_steps=math.inf if memory is None else 0) as (watch, pool):
        if memory is not None:
            table = learning.diagnose_memory(diagnosis, memory)
        else:
            progress = partial(watch, "learning")
            table = learning.diagnose_explorations(diagnosis, pool, checkpoint=checkpoint, progress=progress)
    points, conditions = learning.diagnosis_points(table), diagnosis.in_words(memory)
    made = table, page(points, conditions), to_picture(draw(points, conditions))
    write_results(folder, dict(zip(files, made, strict=True)), about, force=settings.force)
    checkpoint.forget(keys)
    rim = points[(points["distance"] == learning.DISTANCES[-2]) & (points["quantity"] == "approach")]
    rows = [
        (row["learner"], row["inputs"], f"{row['transitions']:,}", interval(row, "+.2f"))
        for row in rim.to_dict("records")
    ]
    away = f"steps towards a target at {learning.DISTANCES[-2]:.3f}"
    show_table(rows, ("learner", "inputs", "transitions", away))
    say(f"diagnosis in {folder} after {watch.passed()}")


def _diagnosis_of(settings: DiagnoseSettings, memory: LazyMemory | None) -> Diagnosis:
    """Return the diagnosis that the settings describe; of a memory, with samples that it can give."""
    from dataclasses import replace

    diagnosis = settings.part(Diagnosis)
    if memory is None:
        return diagnosis
    samples = diagnosis.samples
    if "samples" not in settings.given:
        samples = tuple(size for size in samples if size <= len(memory)) or (len(memory),)
    elif max(samples) > len(memory):
        raise ValueError(
            f"samples={max(samples)}: the memory has only {len(memory)} transitions; give smaller samples, or explore "
            "longer"
        )
    return replace(diagnosis, memories=1, samples=samples)


@dataclass(frozen=True, kw_only=True)
class CurveSettings(TaskOptions, Training, Works, Writes):
    """Options of ``teamsight learn curve``.

    Parameters
    ----------
    task : str
        The task. Its team has to learn, as those of pursuit and collect do.
    set : mapping of str to object
        A value of the scenario of the task. May be given several times.
    out : Path
        Folder for the results.
    format : sequence of str
        Formats of the picture, with commas between them.
    """

    task: TaskName = "pursuit"
    out: Folder = Path("results")
    format: Annotated[tuple[Format, ...], Allowed()] = ("png",)

    @classmethod
    def world_options(cls) -> frozenset[str]:
        """Return none: the degrees of awareness are those that are compared."""
        return frozenset()


def curve(settings: CurveSettings) -> None:
    """Draw the learning curve of a task.

    For tasks whose team learns while it acts, such as pursuit. Teams learn for several times, with each degree of
    awareness, and are then tested on the same worlds, in which they have not learned. Writes a picture, a table of all
    tests, one of the means with their intervals over trainings, and one of what awareness adds. Learning from a
    recorded exploration of CMOMMT has its own curves, `teamsight learn figure`.

    \b
    Examples:
      teamsight learn curve --task pursuit
      teamsight learn curve --task pursuit --learned 1000,10000 \\
          --awareness none,pairwise,nearest
      teamsight learn curve --task pursuit --set hunters=4 \\
          --trainings 10 --out four
    """
    from teamsight.analysis.learning import training as learning
    from teamsight.analysis.plot.style import to_picture
    from teamsight.analysis.runs.files import Content, as_json, check_results, prepare_folder, write_results
    from teamsight.cli.show import say, working

    task, training, given = settings.task_given(), settings.part(Training), settings.parameters
    plan = {name: value for name, value in as_json(training).items() if value is not None}
    about = {"learning curve": {"task": task.name, "scenario": learning.check_training(task, given), **plan}}
    folder, name = prepare_folder(settings.out), "learning-curve"
    pictures = {f"{name}.{kind}": kind for kind in settings.format}
    tables = [f"{name}{which}.parquet" for which in ("", "-points", "-gains")]
    check_results(folder, (*tables, *pictures), about, force=settings.force)
    with working(settings) as (watch, pool):
        progress = partial(watch, "testing")
        table = learning.learning_curve(task, training, given, pool=pool, progress=progress)
    points = learning.training_points(table)
    gains = learning.awareness_gain(task, table, str(points["awareness"].iloc[0]))
    subtitle = (
        f"{''.join(f'{name} = {value}; ' for name, value in given.items())}{settings.trainings} trainings, "
        f"{settings.runs} test runs of each; 95 % intervals over trainings; seed {settings.seed}"
    )
    contents: dict[str, Content] = dict(zip(tables, (table, points, gains), strict=True))
    figure = learning.draw(points, task, subtitle)
    contents |= {file: to_picture(figure, kind=kind) for file, kind in pictures.items()}
    write_results(folder, contents, about, force=settings.force)
    _show_curve(task, points, gains)
    say(f"learning curve of {task.name} in {folder} after {watch.passed()}")


def _show_curve(task: Task, points: pd.DataFrame, gains: pd.DataFrame) -> None:
    """Print what awareness adds after the longest learning, then what each team reaches."""
    from teamsight.cli.show import interval, say, show_table

    def gain(row: Mapping[Any, Any]) -> str:
        return interval(row, "+.4g", names=("gain", "low", "high"))

    longest, known = points["learned"].max(), {}
    for one in gains.to_dict("records"):
        known[one["awareness"], one["learned"]] = gain(one)
        if one["learned"] == longest:
            than = points["awareness"].iloc[0]
            say(f"{one['awareness']} is better than {than} by {gain(one)} after {longest:,} steps of learning")
    rows = [
        (row["awareness"], f"{row['learned']:,}", interval(row, ".4g"), f"{row['censored']:.0%}",
         known.get((row["awareness"], row["learned"]), ""))
        for row in points.to_dict("records")
    ]  # fmt: skip
    metric, better = task.objective
    titles = ("awareness", "learned [steps]", f"{metric} ({better} is better)", "censored", "better by")
    show_table(rows, titles, spare=(3, 4))
