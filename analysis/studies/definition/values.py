"""Values of a study's parameters: how they are held, the components that they name, and the ids that they give.

A study holds texts, numbers, booleans, null, lists and tables, all immutable. A policy, a sensor or an event source is
written as a reference, or as a table with the reference under "use" beside the options. The id of a setting is a digest
of the values of all its parameters.
"""

from __future__ import annotations

import hashlib
import inspect
import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import is_dataclass, replace
from numbers import Integral, Real
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from teamsight.agents.settings import Settings
from teamsight.analysis.runs.seeds import canonical
from teamsight.core import checks, plugins, references
from teamsight.core.component import USE, Declared, check_options, declared, of_name, with_tables
from teamsight.core.registry import Registry

#: Whole numbers are kept as 64-bit integers.
MOST_INTEGER = 2**63 - 1
#: Lists and tables within each other.
MOST_LEVELS = 16
#: Characters of a text.
MOST_CHARACTERS = 10_000

# Half a character, which no file can hold.
_HALF = re.compile("[\ud800-\udfff]")
_SCALARS = frozenset({int, float, bool, str})
# Settings whose ids are computed in one go, which bounds the memory for their texts.
_CHUNK = 65_536


class Table(dict[str, Any]):
    """A mapping that cannot be changed."""

    def _refuse(self, *_: object, **__: object) -> NoReturn:
        raise TypeError("a study cannot be changed; make another one, as with dataclasses.replace(study, steps=100)")

    __setitem__ = __delitem__ = __ior__ = _refuse  # type: ignore[assignment]
    clear = pop = popitem = setdefault = update = _refuse  # type: ignore[assignment]

    def __reduce__(self) -> tuple[type[Table], tuple[dict[str, Any]]]:
        return Table, (dict(self),)


def frozen(name: str, value: object, level: int = 0) -> Any:
    """Return a value as a study holds it: lists as tuples, tables as `Table`, components as references.

    Parameters
    ----------
    name : str
        The name used in errors.
    value : object
        A text, number, boolean or None; a list, array or mapping of such; or a component.
    level : int
        How many lists and tables this value is in.

    Raises
    ------
    TypeError, ValueError
        If a study cannot hold the value.
    """
    if level > MOST_LEVELS:
        raise ValueError(f"{name}: has more than {MOST_LEVELS} lists and tables within each other; make it flatter")
    if value is None or isinstance(value, (bool, np.bool_)):
        return value if value is None else bool(value)
    if isinstance(value, str):
        if len(value) > MOST_CHARACTERS:
            raise ValueError(
                f"{name}={checks.shown(value)}: must have at most {MOST_CHARACTERS} characters; shorten it"
            )
        if _HALF.search(value):
            raise ValueError(f"{name}={checks.shown(value)}: is no valid text; remove odd characters")
        return str(value)
    if isinstance(value, Integral):
        if abs(int(value)) > MOST_INTEGER:
            shown = checks.shown(int(value))
            raise ValueError(f"{name}={shown}: must be between -(2^63 - 1) and 2^63 - 1; give a smaller one")
        return int(value)
    if isinstance(value, Real):
        return checks.number(name, value, cure="give one, or remove it")
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                raise TypeError(f"{name}: the key {checks.shown(key)} must be a text")
        return Table({str(key): frozen(f"{name}.{key}", one, level + 1) for key, one in value.items()})
    if isinstance(value, np.ndarray):
        return frozen(name, value.tolist(), level)
    if isinstance(value, (list, tuple, range)) and not hasattr(value, "_fields"):
        return _plain(value) or tuple(frozen(f"{name}[{i}]", one, level + 1) for i, one in enumerate(value))
    return frozen(name, _described(name, value), level)


def _plain(values: Sequence[Any]) -> tuple[Any, ...]:
    """Return a tuple of valid numbers and booleans, of which there may be millions, at once; () for any other."""
    kinds = set(map(type, values))
    if not kinds <= {int, float, bool}:
        return ()
    if int in kinds and not -MOST_INTEGER <= min(values) <= max(values) <= MOST_INTEGER:
        return ()
    return tuple(values) if float not in kinds or all(map(math.isfinite, values)) else ()


def _described(name: str, value: object) -> str | dict[str, object]:
    """Return the reference of a class or function, or the table from which an object is rebuilt."""
    if inspect.isclass(value) or inspect.isroutine(value):
        return references.reference_to(value, name)
    kind, given = type(value), f"{name}={checks.shown(value)}"
    cure = "give text, numbers, lists, a class or function of a module, or {'use': 'package.module:Class', …}"
    is_ours = kind.__module__.startswith("teamsight.")
    if not (is_ours or (is_dataclass(value) and kind.__dataclass_params__.frozen)):  # type: ignore[attr-defined]
        raise TypeError(f"{given}: a study cannot hold this {kind.__name__}; {cure}")
    try:
        options = {}
        for parameter in inspect.signature(kind).parameters.values():
            if parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD, parameter.POSITIONAL_ONLY):
                raise TypeError(f"its class takes {parameter}")
            option = getattr(value, parameter.name)
            if parameter.default is parameter.empty or repr(option) != repr(parameter.default):
                options[parameter.name] = option
        reference, rebuilt = references.reference_to(kind, name), kind(**options)
    except (TypeError, ValueError, AttributeError) as error:
        raise TypeError(f"{given}: cannot be rebuilt from its options ({error}); {cure}") from error
    if repr(rebuilt) != repr(value):
        raise TypeError(f"{given}: its options do not rebuild it; {cure}")
    return {USE: reference, **options}


def thawed(value: object) -> Any:
    """Return a value of a study with lists and dictionaries, as JSON and models have them."""
    if isinstance(value, dict):
        return {name: thawed(one) for name, one in value.items()}
    if not isinstance(value, tuple):
        return value
    return list(value) if set(map(type, value)) <= _SCALARS else [thawed(one) for one in value]


def text_of(value: object) -> str:
    """Return one text for equal values: 2 and 2.0 give the same, also within lists and tables."""
    return canonical(thawed(value))


def are_equal(one: object, other: object) -> bool:
    """Whether two values of a study are equal; 2 and 2.0 are, True and 1 are not."""
    return one is other or (one == other and text_of(one) == text_of(other))


_STORED: dict[str, Any] = {"int": int, "number": float, "flag": bool}


def stored(value: object, kind: str) -> int | float | bool | str:
    """Return a value as a column of results holds it.

    Parameters
    ----------
    value : object
        A value of a parameter, JSON-like.
    kind : str
        The type of its column: "int", "number", "flag" or "text". In a column of texts, what is not a text is JSON.
    """
    if kind == "text":
        return value if isinstance(value, str) else json.dumps(value, sort_keys=True, ensure_ascii=False)
    made: int | float | bool = _STORED[kind](value)
    return made


class Components:
    """Turns values of a study into those that a model takes; references are loaded once.

    Functions, classes and objects of this package, which are immutable, are shared by all runs; other objects are made
    for each run, so that no run finds what another one has left in them.
    """

    def __init__(self) -> None:
        self._shared: dict[str, object] = {}
        # How many objects were made that are not shared.
        self.unshared = 0

    def resolved(self, parameters: Mapping[str, object]) -> dict[str, object]:
        """Return parameters with their components made.

        Raises
        ------
        TypeError, ValueError
            If a reference does not load, or options are wrong.
        """
        if any("." in name for name in parameters):
            parameters = with_tables(parameters)
        return {name: self.made(name, value) for name, value in parameters.items()}

    def made(self, name: str, value: object, one: Declared | None = None) -> object:
        """Return one value of a parameter with the components in it made; `one` declares it, where it is known."""
        if isinstance(value, str):
            # A sensor takes no names of its own, so that any is one of a plug-in.
            is_component = references.is_reference(value) or name == "sensor"
            return self._component(name, value, {}, None) if is_component else value
        if isinstance(value, (int, float)):  # before checks against abstract classes, which are slow
            return value
        if isinstance(value, (list, tuple)):
            return [self.made(name, each) for each in value]
        if not isinstance(value, Mapping):
            return value
        if USE in value:
            return self._component(name, value[USE], {key: its for key, its in value.items() if key != USE}, one)
        return {key: self.made(f"{name}.{key}", its) for key, its in value.items()}

    def _component(self, name: str, reference: Any, options: Mapping[str, object], one: Declared | None) -> object:
        is_reference = references.is_reference(reference)
        # What a name means, depends on the parameter.
        key = f"{'' if is_reference else name}{reference!r}{canonical(options)}"
        if key in self._shared:
            return self._shared[key]
        before, one = self.unshared, one or declared(Settings).get(name)
        is_named = not is_reference and one is not None and isinstance(one.choices, Registry)
        found: Any
        if one is not None and is_named:
            found = of_name(replace(one, name=name), reference)
        elif name == "sensor" and not is_reference and isinstance(reference, str):
            found = plugins.find("teamsight.sensors", reference, name)
        else:
            found = references.load(reference, name)
        made = found
        if inspect.isclass(found) or (is_named and options and callable(found)):
            known = declared(found) if is_dataclass(found) or is_named else {}
            given = {option: self.made(f"{name}.{option}", its, known.get(option)) for option, its in options.items()}
            if known:
                check_options(name, reference, given, known)
            made = found(**given)
        elif options:
            raise TypeError(f"{name}={checks.shown(reference)}: is no class and takes no options; give it alone")
        # One of ours may hold one of theirs.
        is_ours = type(made).__module__.startswith("teamsight.") and self.unshared == before
        if made is found or is_ours:
            self._shared[key] = made
        else:
            self.unshared += 1
        return made


def setting_ids(
    values: Mapping[str, Sequence[object]], strides: Mapping[str, int], settings: int
) -> NDArray[np.uint64]:
    """Return the ids of all settings.

    An id is the first 8 bytes of BLAKE2b of ``canonical`` of the setting: its parameters with their values, in the
    order of their names. So it depends on neither the order of the axes nor on which parameters are swept.

    Parameters
    ----------
    values : mapping of str to sequence
        The values of each parameter.
    strides : mapping of str to int
        For each parameter, how many settings follow each other with one of its values.
    settings : int
        Their number.

    Returns
    -------
    array of uint64
        The ids, (settings,).
    """
    ids = np.empty(settings, np.uint64)
    names = sorted(values)
    # Those of an axis occur again and again.
    texts = {name: [text_of(one) for one in values[name]] for name in names if len(values[name]) <= _CHUNK}
    for start in range(0, settings, _CHUNK):
        which = np.arange(start, min(start + _CHUNK, settings))
        columns = []
        for name in names:
            places = (which // strides[name] % len(values[name])).tolist()
            known = texts[name] if name in texts else {i: text_of(values[name][i]) for i in places}
            columns.append([f"{name}={known[i]}" for i in places])
        rows = map(", ".join, zip(*columns, strict=True)) if columns else [""] * len(which)
        digests = b"".join([hashlib.blake2b(f"{{{row}}}".encode(), digest_size=8).digest() for row in rows])
        ids[start : start + len(which)] = np.frombuffer(digests, ">u8")
    return ids


def hex_of(setting: int) -> str:
    """Return the id of a setting as a text of 16 hexadecimal digits."""
    return f"{int(setting):016x}"


def run_id(setting: int, replicate: int) -> str:
    """Return the id of a run: that of its setting, and the number of the replicate."""
    return f"{hex_of(setting)}-{replicate}"


def scalars(values: Sequence[object]) -> list[object]:
    """Return values that tables can hold: lists and tables become JSON."""
    return [json.dumps(value) if isinstance(value, dict | list | tuple) else value for value in values]
