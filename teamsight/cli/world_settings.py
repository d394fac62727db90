"""The options of commands that make worlds: those of `CMOMMT`, of its components, and of a task in place of it.

The amount of work and output of a command is computed before it starts, and refused if no machine can do it.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from teamsight.agents import settings as cmommt
from teamsight.cli.options import Options, TaskName, component_options, flag, made_of, names_in, options_in
from teamsight.core.component import Allowed, Declared, Positive, Seed, declared, of_name, value_in, with_tables

if TYPE_CHECKING:
    from teamsight.agents.components.failures import Failures
    from teamsight.tasks.model import TaskModel
    from teamsight.tasks.task import Task

# Events of one command: hours of work, and a log that fills the memory.
_MOST_EVENTS = 1e7
# Agents × steps of one command: months of work.
_MOST_AGENT_STEPS = 1e14
# Neighbours, sensed targets and relayed targets of all robots in one step, which are in memory together.
_MOST_NEIGHBOURS = 2e8
# Radius of the arena: beyond it the sensing range, which is 1, or the speeds would exceed the limits of a world.
_LEAST_RADIUS, _MOST_RADIUS = 1e-3, 1e8

Treatment = Annotated[str, names_in("teamsight.tasks.task:TREATMENTS")]


@dataclass(frozen=True, kw_only=True)
class TaskOptions(Options):
    """Options of commands that take a task in place of `CMOMMT`.

    Parameters
    ----------
    task : str, optional
        The task in place of CMOMMT, or module:TASK; then its parameters are options, such as those of its scenario.
    set : mapping of str to object
        A parameter of the task, such as one of its scenario. May be given several times.
    """

    task: Annotated[TaskName | None, Allowed(shown="CMOMMT")] = None
    set: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def brings(cls, arguments: Sequence[str]) -> Mapping[str, Declared]:
        """Return the options of the policies and degrees that are named, and those of the task."""
        found = component_options(cls.options(), arguments)
        if named := options_in(arguments, "task"):
            from teamsight.tasks.model import TaskModel
            from teamsight.tasks.named import task_of

            taken = {"rng", *cls.options()}
            # A task that is none is refused with all else that is wrong.
            with contextlib.suppress(TypeError, ValueError):
                own = declared(TaskModel(task_of(named[-1])))
                for name, one in own.items():
                    if name not in taken and one.kind not in ("object", "mapping"):
                        found[name] = replace(one, allowed=replace(one.allowed, section=f"Task {named[-1]}"))
                found |= component_options({name: own[name] for name in own.keys() & found.keys()}, arguments)
        return found

    @property
    def parameters(self) -> dict[str, Any]:
        """The parameters of the task that were given, under their own names or by ``--set``.

        Raises
        ------
        ValueError
            If one is given in both ways.
        """
        own = {name: value for name, value in self.brought.items() if "." not in name}
        shared = {name: getattr(self, name) for name in self.given & self.world_options()}
        for name in self.set.keys() & {*own, *self.given}:
            raise ValueError(f"set={name}: is given as --{flag(name)} too; leave one out")
        return {**shared, **own, **self.set}

    @classmethod
    def world_options(cls) -> frozenset[str]:
        """Return the names of the options that are parameters of `CMOMMT`."""
        world = {name for name, one in declared(cmommt.Settings).items() if one.kind != "object"}
        return frozenset(cls.options().keys() & world)

    def check_task(
        self, of_task: Sequence[str] = ("set", "treatment"), others: Sequence[str] = (), *, components: bool = False
    ) -> None:
        """Refuse options that do not go together: those of a task without one, and what the task does not have.

        Parameters
        ----------
        of_task : sequence of str
            The options that need a task.
        others : sequence of str
            Options that a task does not have.
        components : bool
            Whether the options of a policy or a degree, such as ``--policy.gain``, may be given with a task.

        Raises
        ------
        ValueError
            If there is one, or the task has no such parameter.
        """
        if self.task is None:
            for name in of_task:
                if name in self.given:
                    raise ValueError(f"--{flag(name)}: is for a task; give --task NAME too, or leave it out")
            return
        self.refuse(others, "does not go with --task")
        for name in self.brought:
            if "." in name and not components:
                raise ValueError(f"--{flag(name)}: does not go with --task; leave --{flag(name)} out")
        self.model_of().parameters_known(self.parameters)

    def check_size(self, steps: int, runs: int = 1, **world: Any) -> int:
        """Refuse worlds that are too large, and return the number of agents in one.

        Parameters
        ----------
        steps, runs : int
            The number of steps of each run, and of runs.
        **world
            Further parameters of `check_worlds`.
        """
        own: Any = self
        robots, targets = (self.task_size(), 0) if self.task else (own.robots, own.targets)
        check_worlds(robots, targets, own.radius, steps, runs, **world)
        return int(robots + targets)

    def task_given(self) -> Task:
        """Return the task that was given."""
        from teamsight.tasks.named import task_of

        assert self.task is not None
        return task_of(self.task)

    def length(self) -> int:
        """Return T: the given number of steps, that of the task, or 600."""
        steps: int | None = getattr(self, "steps", None)
        return steps or (self.task_given().steps if self.task else 600)

    def model_of(self, treatment: str | None = None, rng: int = 0) -> TaskModel:
        """Return the task that was given as a model."""
        from teamsight.tasks.model import TaskModel

        return TaskModel(self.task_given(), treatment, rng)  # type: ignore[arg-type]

    def task_size(self) -> int:
        """Return N of the task that was given; 1 if that is no number, which its world refuses."""
        found = self.task_given()
        size = self.parameters.get(found.size, found.scenario[found.size])
        return size if isinstance(size, int) and size > 0 else 1

    def world(self) -> dict[str, Any]:
        """Return the parameters of `CMOMMT` that were given, with the options of its components.

        Raises
        ------
        TypeError, ValueError
            If a component refuses its options.
        """
        given = {name: getattr(self, name) for name in self.given & self.world_options()}
        for name, value in self._component_options().items():
            base, _, option = name.partition(".")
            others = f"{base}_options"
            if others in declared(cmommt.Settings):
                options = given.setdefault(others, {})
                if option in options:
                    raise ValueError(f"--{flag(name)}: is given by --{flag(others)} too; leave one out")
                given[others] = {**options, option: value}
            else:
                if option in self.given:
                    raise ValueError(f"--{flag(name)}: is given as --{flag(option)} too; leave one out")
                made = given.get(base, getattr(self, base))
                registry: Any = declared(cmommt.Settings)[base].choices
                # Its other options keep their defaults.
                make = registry[made] if isinstance(made, str) else partial(replace, made)
                given[base] = make(**{option: value})
        for name, one in declared(cmommt.Settings).items():
            if options := given.get(f"{name}_options"):
                # As --policy.gain is checked, whether the class of the user checks it or not.
                owner = of_name(one, given.get(name, getattr(self, name)))
                known = declared(owner) if callable(owner) else {}
                for option, value in options.items():
                    if option in known:
                        known[option].checked(value, f"{name}.{option}")
        return given


    def _component_options(self) -> dict[str, Any]:
        """Return the options of components that were given, as policy.gain, with what they name made."""
        found: dict[str, Any] = {}
        for base in dict.fromkeys(name.partition(".")[0] for name in self.brought if "." in name):
            one, named = declared(cmommt.Settings)[base], getattr(self, base)
            known = declared(of_name(one, named) if isinstance(named, str) else type(named))
            own = {name.partition(".")[2]: value for name, value in self.brought.items() if name.startswith(f"{base}.")}
            for option, value in with_tables(own, f"{base}.").items():
                found[f"{base}.{option}"] = made_of(known[option], value)
        return found


@dataclass(frozen=True, kw_only=True)
class WorldOptions(TaskOptions, cmommt.Settings):
    """Which world is simulated, and with which seed.

    Parameters
    ----------
    treatment : str, optional
        The team of the task.
    failures : float, optional
        Mean number of ticks until a robot fails.
    repair : float, optional
        Mean number of ticks until a failed robot is repaired.
    seed : int
        Seed of the world.
    """

    treatment: Annotated[Treatment | None, Allowed(shown="skilled")] = None
    failures: Annotated[Positive | None, Allowed(unit="ticks", shown="no failures")] = None
    repair: Annotated[Positive | None, Allowed(unit="ticks", shown="no repair")] = None
    seed: Seed = 0

    def check_world(self, steps: int) -> int:
        """Refuse repairs without failures, too many events, and worlds that are too large; return the number of agents.

        Raises
        ------
        ValueError
            With the values, the limit and the cure.
        """
        agents = self.check_size(steps, awareness_range=self.awareness_range, degrees=(str(self.awareness),))
        if self.repair is None:
            return agents
        if self.failures is None:
            raise ValueError(f"repair={self.repair:g}: no robot fails; give --failures too, or leave --repair out")
        if 2.0 * self.robots * steps > _MOST_EVENTS * (self.failures + self.repair):
            raise ValueError(
                f"failures={self.failures:g}, repair={self.repair:g}: make more than {_MOST_EVENTS:g} events; give "
                "longer times, or fewer steps"
            )
        return agents

    def source_of_failures(self) -> Failures | None:
        """Return the source of failures, if there are any."""
        if self.failures is None:
            return None
        from teamsight.agents.components.failures import Failures

        return Failures(self.failures, self.repair)


def check_sectors(settings: Any) -> None:
    """Refuse ``--delta`` for a degree of awareness without δ; both are options of these settings.

    Raises
    ------
    ValueError
        If both do not fit.
    """
    from teamsight.agents.awareness.registry import with_option

    having = with_option("delta")
    if "delta" in settings.given and settings.awareness not in having:
        raise ValueError(
            f"delta={settings.delta}: awareness {settings.awareness!r} has no δ; leave --delta out, or give "
            f"--awareness {' or '.join(having)}"
        )


def check_worlds(
    robots: int, targets: int, radius: float, steps: int, runs: int = 1, *, awareness_range: float = 1.0,
    degrees: Sequence[str] = (),
) -> None:  # fmt: skip
    """Refuse more agent steps than a command can simulate, and worlds whose neighbours do not fit in memory.

    Parameters
    ----------
    robots, targets : int
        The number of each in one world.
    radius : float
        Radius of the arena [sensing ranges].
    steps, runs : int
        The number of steps of each run, and of runs.
    awareness_range : float
        Distance within which two robots are neighbours [sensing ranges].
    degrees : sequence of str
        The degrees of awareness; under some of them teammates report the targets that they sense.

    Raises
    ------
    ValueError
        If there are too many, or the radius is outside its limits.
    """
    from teamsight.agents.awareness.registry import degree_named

    made = float(robots + targets) * steps * runs
    if made > _MOST_AGENT_STEPS:
        counts = f"robots={robots}, targets={targets}, steps={steps}" + (f", runs={runs}" if runs > 1 else "")
        raise ValueError(f"{counts}: makes {made:.1e} agent steps, at most {_MOST_AGENT_STEPS:g}; reduce one of them")
    if not _LEAST_RADIUS <= radius <= _MOST_RADIUS:
        raise ValueError(
            f"radius={radius:g}: must be from {_LEAST_RADIUS:g} to {_MOST_RADIUS:g} sensing ranges, since otherwise "
            "rounding errors dominate; give another radius"
        )
    # Over hops a robot can know all others.
    spreads = any(degree_named(degree).spreads for degree in degrees)
    neighbours = float(robots) ** 2 * (1.0 if spreads else min(1.0, (awareness_range / radius) ** 2))
    sensed = targets * min(1.0, 1 / radius**2)
    relayed = any("relayed" in degree_named(degree).delivers for degree in degrees)
    made = neighbours * (1.0 + sensed if relayed else 1.0) + robots * sensed
    if made > _MOST_NEIGHBOURS:
        other = "another degree of awareness" if spreads else "a larger radius"
        raise ValueError(
            f"robots={robots}, targets={targets}, radius={radius:g}: makes about {made:.1e} neighbours per step, at "
            f"most {_MOST_NEIGHBOURS:g} fit in memory; give fewer robots, or {other}"
        )


def listed(value: Any) -> list[Any]:
    """Return the values of a parameter that were given with commas between them, or as several."""
    if isinstance(value, tuple):
        return list(value)
    return [value_in(part.strip()) for part in value.split(",")] if isinstance(value, str) else [value]
