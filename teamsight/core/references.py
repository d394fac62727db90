"""Objects by reference: "package.module:Name" names a class, a function or another object of an importable module."""

from __future__ import annotations

import importlib
import importlib.util
import os
import re
import sys
import sysconfig
import traceback
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType
from typing import Any

from teamsight.core import checks

#: Classes of this package that have moved or were renamed: the reference of before, and that of now. Seeds, the ids of
#: settings and study files have the former, which stays for ever.
MOVED: dict[str, str] = {
    "teamsight.agents.robot:Robot": "teamsight.agents.body:Robot",
    "teamsight.agents.target:Target": "teamsight.agents.body:Target",
    "teamsight.agents.components.sensor_dropouts:SensorDropouts":
        "teamsight.agents.components.failures:SensorDropouts",
    "teamsight.agents.components.charging_places:ChargingPlaces":
        "teamsight.agents.components.batteries:ChargingPlaces",
    "teamsight.agents.events.recurring:Recurring": "teamsight.agents.mesa.model:Recurring",
    "teamsight.policies.braitenberg.fixed_priority:FixedPriority":
        "teamsight.policies.braitenberg.vehicle:FixedPriority",
    "teamsight.agents.decisions.cycle:Cycle": "teamsight.agents.decisions:Cycle",
    "teamsight.agents.awareness.pairwise:PairwiseAwareness": "teamsight.agents.awareness.degrees:PairwiseAwareness",
    "teamsight.agents.awareness.nearest:NearestAwareness": "teamsight.agents.awareness.degrees:NearestAwareness",
    "teamsight.agents.awareness.shared:SharedAwareness": "teamsight.agents.awareness.degrees:SharedAwareness",
    "teamsight.agents.awareness.none:NoAwareness": "teamsight.agents.awareness.degrees:NoAwareness",
    "teamsight.agents.awareness.ring:RingAwareness": "teamsight.agents.awareness.degrees:RingAwareness",
    "teamsight.world.contract:Obstructed": "teamsight.world.arena:Obstructed",
    "teamsight.world.polygon:Polygon": "teamsight.world.shapes:Polygon",
    "teamsight.world.circle:Circle": "teamsight.world.shapes:Circle",
    "teamsight.policies.lazy.pessimistic_lazy_q:PessimisticLazyQ": "teamsight.policies.lazy.lazy_q:PessimisticLazyQ",
    "teamsight.tasks.collecting.pucks:Collecting": "teamsight.tasks.collecting:Collecting",
    "teamsight.tasks.collecting.world:PuckCollecting": "teamsight.tasks.collecting:PuckCollecting",
    "teamsight.tasks.foraging.carrying:Carrying": "teamsight.tasks.foraging:Carrying",
    "teamsight.tasks.foraging.consuming:Consuming": "teamsight.tasks.foraging:Consuming",
    "teamsight.tasks.foraging.grazing:Grazing": "teamsight.tasks.foraging:Grazing",
    "teamsight.tasks.foraging.worlds:Consume": "teamsight.tasks.foraging:Consume",
    "teamsight.tasks.foraging.worlds:Forage": "teamsight.tasks.foraging:Forage",
    "teamsight.tasks.foraging.worlds:Graze": "teamsight.tasks.foraging:Graze",
    "teamsight.tasks.pursuit.capture:Capture": "teamsight.tasks.pursuit:Capture",
    "teamsight.tasks.pursuit.surround:Surround": "teamsight.tasks.pursuit:Surround",
    "teamsight.tasks.pursuit.world:Pursuit": "teamsight.tasks.pursuit:Pursuit",
    "teamsight.tasks.pushing.box_law:Pushing": "teamsight.tasks.pushing:Pushing",
    "teamsight.tasks.pushing.world:BoxPushing": "teamsight.tasks.pushing:BoxPushing",
    "teamsight.policies.basis.basis_behaviours:BasisBehaviours": "teamsight.policies.basis:BasisBehaviours",
    "teamsight.policies.eager.linear:LinearQ": "teamsight.policies.eager:LinearQ",
    "teamsight.policies.eager.tabular:TabularQ": "teamsight.policies.eager:TabularQ",
    "teamsight.policies.evolved.policy:Evolved": "teamsight.policies.evolved:Evolved",
    "teamsight.policies.schemas.forage:ForageSchemas": "teamsight.policies.schemas:ForageSchemas",
    "teamsight.policies.schemas.graze:GrazeSchemas": "teamsight.policies.schemas:GrazeSchemas",
}
_FORM = re.compile(r"[^\W\d]\w*(\.[^\W\d]\w*)*:[^\W\d]\w*(\.[^\W\d]\w*)*")
# The same object in a file, after the name of an option or alone: "--policy=folder/file.py:Name".
_IN_FILE = re.compile(r"(?P<option>--[\w.-]+=)?(?P<file>[^=]*[^=./\\])\.py:(?P<name>[^\W\d][\w.]*)")
_LONGEST = 500
_PACKAGE = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "")
# Folders that `search_in` has added to the path, and those that it was given last.
_added: list[str] = []
_latest: list[str] = []


def is_reference(text: object) -> bool:
    """Return whether a text has the form of a reference: "package.module:Name"."""
    return isinstance(text, str) and len(text) <= _LONGEST and _FORM.fullmatch(text) is not None


def from_file(text: str) -> str:
    """Return an argument of a command line with a reference in place of "folder/file.py:Name"; any other as it is.

    The folder is searched for modules from then on.

    Raises
    ------
    ValueError
        If there is no such file, or its name is none of a module.
    """
    found = _IN_FILE.fullmatch(text) if len(text) <= _LONGEST else None
    if found is None:
        return text
    folder, file = os.path.split(os.path.expanduser(found["file"]))
    path = os.path.join(folder, f"{file}.py")
    if not os.path.isfile(path):
        # A module of that name may be elsewhere, but is not what was named.
        raise ValueError(f"{text}: there is no file {path}; give its path from here, {os.getcwd()}")
    if not file.isidentifier():
        better = re.sub(r"\W|^(?=\d)", "_", file)
        raise ValueError(
            f"{text}: Python cannot import {file}.py, since {file!r} is no module name; rename it, for example to "
            f"{better}.py"
        )
    search_in([folder or os.curdir, os.curdir])
    return f"{found['option'] or ''}{file}:{found['name']}"


def load(reference: str, what: str = "policy", *, place: str = "put its file beside the study file") -> object:
    """Return the object that a reference names; its module is imported.

    Parameters
    ----------
    reference : str
        The module, and the object in it: "package.module:Name", or "package.module:Class.attribute".
    what : str
        The parameter that holds the reference, for error messages.
    place : str
        What makes a module found that is not installed, for error messages: where `search_in` lets modules be found.

    Raises
    ------
    TypeError
        If `reference` is not a text.
    ValueError
        If it does not have that form, the module is not found or fails to import, or it has no such object.
    """
    given = f"{what}={checks.shown(reference)}"
    if not isinstance(reference, str):
        raise TypeError(f"{given}: must be a text such as 'package.module:Name'")
    if not is_reference(reference):
        raise ValueError(f"{given}: is no reference; write the module and the name in it, as in 'package.module:Name'")
    home, _, names = MOVED.get(reference, reference).partition(":")
    found: Any = _module(home, given, place)
    owner = f"module {home!r}"
    for name in names.split("."):
        found = _attribute(found, name, owner, given)
        owner = repr(name)
    loaded: object = found
    return loaded


def _module(name: str, given: str, place: str) -> ModuleType:
    """Import a module; `given` begins the message of errors, and `place` is in their cure."""
    if two := hidden(name):
        raise ValueError(f"{given}: {mixed_up(name, *two)}")
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name is not None and (name == error.name or name.startswith(f"{error.name}.")):
            raise ValueError(
                f"{given}: there is no module {error.name!r}; install it, {place}, or add its folder to PYTHONPATH"
            ) from error
        why, cure = failure(error), "install what it needs"
        raise ValueError(f"{given}: module {name!r} fails to import: {why}; {cure}") from error
    except (Exception, SystemExit) as error:  # whatever the module of a user raises
        why, cure = failure(error), "correct the module"
        raise ValueError(f"{given}: module {name!r} fails to import: {why}; {cure}") from error


def added() -> tuple[str, ...]:
    """Return the folders that `search_in` has added, for this study and for others."""
    return tuple(_added)


def mixed_up(name: str, found: str, own: str) -> str:
    """Return the message for a module that is not that of the study; see `hidden`."""
    return (
        f"module {name.partition('.')[0]!r} is {found} in this process, not {own}; give that file another name, or "
        "start a new Python if it is that of another study"
    )


def _attribute(owner: Any, name: str, called: str, given: str) -> Any:
    try:
        return getattr(owner, name)
    except AttributeError as error:
        known = [other for other in dir(owner) if not other.startswith("_")]
        hint = checks.suggestion(name, known) or (f"it has {', '.join(known[:8])}" if known else "it is empty")
        raise ValueError(f"{given}: {called} has no {name!r}; {hint.strip()}") from error


def said(error: BaseException) -> str:
    """Return what an error says: of wrong input its own words, of any other what `failure` returns."""
    return str(error) if isinstance(error, (TypeError, ValueError)) else failure(error)


def failure(error: BaseException) -> str:
    """Return an error of a user's code on one line: its kind, its message, and the file and line where it arose."""
    try:
        text = " ".join(str(error).split())
    except Exception:
        text = "(its message cannot be shown)"
    if isinstance(error, SyntaxError):  # names file and line itself
        return f"{type(error).__name__}: {text}"
    found = place_of((frame.f_code.co_filename, line) for frame, line in traceback.walk_tb(error.__traceback__))
    place = f" ({os.path.basename(found[0])}, line {found[1]})" if found else ""
    return f"{type(error).__name__}{': ' if text else ''}{text}{place}"


def place_of(frames: Iterable[tuple[str, int]]) -> tuple[str, int] | None:
    """Return the file and line in the code of a user at which an error arose, or None if teamsight raised it.

    Parameters
    ----------
    frames : iterable of (str, int)
        File and line of each call, the outermost first. What a library raises counts for the code that calls it.
    """
    libraries = "<", *{sysconfig.get_paths()[name] for name in ("stdlib", "purelib", "platlib")}
    for file, line in reversed([*frames]):
        if file.startswith(_PACKAGE):
            return None
        if not file.startswith(libraries):
            return file, line
    return None


def reference_to(obj: object, what: str = "policy") -> str:
    """Return the reference of a class or a function; `load` gives the same object again, in any process.

    Parameters
    ----------
    obj : object
        A class or a function of an importable module.
    what : str
        The parameter that holds it, for error messages.

    Raises
    ------
    TypeError
        If `obj` is neither a class nor a function.
    ValueError
        If another process could not import it: it is a lambda, local to a function, part of the script that runs, or
        its module has another object of its name.
    """
    given = f"{what}={checks.shown(obj)}"
    home, name = getattr(obj, "__module__", None), getattr(obj, "__qualname__", None)
    if not isinstance(home, str) or not isinstance(name, str) or not callable(obj):
        raise TypeError(f"{given}: is neither a class nor a function; write it as 'package.module:Name'")
    cure = "define it at the top level of a module of its own, which worker processes can import"
    if "<lambda>" in name:
        raise ValueError(f"{given}: is a lambda; {cure}")
    if "<locals>" in name:
        raise ValueError(f"{given}: is defined within a function; {cure}")
    if home == "__main__":
        raise ValueError(f"{given}: is defined in the script that runs; {cure}")
    reference = _stable(f"{home}:{name}")
    if load(reference, what) is not obj:
        raise ValueError(f"{given}: {reference!r} is another object of the same name; {cure}")
    return reference


def _stable(reference: str) -> str:
    return next((before for before, now in MOVED.items() if now == reference), reference)


def stable_name(kind: type) -> str:
    """Return the name of a class of which noise is made: the one that it had before it was renamed."""
    now = f"{kind.__module__}:{kind.__qualname__}"
    before = _stable(now)
    return kind.__name__ if before == now else before.rpartition(":")[2]


def search_in(folders: Iterable[str | Path]) -> None:
    """Let `load` find the modules in these folders, which come last on ``sys.path``, the latest first.

    Sweeps and their worker processes call it with the folder of the study file. Folders that are already on the path
    stay where they are. From now on `load` refuses a module that these folders have, and that is found elsewhere.
    """
    given = list(dict.fromkeys(map(os.path.abspath, folders)))
    earlier = [text for text in _added if text in sys.path]
    rest = [text for text in sys.path if text not in earlier]
    _added[:] = [*(text for text in given if text not in rest), *(text for text in earlier if text not in given)]
    # Not first: a file named like a module of Python would hide it from everything.
    sys.path[:] = [*rest, *_added]
    _latest[:] = given
    # A module may have been written after Python listed its folder.
    importlib.invalidate_caches()


def hidden(name: str) -> tuple[str, str] | None:
    """Return the file of a module, and that of the same name in the folders of `search_in`, if these are two.

    Parameters
    ----------
    name : str
        Name of a module, which need not be imported.
    """
    top = name.partition(".")[0]
    if top == "teamsight":
        return None
    try:
        found = sys.modules[top].__spec__ if top in sys.modules else importlib.util.find_spec(top)
    except (ImportError, ValueError):
        return None
    for folder in _latest:
        for own in (os.path.join(folder, top, "__init__.py"), os.path.join(folder, f"{top}.py")):
            if found is not None and os.path.isfile(own):
                is_file = found.origin is not None and os.path.isfile(found.origin)
                if not (is_file and os.path.samefile(own, str(found.origin))):
                    return found.origin or "a folder", own
                return None
    return None
