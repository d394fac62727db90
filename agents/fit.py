"""Fit: reading the policy and the degree of awareness that a user names or gives, and whether they go together."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any

from teamsight import checks
from teamsight.agents.awareness import AWARENESS, Awareness, RingAwareness
from teamsight.agents.ring import OWN_SECTORS
from teamsight.policies import POLICIES

if TYPE_CHECKING:
    from teamsight.agents.group import Group


def policy_of(value: Any, name: str = "policy") -> Any:
    """Return the policy that a user names or gives for the parameter `name`.

    Raises
    ------
    TypeError, ValueError
        If it is no policy, or its name is unknown.
    """
    if isinstance(value, str):
        return POLICIES[checks.choice(name, value, POLICIES)]()
    if isinstance(value, type):
        raise TypeError(f"{name}={value.__name__}: is a class; give an object, {value.__name__}()")
    if not hasattr(value, "decide") and not callable(value):
        raise TypeError(
            f"{name}={value!r}: must be a name, an object with draws, start(size) and decide(percept, memory, noise), "
            "or a callable f(percept, rng) -> (turn, distance)"
        )
    if not hasattr(value, "decide"):
        try:
            inspect.signature(value).bind(None, None)
        except TypeError:
            raise TypeError(
                f"{name}={getattr(value, '__name__', value)}: a rule for one robot takes two arguments (percept, rng) "
                "and returns (turn, distance)"
            ) from None
        except ValueError:
            # Some callables written in C do not tell what they take.
            pass
    if hasattr(value, "decide"):
        missing = [member for member in ("draws", "start") if not hasattr(value, member)]
        if missing:
            raise TypeError(f"{name}={value!r}: has decide but no {' and no '.join(missing)}; see check_policy()")
        checks.count(f"{name}={type(value).__name__}: draws", value.draws, least=0)
    return value


def awareness_of(value: Awareness | str) -> Awareness:
    """Return the degree of awareness that a user names or gives.

    Raises
    ------
    TypeError, ValueError
        If it is none, or its name is unknown.
    """
    if isinstance(value, str):
        return AWARENESS[checks.choice("awareness", value, AWARENESS)]()
    if not isinstance(value, Awareness):
        shown = f"{value!r}: is no degree of awareness; give one"
        if isinstance(value, type):
            shown = f"{value.__name__}: is a class; give an object"
        raise TypeError(f"awareness={shown}, such as PairwiseAwareness(), or one of {', '.join(AWARENESS)}")
    return value


def check_fit(group: Group, team: list[Group]) -> None:
    """Refuse a policy that asks for what the degree of awareness does not deliver.

    Raises
    ------
    ValueError
        Naming a degree that would do.
    """
    check_needs(group)
    policy, awareness = group.policy, group.awareness
    name = getattr(policy, "__name__", type(policy).__name__)
    inputs = getattr(policy, "inputs", 0) or 0
    degree = getattr(policy, "degree", None)
    size = max(sum(map(len, team)), 1)
    width = sum(awareness.width(size))
    if degree is not None and degree != awareness.name:
        raise ValueError(
            f"policy={name}: learned from situations of awareness {degree!r}, and these robots have "
            f"{awareness.name!r}{_fitting(inputs, size, degree)}"
        )
    if inputs and inputs != width:
        raise ValueError(
            f"policy={name}: reads {inputs} inputs, and awareness {awareness.name!r} gives {width} in a team of {size}"
            f"{_fitting(inputs, size, degree)}"
        )


def check_needs(group: Group) -> None:
    """Refuse a policy that needs a field of the percept which the degree of awareness does not deliver."""
    policy, awareness = group.policy, group.awareness
    name = getattr(policy, "__name__", type(policy).__name__)
    for need in getattr(policy, "needs", ()):
        checks.choice(f"{name}.needs", need, ("targets", "mates", "reports"))
        if need not in awareness.delivers:
            fit = [degree.__name__ for degree in AWARENESS.values() if need in degree.delivers]
            cure = f"; use {fit[0]}()" if fit else ""
            raise ValueError(
                f"policy={name}: needs {need!r}, which awareness {awareness.name!r} does not deliver{cure}"
            )


def _fitting(inputs: int, size: int, name: str | None = None) -> str:
    """Return the cure: a degree of this name, if one is asked for, that gives so many inputs."""
    for degree in AWARENESS.values():
        if name in (None, degree.name) and sum(degree().width(size)) == inputs:
            return f"; use {degree.__name__}()"
    if inputs > OWN_SECTORS and name in (None, RingAwareness.name):
        return f"; use {RingAwareness.__name__}(delta={inputs - OWN_SECTORS})"
    return "; explore with this degree and this team" if name else "; train it for this width"
