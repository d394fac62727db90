"""Links: the task, the settings, the seed, the tick and the interventions of a page, as its address has them after #.

A link is read on the server, where each of its values is checked as those of messages are: settings by their controls,
and interventions like those of a page. It names no file and no module.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple
from urllib.parse import parse_qsl, quote, unquote, urlencode

from teamsight.agents.cmommt import CMOMMT
from teamsight.agents.components.durations import Exponential
from teamsight.agents.components.failures import Failures
from teamsight.core import checks
from teamsight.core.component import Component, declared, number_in, of_name
from teamsight.live import protocol
from teamsight.live.controls import GIVEN, Control, control_of_option, model_name, unset_choices
from teamsight.live.interventions import Act, Entry, Journal, Place
from teamsight.live.worlds import value_of, with_value

if TYPE_CHECKING:
    from teamsight.live.worlds import Worlds

#: The version of links; a page reads its own only.
VERSION = "1"
#: The latest tick to which a link leads.
MOST_TICK = 1_000_000
#: Characters of the interventions in a link, at most; a longer log is left out.
MOST_LOG = 2000
_MOST_FIELDS, _MOST_QUOTED = 200, 80
_OWN = ("v", "task", "seed", "tick", "two", "did")
_RIGHT, _OPTIONS = "right.", "_options"
# What stands in a link for a source of failures, and the parameter that it is.
_FAILURES, _EVENTS = ("failures", "repair"), "events"
_DAMAGED = "is damaged; copy the link again"
# Shorter times between failures would be more events than a server has time for.
_TIME = partial(checks.number, least=1, most=1e15)
_COUNT = partial(checks.count, least=0, most=2**53)


class Link(NamedTuple):
    """What a link says.

    Attributes
    ----------
    task : str
        The name of the task or model.
    fields : dict of str to str
        All else, as texts.
    """

    task: str
    fields: dict[str, str]


class Opened(NamedTuple):
    """Where a link leads.

    Attributes
    ----------
    settings : list of dict
        The arguments of each world.
    seed : int or None
        The seed; None for the present one.
    tick : int
        The tick.
    acts : list of list of (int, Act)
        What is then done to each world, after how many steps.
    """

    settings: list[dict[str, Any]]
    seed: int | None
    tick: int
    acts: list[list[tuple[int, Act]]]


def has_failures(model: Callable[..., Any]) -> bool:
    """Return whether robots of a model may fail, as its argument `events` says."""
    kind = getattr(model, "makes", model)
    return isinstance(kind, type) and issubclass(kind, CMOMMT)


def read(text: str) -> Link:
    """Return what a link says.

    Raises
    ------
    ValueError
        If it is damaged, or of another version.
    """
    try:
        pairs = parse_qsl(text, keep_blank_values=True, strict_parsing=True, max_num_fields=_MOST_FIELDS)
    except ValueError as error:
        said = str(error)
        # It quotes the field, which may be all of the link.
        raise ValueError(f"it is damaged ({said if len(said) < _MOST_QUOTED else said[:_MOST_QUOTED] + '…'})") from None
    fields = dict(pairs)
    if len(fields) < len(pairs) or "v" not in fields or "task" not in fields:
        raise ValueError("it is damaged: it must have v and task, and each name once")
    if fields["v"] != VERSION:
        raise ValueError(f"it is of version {checks.shown(fields['v'])}, and this page reads {VERSION}; copy it again")
    del fields["v"]
    return Link(fields.pop("task"), fields)


def opened(link: Link, model: Callable[..., Any], controls: Mapping[str, Control], given: Mapping[str, Any]) -> Opened:
    """Return where a link leads.

    What it does not name has its default; of the given arguments only those stay that no link can carry.

    Raises
    ------
    TypeError, ValueError
        If a name is no control, its control refuses the value, or an intervention is none that a page could ask for.
    """
    fields = dict(link.fields)
    seed = int(controls["seed"].checked(fields.pop("seed"))) if "seed" in controls and "seed" in fields else None
    tick = checks.count("tick", number_in(fields.pop("tick", "0")), least=0, most=MOST_TICK)
    is_pair = checks.choice("two", fields.pop("two", "no"), ("no", "yes")) == "yes"
    log = fields.pop("did", "")
    logs = [log, fields.pop(f"{_RIGHT}did", log)] if is_pair else [log]
    right = {key.removeprefix(_RIGHT): fields.pop(key) for key in list(fields) if key.startswith(_RIGHT)}
    if right and not is_pair:
        raise ValueError(f"link={checks.shown(_RIGHT + next(iter(right)))}: cannot be set by a link; leave it out")
    texts, known = _Texts(model, controls), declared(model)
    left = {
        name: one for name, one in given.items()
        if name not in known or known[name].default is MISSING or (name not in controls and texts.of(name, one) is None)
    }  # fmt: skip
    left |= texts.settings(fields, left)
    settings = [left, {**left, **texts.settings(right, left)}] if is_pair else [left]
    acts = [texts.acts(log, one, tick) for log, one in zip(logs, settings, strict=True)]
    return Opened(settings, seed, tick, acts)


def written(
    worlds: Worlds, controls: Mapping[str, Control], *, running: bool, most: int = MOST_LOG
) -> tuple[str, list[str]]:
    """Return the link to the worlds of a page, and sentences about what is not in it.

    Parameters
    ----------
    worlds, controls
        The worlds and the controls.
    running : bool
        Whether they run: then it leads to their beginning, with the present settings.
    most : int
        Characters of the interventions in it, at most.
    """
    texts, said, tracks = _Texts(worlds.model, controls), list[str](), list(worlds.tracks)
    fields = {"v": VERSION, "task": model_name(worlds.model)}
    if "seed" in controls:
        fields["seed"] = str(worlds.seed)
    if worlds.made and not running:
        fields["tick"] = str(worlds.made)
    if len(tracks) == 2:
        fields["two"] = "yes"
    journals = [track.journal for track in tracks]
    logs = [] if running else _logs(texts, journals, most)
    if running:
        said.append("The worlds run: the link leads to their start. Pause for a link to a tick.")
    if not logs and any(one.entries for one in journals):
        said.append(f"What was done to the worlds is not in the link, which has at most {most:,} characters of it.")
    # With what was done to it a world begins as it was built, else as it is now.
    left, *others = [track.journal.parameters if logs else track.parameters for track in tracks]
    for name, value in left.items():
        fields |= texts.said(name, value, said)
    for right in others:
        for name in dict.fromkeys([*left, *right]):
            if not _is_same(value_of(worlds.model, left, name), value := value_of(worlds.model, right, name)):
                found = texts.said(name, value, said, usual=True)
                fields |= {f"{_RIGHT}{key}": text for key, text in found.items()}
    for side, log in zip(("", _RIGHT), logs, strict=False):
        if log != (logs[0] if side else ""):
            fields[f"{side}did"] = log
    return _encoded(fields), list(dict.fromkeys(said))


def _encoded(fields: Mapping[str, str]) -> str:
    return urlencode(fields, safe="*")


def _logs(texts: _Texts, journals: list[Journal], most: int) -> list[str]:
    """Return the interventions of each world as texts; none if they are too long, or one has no text."""
    logs = [texts.log(one.parameters, list(one.entries)) for one in journals]
    found = [one for one in logs if one is not None]
    size = sum(len(_encoded({"did": one})) for one in dict.fromkeys(found))
    return found if len(found) == len(logs) and size <= most else []


class _Texts:
    """Settings and interventions of a model as texts of a link, and back.

    Parameters
    ----------
    model : callable
        The model.
    controls : mapping of str to Control
        What a page can set of it.
    """

    def __init__(self, model: Callable[..., Any], controls: Mapping[str, Control]) -> None:
        # Another page may have been started with what is no control of this one.
        self._model, self._controls = model, {**unset_choices(model), **controls}

    def said(self, name: str, value: Any, said: list[str], *, usual: bool = False) -> dict[str, str]:
        """Return the texts `of` an argument; what another page cannot read is noted."""
        found = self.of(name, value, usual=usual)
        if found is None or found.get(name, "").endswith(GIVEN):
            said.append(f"{name}={checks.shown(value)} is known only to a page that was started with it.")
        return found or {}

    def of(self, name: str, value: Any, *, usual: bool = False) -> dict[str, str] | None:
        """Return the texts of an argument: its own, and those of its options as "policy.gain"; None if it has none.

        A default needs none, unless `usual` values are wanted too.
        """
        one, control = declared(self._model).get(name), self._controls.get(name)
        if one is not None and not usual and one.default is not MISSING and _is_same(one.default, value):
            return {}
        if control is not None and isinstance(value, Component) and (found := _of_component(control, value)):
            return found
        if control is not None:
            text = _text_of(control, value)
            return None if text is None else {name: text}
        if self._has_failures(name):
            return _of_failures(value)
        if self._is_options(name) and isinstance(value, Mapping):
            found = {f"{name}.{key}": _plain(its) or "" for key, its in value.items()}
            return (found or {name: ""}) if all(found.values()) else None
        return None

    def settings(self, fields: Mapping[str, str], before: Mapping[str, Any]) -> dict[str, Any]:
        """Return the arguments that texts name; `before` has others.

        Raises
        ------
        TypeError, ValueError
            As `opened`.
        """
        found, grouped = dict[str, Any](), dict[str, dict[str, str]]()
        for key, text in fields.items():
            base = _FAILURES[0] if key in _FAILURES and self._has_failures(_EVENTS) else key.partition(".")[0]
            grouped.setdefault(base, {})[key] = text
        # Options of a policy after the policy.
        for name, texts in sorted(grouped.items(), key=lambda one: self._is_options(one[0])):
            if self._is_options(name):
                base = name.removesuffix(_OPTIONS)
                kind = found.get(base, before.get(base, self._controls[base].declared.default))
                found[name] = {} if texts == {name: ""} else _options(self._controls[base], kind, texts)
            elif name == _FAILURES[0] and self._has_failures(_EVENTS):
                times = (_TIME(one, number_in(texts.get(one, ""))) for one in _FAILURES[: len(texts)])
                found[_EVENTS] = Failures(*times)
            else:
                found[name] = self._setting(name, texts)
        return found

    def _setting(self, name: str, texts: Mapping[str, str]) -> Any:
        control = self._controls[checks.choice("link", name, tuple(self._controls))]
        if name in _OWN:
            raise ValueError(f"link={checks.shown(name)}: cannot be set by a link; leave it out")
        if list(texts) == [name]:
            return control.checked(_value(control, texts[name]))
        options = {key: text for key, text in texts.items() if key != name}
        kind = texts.get(name, "")
        return of_name(control.declared, _named(control, kind, name))(**_options(control, kind, options))

    def log(self, parameters: dict[str, Any], entries: Iterable[Entry]) -> str | None:
        """Return what was done to a world that was built with some arguments; None if a link cannot say it."""
        parts = list[str]()
        for entry in entries:
            kind, fields = entry.act
            if kind == "set":
                texts = self._of_set(parameters, **fields)
                if texts is None or any(text.endswith(GIVEN) for text in texts.values()):
                    return None
                words = [word for pair in texts.items() for word in pair]
                parameters = with_value(self._model, parameters, **fields)
            else:
                where = [fields[name] for name in ("place", "number") if name in fields]
                rest = [value for name, value in fields.items() if name not in ("place", "number")]
                words = [_plain(word) or "" for word in _flat([*where, *rest])]
            parts.append(" ".join([str(entry.made), kind, *(quote(word, safe="") for word in words)]))
        return "*".join(parts)

    def _of_set(self, parameters: Mapping[str, Any], name: str, value: Any) -> dict[str, str] | None:
        option = self._option(parameters, name)
        if option is None:
            return self.of(name, value, usual=True)
        text = _text_of(option, value)
        return None if text is None else {name: text}

    def _option(self, parameters: Mapping[str, Any], name: str) -> Control | None:
        """Return what checks a setting of a component, ``policy.gain``; None for any other name."""
        base, _, inner = name.partition(".")
        component = value_of(self._model, parameters, base) if inner and base in self._controls else None
        if not isinstance(component, Component) or inner not in declared(type(component)):
            return None
        return control_of_option(self._controls[base], type(component), inner)

    def acts(self, log: str, parameters: dict[str, Any], tick: int) -> list[tuple[int, Act]]:
        """Return what a log says was done, after how many steps.

        Raises
        ------
        TypeError, ValueError
            If a page could not ask for it, or it is later than `tick`.
        """
        found, made = list[tuple[int, Act]](), 0
        for part in log.split("*") if log else ():
            first, kind, *words = (*map(unquote, part.split(" ")), "")
            made = checks.count("did", number_in(first), least=made, most=tick, cure=_DAMAGED)
            checks.choice("did", kind, ("set", *protocol.INTERVENTIONS))
            # The empty word that stands for a missing kind.
            words = words[:-1]
            fields = self._of_words(parameters, words) if kind == "set" else _of_words(kind, words)
            if kind == "set":
                parameters = with_value(self._model, parameters, **fields)
            found.append((made, Act(kind, fields)))
        return found

    def _of_words(self, parameters: dict[str, Any], words: list[str]) -> dict[str, Any]:
        texts = dict(zip(words[::2], words[1::2], strict=False))
        name = next(iter(texts), "")
        if len(words) != 2 * len(texts) or not texts:
            raise ValueError(f"did={checks.shown(' '.join(words))}: {_DAMAGED}")
        control = self._controls.get(name.partition(".")[0])
        if control is None or not control.live:
            raise ValueError(f"did={checks.shown(name)}: cannot be set in a run; leave it out")
        option = self._option(parameters, name)
        if option is not None and len(texts) == 1:
            return {"name": name, "value": option.checked(_value(option, texts[name]))}
        base = name.partition(".")[0]
        return {"name": base, "value": self._setting(base, texts)}

    def _has_failures(self, name: str) -> bool:
        return name == _EVENTS and name not in self._controls and has_failures(self._model)

    def _is_options(self, name: str) -> bool:
        """Whether a parameter has the options of a policy that is given by name: ``policy_options``."""
        one, base = declared(self._model).get(name), name.removesuffix(_OPTIONS)
        return one is not None and one.kind == "mapping" and base != name and base in self._controls


def _named(control: Control, kind: Any, name: str) -> str:
    """Return the name of a component, if it is one of those that the page offers."""
    # Nothing of a link is looked up as a reference or as a plug-in.
    if not isinstance(kind, str) or kind not in control.choices or kind not in tuple(control.declared.choices):
        raise ValueError(f"link={checks.shown(name)}: has options; give {control.name} by its name too")
    return kind


def _options(control: Control, kind: Any, texts: Mapping[str, str]) -> dict[str, Any]:
    """Return the options of a component of this name that texts have."""
    found, made = {}, of_name(control.declared, _named(control, kind, next(iter(texts), "")))
    for key, text in texts.items():
        inner = key.partition(".")[2]
        option = control_of_option(control, made, checks.choice(key, inner, tuple(declared(made)) or ("none",)))
        if option is None:
            raise ValueError(f"link={checks.shown(key)}: cannot be set by a link; leave it out")
        found[inner] = option.checked(_value(option, text))
    return found


def _of_component(control: Control, value: Component) -> dict[str, str] | None:
    """Return the texts of a component: its name, and its options. None if they do not say all of it."""
    known, texts = control.declared.choices, dict[str, str]()
    # The name that it says is tried first: each other one is imported.
    names = sorted(known, key=lambda key: key != getattr(value, "name", "")) if isinstance(known, Mapping) else ()
    kind = next((key for key in names if of_name(control.declared, key) is type(value)), None)
    for inner, its in declared(type(value)).items():
        option, is_usual = control_of_option(control, type(value), inner), _is_same(getattr(value, inner), its.default)
        text = None if option is None else _text_of(option, getattr(value, inner))
        # One at least is said: a name alone may have other options, those of the model.
        if text is not None and (not is_usual or not texts):
            texts[f"{control.name}.{inner}"] = text
        elif text is None and not is_usual:
            return None
    if kind is None or not _is_same(type(value)(**(_options(control, kind, texts) if texts else {})), value):
        return None
    return {control.name: kind, **texts}


def _of_failures(value: Any) -> dict[str, str] | None:
    if type(value) is not Failures:
        return None
    times = [getattr(value, one) for one in Failures.parameters]
    if any(not isinstance(one, Exponential) or one.mean < 1 for one in times if one is not None):
        return None
    return {name: _plain(one.mean) or "" for name, one in zip(_FAILURES, times, strict=True) if one is not None}


def _of_words(kind: str, words: list[str]) -> dict[str, Any]:
    """Return the fields of an intervention, each checked as that of a message."""
    known = {name: check for name, check in protocol.KINDS[kind].items() if name not in ("track", "both", "run")}
    checked: dict[str, Any] = {"group": _COUNT, "member": _COUNT} if "body" in known else {}
    checked |= {name: check for name, check in known.items() if name not in ("body", "points")}
    given: list[Any] = list(map(number_in, words))
    if "points" in known:
        given = [*words[:1], [list(pair) for pair in zip(given[1::2], given[2::2], strict=False)]]
        checked["points"] = known["points"]
    elif "on" in known:
        given[-1:] = [{0: False, 1: True}.get(given[-1], given[-1])] if given else []
    if len(given) != len(checked) or ("points" in known and len(words) % 2 == 0):
        raise ValueError(f"did={checks.shown(' '.join([kind, *words]))}: {_DAMAGED}")
    fields = {name: check(name, one) for (name, check), one in zip(checked.items(), given, strict=True)}
    if "body" in known:
        fields = {"place": Place(fields.pop("group"), fields.pop("member")), **fields}
    return {"number" if name == "group" else name: one for name, one in fields.items()}


def _flat(value: Any) -> Iterable[Any]:
    """Yield the numbers and texts of a field of an intervention."""
    if isinstance(value, (list, tuple)):
        for one in value:
            yield from _flat(one)
    else:
        yield int(value) if isinstance(value, bool) else value


def _plain(value: Any) -> str | None:
    """Return a number, a truth value or a text as a link has it; None of anything else."""
    value = value.item() if hasattr(value, "item") else value
    if isinstance(value, bool):
        return str(value).lower()
    return str(value) if isinstance(value, (int, float, str)) else None


def _text_of(control: Control, value: Any) -> str | None:
    """Return the text of a value that its control reads as that value; None if there is none."""
    shown = control.shown(value)
    if control.kind == "choice":
        return shown if _is_same(control.choices.get(shown, MISSING), value) else None
    text = _plain(shown)
    try:
        # Of a cycle the page shows the period; it may have more.
        is_whole = shown is value or _is_same(type(value)(shown), value)
        if text is None or not is_whole or not _is_same(control.checked(_value(control, text)), shown):
            return None
    except (TypeError, ValueError):
        return None
    return text


def _is_same(one: Any, other: Any) -> bool:
    if one is other:
        return True
    try:
        return bool(one == other)
    except Exception:  # whatever the values of a user do
        return False


def _value(control: Control, text: str) -> Any:
    """Return a text as its control takes it."""
    if control.kind == "flag":
        return {"true": True, "false": False}.get(text, text)
    return number_in(text) if control.kind in ("integer", "number") else text
