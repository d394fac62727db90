"""Components in the values of a study: policies, sensors, event sources, written as references."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import is_dataclass
from typing import Any

from teamsight.agents.settings import Settings
from teamsight.analysis.runs.seeds import canonical
from teamsight.core import checks, plugins, references
from teamsight.core.component import declared, of_name

#: The key of a table that makes it a component.
USE = "use"

# Parameters whose components may also be plug-ins.
_GROUPS = {
    "policy": "teamsight.policies",
    "target_policy": "teamsight.policies",
    "awareness": "teamsight.awareness",
    "sensor": "teamsight.sensors",
}
# Those which take no names, only objects.
_OBJECTS = frozenset({"sensor"})


def described(name: str, value: object) -> str | dict[str, object]:
    """Return the reference of a class or function, or the table from which an object is rebuilt.

    Raises
    ------
    TypeError
        If there is none.
    """
    if inspect.isclass(value) or inspect.isroutine(value):
        return references.reference_to(value, name)
    kind = type(value)
    cure = "give text, numbers, lists, a class or function of a module, or {'use': 'package.module:Class', …}"
    is_ours = kind.__module__.startswith("teamsight.")
    if not (is_ours or (is_dataclass(value) and kind.__dataclass_params__.frozen)):  # type: ignore[attr-defined]
        raise TypeError(f"{name}={checks.shown(value)}: a study cannot hold this {kind.__name__}; {cure}")
    try:
        options = _options(value)
        table: dict[str, object] = {USE: references.reference_to(kind, name), **options}
        rebuilt = kind(**options)
    except (TypeError, ValueError, AttributeError) as error:
        raise TypeError(
            f"{name}={checks.shown(value)}: cannot be rebuilt from its options ({error}); {cure}"
        ) from error
    if repr(rebuilt) != repr(value):
        raise TypeError(f"{name}={checks.shown(value)}: its options do not rebuild it; {cure}")
    return table


def _options(value: object) -> dict[str, Any]:
    """Return the arguments of an object's class that differ from their defaults."""
    options = {}
    for parameter in inspect.signature(type(value)).parameters.values():
        if parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD, parameter.POSITIONAL_ONLY):
            raise TypeError(f"its class takes {parameter}")
        given = getattr(value, parameter.name)
        if parameter.default is parameter.empty or repr(given) != repr(parameter.default):
            options[parameter.name] = given
    return options


def _found(name: str, reference: object) -> object:
    """Return what a reference, or a plug-in for this parameter, names."""
    group = _GROUPS.get(name)
    if not isinstance(reference, str) or references.is_reference(reference) or group is None:
        return references.load(reference, name)  # type: ignore[arg-type]
    return plugins.find(group, reference, name)


class Components:
    """Turns values of a study into those that a model takes; references are loaded once.

    Functions, classes and objects of this package, which are immutable, are shared by all runs; other objects are made
    for each run, so that no run finds what another one has left in them.
    """

    def __init__(self) -> None:
        self._shared: dict[str, object] = {}
        # How many objects were made that are not shared.
        self._unshared = 0

    def resolved(self, parameters: Mapping[str, object]) -> dict[str, object]:
        """Return parameters with their components made.

        Raises
        ------
        TypeError, ValueError
            If a reference does not load, or options are wrong.
        """
        own = {name: value for name, value in parameters.items() if "." not in name}
        options: dict[str, dict[str, object]] = {}
        for name in parameters.keys() - own.keys():
            base, _, option = name.partition(".")
            options.setdefault(base, {})[option] = parameters[name]
        made = {name: self.made(name, value) for name, value in own.items() if name not in options}
        return made | {base: self._with_options(base, own.get(base), given) for base, given in options.items()}

    def _with_options(self, name: str, value: object, options: dict[str, object]) -> object:
        """Return a component with some settings that the study names by themselves: ``policy.gain``."""
        if isinstance(value, str) and not references.is_reference(value) and name in declared(Settings):
            key = f"{name}={value}{canonical(options)}"
            if key not in self._shared:
                owner = of_name(declared(Settings)[name], value)
                for option in options:
                    if option not in (known := declared(owner)):
                        listed = f"{checks.suggestion(option, known)}its settings are {', '.join(known)}"
                        raise ValueError(f"{name}.{option}: {value!r} has none; {listed}")
                self._shared[key] = owner(**options)
            return self._shared[key]
        table = {USE: value} if isinstance(value, str) else value
        if not isinstance(table, Mapping):
            first = f"{name}.{next(iter(options))}"
            raise ValueError(f"{first}: is a setting of a component; give {name} too, by name or as a table")
        return self.made(name, {**table, **options})

    def made(self, name: str, value: object) -> object:
        """Return one value of a parameter with the components in it made."""
        if isinstance(value, str):
            is_component = references.is_reference(value) or name in _OBJECTS
            return self._component(name, value, {}) if is_component else value
        if isinstance(value, (list, tuple)):
            return [self.made(name, one) for one in value]
        if isinstance(value, Mapping):
            if USE in value:
                return self._component(name, value[USE], {key: one for key, one in value.items() if key != USE})
            return {key: self.made(f"{name}.{key}", one) for key, one in value.items()}
        return value

    def _component(self, name: str, reference: object, options: Mapping[str, object]) -> object:
        key = f"{reference!r}{canonical(options)}"
        if key in self._shared:
            return self._shared[key]
        found, before = _found(name, reference), self._unshared
        if inspect.isclass(found):
            made: object = found(**{key: self.made(f"{name}.{key}", one) for key, one in options.items()})
        elif options:
            raise TypeError(f"{name}={checks.shown(reference)}: is no class and takes no options; give it alone")
        else:
            made = found
        # One of ours may hold one of theirs.
        is_ours = type(made).__module__.startswith("teamsight.") and self._unshared == before
        if made is found or is_ours:
            self._shared[key] = made
        else:
            self._unshared += 1
        return made
