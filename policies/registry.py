"""The policies by name; each is imported when it is first used."""

from __future__ import annotations

import contextlib
import inspect
from collections.abc import Callable, Mapping
from dataclasses import MISSING
from typing import TYPE_CHECKING, Any, cast

from teamsight.core import checks
from teamsight.core.component import declared
from teamsight.core.references import is_reference
from teamsight.core.registry import Registry

if TYPE_CHECKING:
    from teamsight.policies.interface import Policy

#: Classes, or functions that make a policy, by name. Their parameters are the policy's options.
POLICIES: Registry[Callable[..., Policy]] = Registry(
    {
        "a-cmommt": "teamsight.policies.handmade.a_cmommt:ACmommt",
        "adaptive-forces": "teamsight.policies.adaptive_forces:AdaptiveForces",
        "b-cmommt": "teamsight.policies.handmade.b_cmommt:BCmommt",
        "centroid": "teamsight.policies.handmade.centroid:Centroid",
        "evasive": "teamsight.policies.handmade.evasive:Evasive",
        "evolved": "teamsight.policies.evolved:Evolved",
        "group-forces": "teamsight.policies.group_forces:GroupForces",
        "lattice-walk": "teamsight.policies.online.lattice_walk:LatticeWalk",
        "lazy-collective": "teamsight.policies.lazy.lazy_q:lazy_collective",
        "lazy-cooperative": "teamsight.policies.lazy.lazy_q:lazy_cooperative",
        "p-cmommt": "teamsight.policies.handmade.p_cmommt:PCmommt",
        "ppo": "teamsight.policies.trained:Trained",
        "random-walk": "teamsight.policies.handmade.random_walk:RandomWalk",
        "stationary": "teamsight.policies.handmade.stationary:Stationary",
    },
    group="teamsight.policies",
    by_reference="policy",
)

# Policies are immutable, so all worlds share those without options.
_MADE: dict[str, Policy] = {}


def policy_named(name: str, options: Mapping[str, Any] | None = None, parameter: str = "policy") -> Policy:
    """Return the policy of a name.

    Parameters
    ----------
    name : str
        A key of `POLICIES`, or the name of a plug-in.
    options : mapping of str to object, optional
        Values for the parameters of its class.
    parameter : str
        The parameter that holds the name, for error messages.

    Raises
    ------
    TypeError, ValueError
        If the name is unknown, the policy has no such option, or an option has a wrong value.
    """
    if isinstance(name, str) and name.rstrip(":").endswith(".py"):
        file = name.rstrip(":")
        raise ValueError(f"{parameter}={name!r}: is a file; add the name in it, on a command line {file}:Name")
    checks.choice(parameter, name, POLICIES)
    if not options:
        if is_reference(name):
            # The file of a user may have changed, as in a notebook.
            return _made(name, parameter)
        if name not in _MADE:
            _MADE[name] = _made(name, parameter)
        return _MADE[name]
    known = options_of(name)
    for option in options:
        if option not in known:
            known_are = f"its options are {', '.join(known)}" if known else "it has no options"
            shown, hint = checks.shown(option), checks.suggestion(option, known)
            raise ValueError(f"{parameter}_options: {name!r} has no option {shown}; {hint}{known_are}")
    return POLICIES[name](**options)


def _made(name: str, parameter: str) -> Policy:
    """Return the policy of a name with its defaults; a plug-in may be a policy that is made already."""
    found = POLICIES[name]
    if POLICIES.is_built_in(name):
        return found()
    if not _makes(found):
        return cast("Policy", found)
    if inspect.isclass(found) and not _is_policy(found):
        raise TypeError(
            f"{parameter}={name!r}: is a class, but neither a Policy nor callable; derive it from "
            "teamsight.policies.Policy, or name a function f(percept, rng) -> (turn, distance)"
        )
    try:
        return found()
    except Exception as error:  # whatever the code of a user raises
        needed: list[str] = []
        with contextlib.suppress(TypeError, ValueError):  # it has no signature
            needed = [option for option, one in declared(found).items() if one.default is MISSING]
        if needed:
            first = f"{parameter}.{needed[0]}".replace("_", "-")
            raise ValueError(
                f"{parameter}={name!r}: needs {', '.join(needed)}; give {parameter}_options={{{needed[0]!r}: …}}, on a "
                f"command line --{first}"
            ) from error
        why = " ".join(f"{type(error).__name__}: {error}".split())
        raise ValueError(f"{parameter}={name!r}: cannot be made without options: {why}") from error


def _is_policy(kind: type) -> bool:
    from teamsight.policies.interface import Policy

    return issubclass(kind, Policy) or any("__call__" in vars(base) for base in kind.__mro__)


def _makes(found: Any) -> bool:
    """Return whether an entry of the registry makes a policy, rather than being one, as a rule for one robot is."""
    if not inspect.isfunction(found):
        return inspect.isclass(found)
    try:
        inspect.signature(found).bind()
    except TypeError:
        return False
    return True


def options_of(name: str) -> tuple[str, ...]:
    """Return the options of a policy: the parameters of its class."""
    found = POLICIES[name]
    return tuple(declared(found)) if _makes(found) else ()


def label(policy: Any) -> str:
    """Return the name of a policy in messages: its name in quotes, its class, or its function."""
    for name, made in _MADE.items():
        if made is policy:
            return repr(name)
    return str(getattr(policy, "__name__", type(policy).__name__))
