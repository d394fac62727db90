"""The worlds of a page as text: a script that repeats them with all interventions, and a command with settings."""

from __future__ import annotations

import enum
import inspect
import math
import shlex
import sys
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from teamsight.agents.awareness.registry import AWARENESS
from teamsight.agents.cmommt import CMOMMT
from teamsight.agents.components.durations import Exponential
from teamsight.agents.components.failures import Failures
from teamsight.core import checks
from teamsight.core.component import Component, declared
from teamsight.live.controls import seed_name
from teamsight.live.interventions import MODEL
from teamsight.policies.registry import POLICIES
from teamsight.tasks.model import TREATMENT, TaskModel
from teamsight.tasks.registry import TASKS

if TYPE_CHECKING:
    from teamsight.agents.world import World
    from teamsight.live.worlds import Worlds


_OPTIONS = "_options"


class Code:
    """Writes values as Python, and collects what has to be imported.

    Attributes
    ----------
    imports : set of (str, str)
        Modules, and the names from them.
    unknown : list of str
        What cannot be written.
    """

    def __init__(self) -> None:
        self.imports: set[tuple[str, str]] = set()
        self.unknown: list[str] = []

    def name(self, made: Any) -> str:
        """Return the name of a class or function that has been imported."""
        module, name = getattr(made, "__module__", ""), getattr(made, "__qualname__", "")
        if not name.isidentifier() or module in ("__main__", "builtins", ""):
            self.unknown.append(name or checks.shown(made))
            return name if name.isidentifier() else "..."
        # What the package offers at its top is imported from there.
        top = sys.modules["teamsight"]
        self.imports.add((top.__name__ if getattr(top, name, None) is made else module, name))
        return str(name)

    def value(self, value: Any) -> str:
        """Return a value as an expression."""
        if value is None or isinstance(value, (bool, int, float, str)):
            return repr(value.item() if isinstance(value, np.generic) else value)
        if isinstance(value, np.generic | np.ndarray):
            return self.value(value.tolist())
        if isinstance(value, enum.Enum):
            return f"{self.name(type(value))}.{value.name}"
        if isinstance(value, Mapping):
            return f"{{{', '.join(f'{self.value(key)}: {self.value(one)}' for key, one in value.items())}}}"
        if isinstance(value, (list, tuple)):
            inner = ", ".join(map(self.value, value))
            return f"[{inner}]" if isinstance(value, list) else f"({inner},)" if len(value) == 1 else f"({inner})"
        if isinstance(value, Component):
            names = [name for name in inspect.signature(type(value)).parameters if hasattr(value, name)]
            return f"{self.name(type(value))}({', '.join(f'{one}={self.value(getattr(value, one))}' for one in names)})"
        if callable(value) and hasattr(value, "__qualname__"):
            return self.name(value)
        self.unknown.append(checks.shown(value))
        return "..."


def script_of(worlds: Worlds, unknown: list[str] | None = None) -> str:
    """Return a script that builds the worlds of a page and makes their steps and interventions again.

    What it cannot write is in a comment of it, and is added to `unknown`.
    """
    code, body, tracks = Code(), list[str](), list(worlds.tracks)
    made, seed = _maker(code, worlds.model), seed_name(worlds.model)
    names = ["model"] if len(tracks) == 1 else ["left", "right"]
    for name, track in zip(names, tracks, strict=True):
        # In this order: it may run on meanwhile.
        until, journal = track.made, track.journal
        entries = [one for one in list(journal.entries) if one.made <= until]
        parameters = {**journal.parameters, **({} if seed is None else {seed: worlds.seed})}
        given = "".join(f"    {one}={code.value(value)},\n" for one, value in parameters.items())
        body.append(f"{name} = {made}(\n{given})" if given else f"{name} = {made}()")
        if any("first_arena" in line for one in entries for line in one.lines):
            body.append(f"first_arena = {name}.arena")
        tick = 0
        for entry in entries:
            if entry.made > tick:
                body.append(f"{name}.run({entry.made - tick})")
                tick = entry.made
            body += [line.replace(MODEL, name) for line in entry.lines]
            if entry.setting is not None:
                body.append(f"{name}.{entry.setting} = {code.value(entry.value)}")
            for shape in ("Circle", "Polygon"):
                code.imports |= {("teamsight", shape)} if any(f"({shape}(" in line for line in entry.lines) else set()
        if until > tick:
            body.append(f"{name}.run({until - tick})")
        # Where nobody senses targets there is no fraction.
        is_known = math.isfinite(track.world.observed_fraction)
        mean = f", mean observed fraction {{{name}.observed_fraction:.4f}}" if is_known else ""
        body += [f'print(f"{name}: tick {{{name}.tick}}{mean}")', ""]
    head = [
        f"from {module} import {', '.join(sorted(name for home, name in code.imports if home == module))}"
        for module in sorted({module for module, _ in code.imports})
    ]
    if unknown is not None:
        unknown += dict.fromkeys(code.unknown)
    head += [f"# Write this yourself: {' '.join(one.split())}" for one in dict.fromkeys(code.unknown)]
    return "\n".join([*head, "", *body])


def _maker(code: Code, model: Callable[..., World]) -> str:
    if not isinstance(model, TaskModel):
        return code.name(model)
    code.imports |= {("teamsight.tasks", "task_of"), ("teamsight.tasks.model", "TaskModel")}
    if model.task.name not in TASKS:
        code.unknown.append(f"the task {model.task.name!r}")
    return f"TaskModel(task_of({model.task.name!r}))"


def command_of(worlds: Worlds, unknown: list[str] | None = None) -> str:
    """Return the command that shows worlds with the present settings from tick 0; interventions are not in it.

    What it cannot give is in a comment of it, and is added to `unknown`.
    """
    model, words, unknown = worlds.model, ["teamsight", "watch"], [] if unknown is None else unknown
    if isinstance(model, TaskModel):
        words += ["--task", model.task.name]
        if model.task.name not in TASKS:
            unknown.append(f"the task {model.task.name!r}")
    elif model is not CMOMMT:
        words += ["--model", f"{model.__module__}:{getattr(model, '__qualname__', '')}"]
    first, *others = worlds.settings
    for name, value in first.items():
        words += _options(model, name, value, unknown)
    if seed_name(model) is not None:
        words += ["--seed", str(worlds.seed)]
    for other in others:
        for name, value in other.items():
            if name in first and (first[name] is value or first[name] == value):
                continue
            text = _text(value)
            if text is None:
                unknown.append(f"{name}={checks.shown(value)} of the world on the right")
            else:
                words += ["--beside", f"{name}={text}"]
    more = f"  # not given: {', '.join(' '.join(one.split()) for one in unknown)}" if unknown else ""
    return shlex.join(words) + more


def _options(model: Any, name: str, value: Any, unknown: list[str]) -> list[str]:
    """Return the words of a command for a parameter."""
    is_option = model is CMOMMT or name == TREATMENT
    option = f"--{name.replace('_', '-')}"
    if model is CMOMMT and name == "events" and type(value) is Failures:
        times = {"failures": value.time_to_failure, "repair": value.time_to_repair}
        # Other times than exponential ones have a mean too, and are others.
        means = {one: time.mean for one, time in times.items() if isinstance(time, Exponential)}
        if len(means) == sum(time is not None for time in times.values()):
            return [word for one, mean in means.items() for word in (f"--{one}", f"{mean:.17g}")]
    if model is CMOMMT and name.endswith(_OPTIONS) and isinstance(value, Mapping):
        base = name.removesuffix(_OPTIONS).replace("_", "-")
        return [word for key, one in value.items() for word in (f"--{base}.{key.replace('_', '-')}", str(one))]
    if isinstance(value, bool) and is_option:
        return [option] if value else []
    if value is None:
        return []
    if (text := _text(value)) is not None:
        return [option, text] if is_option else ["--set", f"{name}={text}"]
    registry = {"policy": POLICIES, "awareness": AWARENESS}.get(name)
    named = _name_of(value, registry)
    if named is None:
        unknown.append(f"{name}={checks.shown(value)}")
        return []
    words = [option, named]
    for inner, one in declared(type(value)).items():
        its = getattr(value, inner)
        if its != one.default:
            words += [f"--{name}.{inner.replace('_', '-')}", str(its)]
    return words


def _text(value: Any) -> str | None:
    """Return a number, a truth value, a text or a member of an Enum as a command line has it."""
    if isinstance(value, enum.Enum):
        return value.name
    if isinstance(value, bool):
        return str(value).lower()
    return str(value) if isinstance(value, (int, float, str)) else None


def _name_of(value: Any, registry: Any) -> str | None:
    """Return the name of a component of this class in a registry, if it has one."""
    for name in registry or ():
        if type(registry[name]) is type(value) or registry[name] is type(value):
            return str(name)
    return None
