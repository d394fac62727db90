"""Component: what can be set is declared once, as a field of a frozen dataclass.

From the declaration follow the check and its error, the text of a command line and of a study file, JSON Schema, the
controls of the live page, the parameters of environments, and what reused worlds may rewrite. The field carries its
limits in its annotation, and its meaning in the numpydoc docstring of the class.
"""

from __future__ import annotations

import builtins
import enum
import inspect
import re
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields, is_dataclass, replace
from functools import cache
from types import NoneType, UnionType
from typing import Annotated, Any, Concatenate, Literal, ParamSpec, TypeVar, Union, get_args, get_origin

from teamsight.core import checks

P = ParamSpec("P")
S = TypeVar("S")
W = TypeVar("W")

# Python takes long to read longer numbers, or refuses them.
_LONGEST_NUMBER = 500
_TRUTH = {"true": True, "false": False}
# A line of a docstring that names parameters, and what follows it up to the next such line.
_ENTRY = re.compile(r"^(\w+(?:, \w+)*) : .*\n((?:    .*\n?|\n)+)", re.MULTILINE)
#: The key of a table that makes it a component: its name, or a reference.
USE = "use"
_FORMS = {"flag": "boolean", "integer": "integer", "number": "number", "text": "string", "mapping": "object"}


@dataclass(frozen=True)
class Panel:
    """How the live page shows a setting: the step of its slider and its end, and what the page refuses.

    Attributes
    ----------
    step, reach : float, optional
        The step of the slider, and the largest value that it reaches; larger ones can be typed.
    least, most : float, optional
        What the page takes, where that is less than the limits: it draws every agent.
    only : str
        A condition under which the setting matters, as in ``awareness=ring,nearest``.
    names : tuple of str
        The names that the page offers, where it does not offer all.
    """

    step: float | None = None
    reach: float | None = None
    least: float | None = None
    most: float | None = None
    only: str = ""
    names: tuple[str, ...] = ()


@dataclass(frozen=True)
class Allowed:
    """What a field may be, in its annotation: ``gain: Annotated[float, Allowed(above=0)] = 1.0``.

    Parameters
    ----------
    least, most, above : float, optional
        The limits of a number.
    choices : iterable of str or callable, optional
        The names that may be given, or a function that returns them.
    check : callable, optional
        ``check(name, value)`` returns the value or raises an error, in place of the check of the type.
    cure : str or (str, str)
        What the error says if a limit is exceeded; of whole numbers, for those that are too small and too large.
    unit : str
        The unit of a number.
    live : bool, optional
        Whether it may change in a run.
    rewritten : bool, optional
        Whether a built world can begin its next run with another value.
    panel : Panel, optional
        How the live page shows it.
    section, label : str
        Under which heading the live page shows it, and how it calls it.
    metavar, shown : str
        What stands in the help of a command for the value, and for the default.
    is_argument, is_repeated : bool, optional
        Whether a command takes it as an argument, without a name; and whether it may be given several times.
    is_sorted : bool, optional
        Whether a list is kept in ascending order.
    parse : callable, optional
        ``parse(text)`` returns the value for a text of a command line.
    """

    least: float | None = None
    most: float | None = None
    above: float | None = None
    choices: Iterable[str] | Callable[[], Iterable[str]] | None = None
    check: Callable[[str, Any], Any] | None = None
    cure: str | tuple[str, str] = ""
    unit: str = ""
    live: bool | None = None
    rewritten: bool | None = None
    panel: Panel | None = None
    section: str = ""
    label: str = ""
    metavar: str = ""
    shown: str = ""
    is_argument: bool | None = None
    is_repeated: bool | None = None
    is_sorted: bool | None = None
    parse: Callable[[Any], Any] | None = None

    def beside(self, other: Allowed) -> Allowed:
        """Return both; what `other` says counts."""
        return replace(self, **{name: value for name, value in vars(other).items() if value not in (None, "")})


Flag = Annotated[bool, Allowed()]
Count = Annotated[int, Allowed(least=1)]
Index = Annotated[int, Allowed(least=0)]
Seed = Annotated[int, Allowed(least=0, most=checks.MOST_SEED, cure="give another seed")]
Positive = Annotated[float, Allowed(above=0)]
NonNegative = Annotated[float, Allowed(least=0)]
Probability = Annotated[float, Allowed(least=0, most=1)]


def number_in(text: Any) -> Any:
    """Return the number that a text spells, or the text itself, which a check then refuses."""
    if not isinstance(text, str) or len(text) > _LONGEST_NUMBER:
        return text
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def value_in(text: Any) -> Any:
    """Return the number or truth value that a text spells, or the text itself."""
    return _TRUTH.get(text.lower(), number_in(text)) if isinstance(text, str) else text


@dataclass(frozen=True)
class Declared:
    """One setting, as it is declared.

    Attributes
    ----------
    name : str
        Its name.
    kind : {"flag", "integer", "number", "choice", "text", "path", "component", "list", "mapping", "object"}
        What it is. A component is given by name or as an object; objects are checked by what they are given to.
    default : object
        Its default; `MISSING` if it must be given.
    allowed : Allowed
        Its limits.
    meaning : str
        What the docstring says of it.
    is_optional : bool
        Whether it may be None.
    is_checked : bool
        Whether the annotation says what it may be.
    is_open : bool
        Whether objects may be given too, which check themselves.
    item : Declared, optional
        Of a list, what its items are.
    names : mapping of str to object
        Of a choice, the values by name, where they are no texts.
    """

    name: str
    kind: str
    default: Any = MISSING
    allowed: Allowed = Allowed()
    meaning: str = ""
    is_optional: bool = False
    is_checked: bool = False
    is_open: bool = False
    item: Declared | None = None
    names: Mapping[str, Any] | None = None

    @property
    def choices(self) -> Iterable[str]:
        """The names that may be given."""
        given = self.allowed.choices
        return given() if callable(given) else self.names or given or ()

    def checked(self, value: Any, name: str = "") -> Any:
        """Return a value in the form in which it is kept.

        Parameters
        ----------
        value : object
            What was given.
        name : str
            What the error calls it; by default its name.

        Raises
        ------
        TypeError, ValueError
            With the value, the limit and the cure.
        """
        name, allowed = name or self.name, self.allowed
        if value is None and self.is_optional:
            return None
        if allowed.check is not None:
            return allowed.check(name, value)
        if self.kind == "flag":
            return checks.flag(name, value)
        if self.kind == "integer":
            low, high = (allowed.cure, allowed.cure) if isinstance(allowed.cure, str) else allowed.cure
            least = 0 if allowed.least is None else int(allowed.least)
            checks.count(name, value, least=least, cure=low)
            return checks.count(
                name, value, least=least, most=None if allowed.most is None else int(allowed.most), cure=high
            )
        if self.kind == "number":
            return checks.number(
                name, value, above=allowed.above, least=allowed.least, most=allowed.most, cure=str(allowed.cure)
            )
        if self.kind == "component" and not isinstance(value, str):
            return value
        if self.kind in ("choice", "component") and not (self.names and value in self.names.values()):
            chosen = checks.choice(name, value, self.choices)
            return self.names[chosen] if self.names else chosen
        if self.kind == "text" and not isinstance(value, str):
            raise TypeError(f"{name}={checks.shown(value)}: must be a text")
        if self.item is not None:
            if isinstance(value, str) or not isinstance(value, Iterable):
                raise TypeError(f"{name}={checks.shown(value)}: must be several values, as in [1, 2]")
            found = tuple(dict.fromkeys(self.item.checked(one, name) for one in value))
            if allowed.most is not None and len(found) > allowed.most:
                raise ValueError(f"{name}: are {len(found)} values, at most {allowed.most:g}; leave some out")
            return tuple(sorted(found)) if allowed.is_sorted else found
        if self.kind == "mapping" and not isinstance(value, Mapping):
            raise TypeError(f"{name}={checks.shown(value)}: must be a mapping, as in {{'robots': 5}}")
        return value

    def parsed(self, text: Any) -> Any:
        """Return the value for the text of a command line, or for several."""
        if self.allowed.parse is not None:
            text = self.allowed.parse(text)
        elif self.item is not None:
            parts = text.split(",") if isinstance(text, str) else text
            text = [self.item.parsed(part.strip()) for part in parts]
        elif self.kind == "mapping":
            text = assignments(self.name, text)
        elif self.kind == "flag":
            text = _TRUTH.get(text.lower(), text) if isinstance(text, str) else text
        elif self.kind not in ("text", "choice", "component", "path"):
            text = value_in(text)
        return self.checked(text)

    def schema(self) -> dict[str, Any]:
        """Return the JSON Schema of a value, with what it means."""
        form: dict[str, Any] = {"description": self.meaning} if self.meaning else {}
        allowed = self.allowed
        if self.kind in _FORMS:
            form["type"] = [_FORMS[self.kind], "string", "object"] if self.is_open else _FORMS[self.kind]
        elif self.kind == "list":
            form["type"] = "array"
        elif self.kind == "choice":
            form["enum"] = list(self.choices)
        elif self.kind == "component":
            # A name, also of a plug-in, or a table with its options.
            form["type"] = ["string", "object"]
        limits = {"minimum": allowed.least, "maximum": allowed.most, "exclusiveMinimum": allowed.above}
        if self.kind in ("integer", "number"):
            form |= {key: limit for key, limit in limits.items() if limit is not None}
        if self.kind == "text" and self.default:
            form["minLength"] = 1
        if isinstance(self.default, (bool, int, float, str)):
            form["default"] = self.default
        return form


def assignments(name: str, given: Iterable[str]) -> dict[str, Any]:
    """Return values by name, each given as NAME=VALUE; values are numbers, true, false or texts.

    A name may have two parts with a dot between them, as in forage.side.

    Raises
    ------
    ValueError
        If one has another form, or is given twice.
    """
    found: dict[str, Any] = {}
    for text in given:
        parameter, equals, value = text.partition("=")
        parts = parameter.split(".")
        if not equals or len(parts) > 2 or not all(map(str.isidentifier, parts)):
            raise ValueError(f"{name}={checks.shown(text)}: must be NAME=VALUE, as in policy=centroid")
        if parameter in found:
            raise ValueError(f"{name}={checks.shown(text)}: is given twice; leave one out")
        found[parameter] = value_in(value)
    return found


class Component:
    """The base class of what is declared by fields: subclasses are frozen dataclasses.

    The fields that say what they may be are checked, in their order. A subclass that checks more calls
    ``super().__post_init__()`` first.

    Raises
    ------
    TypeError, ValueError
        With the value, the limit and the cure.
    """

    def __post_init__(self) -> None:
        values = vars(self)
        kind: Any = type(self)
        for name, check, default, kept in _checks_of(kind):
            value = values[name]
            found = kept if value is default else check(value)
            if found is not value:
                object.__setattr__(self, name, found)


@cache
def _checks_of(component: Any) -> list[tuple[str, Callable[[Any], Any], Any, Any]]:
    """Return the name of each field that is checked, its check, its default, and the form in which that is kept."""
    found: list[tuple[str, Callable[[Any], Any], Any, Any]] = []
    for name, one in declared(component).items():
        if one.is_checked:
            # A default is checked once, unless what is kept of it may change.
            default: Any = one.default
            kept = None if default is MISSING or isinstance(default, (dict, list)) else one.checked(default)
            if not (kept is default or isinstance(kept, (bool, int, float, str))):
                default = MISSING
            found.append((name, one.checked, default, kept))
    return found


class _Namespace(dict[str, Any]):
    """The names of a module; one that only type checkers know stands for anything."""

    def __init__(self, module: Mapping[str, Any]) -> None:
        super().__init__(module)

    def __missing__(self, name: str) -> Any:
        return vars(builtins).get(name, Any)


def _evaluated(hint: Any, module: Mapping[str, Any]) -> Any:
    if not isinstance(hint, str):
        return hint
    try:
        return eval(hint, {}, _Namespace(module))  # an annotation, as `typing.get_type_hints` evaluates it
    except Exception:  # whatever the annotation of a user is
        return Any


def _divided(hint: Any) -> tuple[Any, Allowed | None, bool]:
    """Return the type in an annotation, what is allowed, and whether None is."""
    allowed: Allowed | None = None
    is_optional = False
    while True:
        if get_origin(hint) is Annotated:
            hint, *notes = get_args(hint)
            for note in notes[::-1]:
                if isinstance(note, Allowed):
                    # The outer annotation counts; in one that was joined of several it is the last.
                    allowed = note if allowed is None else note.beside(allowed)
        elif get_origin(hint) in (Union, UnionType) and NoneType in get_args(hint):
            rest = [one for one in get_args(hint) if one is not NoneType]
            is_optional = True
            hint = rest[0] if len(rest) == 1 else Union[tuple(rest)]  # noqa: UP007  made of a list
        else:
            return hint, allowed, is_optional


def _declared(name: str, hint: Any, default: Any, meaning: str = "") -> Declared:
    kind, given, is_optional = _divided(hint)
    allowed = given or Allowed()
    names: Mapping[str, Any] | None = None
    item = None
    origin = get_origin(kind)
    if origin is Literal:
        values = get_args(kind)
        texts = all(isinstance(one, str) for one in values)
        allowed = replace(allowed, choices=tuple(map(str, values)))
        found, names = "choice", None if texts else {str(one): one for one in values}
        given = allowed
    elif isinstance(default, enum.Enum) or (isinstance(kind, type) and issubclass(kind, enum.Enum)):
        members: Any = kind if isinstance(kind, type) and issubclass(kind, enum.Enum) else type(default)
        found, names = "choice", {one.name: one for one in members}
    elif allowed.choices is not None:
        found = "choice" if kind is str else "component"
    elif origin in (tuple, list, Sequence) and isinstance(default, (tuple, list)) and get_args(kind):
        found, item = "list", _declared(name, get_args(kind)[0], MISSING)
    elif origin is not None and isinstance(origin, type) and issubclass(origin, Mapping):
        found = "mapping"
    else:
        found = _plain(kind)
        if found == "object" and (kind is Any or not allowed.check):
            found = _plain(type(default))
            found = "object" if found == "text" else found
    return Declared(
        name, found, default, allowed, meaning, is_optional or default is None, given is not None, kind is Any, item,
        names,
    )  # fmt: skip


def _plain(kind: Any) -> str:
    kinds = {bool: "flag", int: "integer", float: "number", str: "text"}
    if kind in kinds:
        return kinds[kind]
    return "path" if getattr(kind, "__name__", "") in ("Path", "PathLike") else "object"


@cache
def meanings(owner: Any) -> Mapping[str, str]:
    """Return what the docstrings of a class or function, and of its base classes, say of each parameter."""
    found: dict[str, str] = {}
    for one in owner.__mro__[:-1] if isinstance(owner, type) else (owner,):
        text = inspect.cleandoc(vars(one).get("__doc__") or "") if isinstance(one, type) else inspect.getdoc(one) or ""
        entries = _ENTRY.findall(text.partition("Returns\n---")[0] + "\n")
        for names, meaning in entries:
            for name in names.split(", "):
                found.setdefault(name, " ".join(meaning.split()))
    return found


def declared(owner: Any) -> Mapping[str, Declared]:
    """Return what can be set of a component, or of a class or function that makes something, by name.

    Parameters
    ----------
    owner : type or callable
        A dataclass; a class that is `built_from` one; or any class or function, whose signature then counts.

    Raises
    ------
    TypeError, ValueError
        If it has no signature.
    """
    return _declarations(owner)


@cache
def _declarations(owner: Any) -> Mapping[str, Declared]:
    component = _component(owner)
    if component is not None:
        known = meanings(component)
        return {
            field.name: _declared(field.name, _hint(component, field.name, field.type), _default(field),
                                  known.get(field.name, ""))
            for field in fields(component) if field.init
        }  # fmt: skip
    known, base = meanings(owner), _base(owner)
    function = inspect.unwrap(vars(owner).get("__init__", owner) if isinstance(owner, type) else owner)
    module = getattr(function, "__globals__", None) or vars(sys.modules.get(owner.__module__, builtins))
    found = {}
    for name, one in inspect.signature(owner).parameters.items():
        if one.kind in (one.VAR_KEYWORD, one.VAR_POSITIONAL, one.POSITIONAL_ONLY):
            continue
        default = MISSING if one.default is one.empty else one.default
        if name in base:
            found[name] = base[name] if default is MISSING else replace(base[name], default=default)
        else:
            hint = Any if one.annotation is one.empty else _evaluated(one.annotation, module)
            made = _declared(name, hint, default, known.get(name, ""))
            # Of one without an annotation, a command line can only read what a text spells.
            found[name] = replace(made, allowed=Allowed(parse=value_in)) if one.annotation is one.empty else made
    return found


def _component(owner: Any) -> Any:
    """Return the dataclass that declares what is set of something; None if there is none."""
    made_from = getattr(getattr(owner, "__init__", None), "component", None) if isinstance(owner, type) else None
    if made_from is not None:
        return made_from
    return owner if isinstance(owner, type) and is_dataclass(owner) else None


def _base(owner: Any) -> Mapping[str, Declared]:
    """Return the declarations of the nearest base class that has some, or of what a model `makes`."""
    if (made := getattr(owner, "makes", None)) is not None:
        return declared(made)
    for one in owner.__mro__[1:] if isinstance(owner, type) else ():
        if _component(one) is not None:
            return declared(one)
    return {}


def _hint(component: type, name: str, hint: Any) -> Any:
    """Return the annotation of a field, evaluated in the module of the class that has it."""
    home = next((one for one in component.__mro__ if name in vars(one).get("__annotations__", ())), component)
    return _evaluated(hint, vars(sys.modules.get(home.__module__, builtins)))


def _default(field: Any) -> Any:
    return field.default if field.default_factory is MISSING else field.default_factory()


def of_name(one: Declared, name: str) -> Any:
    """Return the class or function that makes a component of a name.

    Raises
    ------
    ValueError
        If there is none; the error suggests the nearest.
    """
    registry: Any = one.choices
    return registry[checks.choice(one.name, name, registry)]


def check_options(name: str, component: Any, given: Iterable[str], known: Mapping[str, Declared]) -> None:
    """Refuse settings that a component does not have, and missing ones.

    Parameters
    ----------
    name, component : str, object
        The parameter, and what was given for it; for the error.
    given : iterable of str
        The settings that are given.
    known : mapping of str to Declared
        Those that it has.

    Raises
    ------
    ValueError
        Naming the setting.
    """
    given = list(given)
    for one in given:
        if one not in known:
            listed = f"{checks.suggestion(one, known)}its settings are {', '.join(known) or 'none'}"
            raise ValueError(f"{name}.{one}: {component!r} has none; {listed}")
    for one, its in known.items():
        if its.default is MISSING and one not in given:
            raise ValueError(f"{name}={component!r}: needs {one}; give {name}.{one} too")


def with_tables(given: Mapping[str, Any], where: str = "") -> dict[str, Any]:
    """Return values by name, each together with its settings: policy and policy.gain become one table, policy.

    Parameters
    ----------
    given : mapping of str to object
        Values by name. Settings of a setting have more dots, as policy.policy.gain.
    where : str
        What stands before the names in the error.

    Raises
    ------
    ValueError
        If there are settings of what is not given by name or as a table.
    """
    settings: dict[str, dict[str, Any]] = {}
    for name, value in given.items():
        base, dot, setting = name.partition(".")
        if dot:
            settings.setdefault(base, {})[setting] = value
    found = {name: value for name, value in given.items() if "." not in name}
    for base, its in settings.items():
        value = found.get(base)
        table = {USE: value} if isinstance(value, str) else value
        if not isinstance(table, Mapping):
            first = f"{where}{base}.{next(iter(its))}"
            raise ValueError(f"{first}: is a setting of a component; give {where}{base} too, by name or as a table")
        found[base] = with_tables({**table, **its}, f"{where}{base}.")
    return found


def defaults_of(owner: Any) -> dict[str, Any]:
    """Return the default of each setting that has one."""
    return {name: one.default for name, one in declared(owner).items() if one.default is not MISSING}


def built_from(component: Callable[P, S]) -> Callable[[Callable[[W, S], None]], Callable[Concatenate[W, P], None]]:
    """Return a decorator of ``__init__(self, settings)``, which then takes the fields of the component.

    Parameters
    ----------
    component : type
        The class of the settings. Its class method ``of(values)`` makes one from the values that were given.
    """

    def decorate(begin: Callable[[W, S], None]) -> Callable[Concatenate[W, P], None]:
        own: Any = component
        signature = inspect.signature(component)
        names = tuple(signature.parameters)
        places = [one.name for one in signature.parameters.values() if one.kind is one.POSITIONAL_OR_KEYWORD]

        def begun(self: W, /, *args: P.args, **kwargs: P.kwargs) -> None:
            values = dict(zip(places, args, strict=False))
            if len(args) > len(places) or not (kwargs.keys() <= known.keys() and values.keys().isdisjoint(kwargs)):
                try:
                    signature.bind(*args, **kwargs)
                except TypeError as error:
                    wrong = [name for name in kwargs if name not in names]
                    hint = checks.suggestion(wrong[0], names) if wrong else ""
                    raise TypeError(f"{type(self).__name__}: {error}{f'; {hint}' if hint else ''}") from None
            values.update(kwargs)
            begin(self, own.of(values))

        first = inspect.Parameter("self", inspect.Parameter.POSITIONAL_OR_KEYWORD)
        known, plain = declared(own), {"flag": bool, "integer": int, "number": float}
        shown = [
            one.replace(annotation=plain.get(known[name].kind, one.empty), default=known[name].default)
            for name, one in signature.parameters.items()
        ]
        made: Any = begun
        made.__signature__ = signature.replace(parameters=[first, *shown], return_annotation=None)
        made.component, made.__doc__ = component, begin.__doc__
        made.__module__, made.__qualname__ = begin.__module__, begin.__qualname__
        return begun

    return decorate
