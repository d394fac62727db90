"""Resolve the policy and the degree of awareness that a user names or gives, and check that they fit."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from teamsight.agents.awareness.interface import OWN_SECTORS, Awareness, check_width
from teamsight.agents.awareness.registry import AWARENESS, awareness_named
from teamsight.core import checks
from teamsight.policies.compiled import check_declarations
from teamsight.policies.interface import IDENTITIES, Policy
from teamsight.policies.percept_of_one import PerceptOfOne
from teamsight.policies.registry import POLICIES, label, options_of, policy_named

if TYPE_CHECKING:
    from teamsight.agents.group import Group


class NoPolicy:
    """Stands for the policy of a group that was added without one, because its agents override `decide`."""

    def __init__(self, class_name: str) -> None:
        self._class_name = class_name

    def __repr__(self) -> str:
        return f"NoPolicy({self._class_name!r})"

    def __call__(self, percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]:
        name = self._class_name
        raise RuntimeError(
            f"super().decide(…): {name} was added without a policy; give one, as in world.add({name}, …, "
            "policy='random-walk'), or decide without super()"
        )


def policy_or_none(value: Any, options: Mapping[str, Any] | None, class_name: str, decides_alone: bool) -> Any:
    """Return the policy that a user gives; it may be left out if the agents decide themselves.

    Raises
    ------
    TypeError, ValueError
        As for `policy_of`, and if it is missing.
    """
    if value is not None:
        return policy_of(value, options)
    if options:
        raise ValueError(f"policy_options={checks.shown(options)}: applies to a policy given by name; give policy too")
    if not decides_alone:
        raise TypeError(
            f"policy: is missing, and {class_name} does not override decide; give a Policy, a callable f(percept, rng) "
            f"-> (turn, distance), or a name: {', '.join(POLICIES)}"
        )
    return NoPolicy(class_name)


def policy_of(value: Any, options: Mapping[str, Any] | None = None, name: str = "policy") -> Any:
    """Return the policy that a user gives, as an object or by name.

    Parameters
    ----------
    value : str, Policy or callable
        A policy, or the name of one.
    options : mapping of str to object, optional
        Options of a policy given by name.
    name : str
        The parameter, for error messages.

    Raises
    ------
    TypeError, ValueError
        If `value` is not a policy, its name is unknown, it does not have one of the options, or an option has a wrong
        value.
    """
    given = checked_options(options, name)
    if isinstance(value, str):
        made = policy_named(value, given, name)
        # The policy of a plug-in is checked like an object of the user.
        return made if POLICIES.is_built_in(value) else policy_of(made, None, f"{name}={value!r}: its policy")
    if given:
        raise ValueError(
            f"{name}_options={checks.shown(given)}: applies to a policy given by name, and "
            f"{name}={checks.shown(value)} is an object; set its options where it is made"
        )
    if isinstance(value, Policy):
        check_declarations(f"{name}={type(value).__name__}", value)
        return value
    if isinstance(value, type):
        raise TypeError(f"{name}={value.__name__}: is a class; give an object, {value.__name__}()")
    if hasattr(value, "decide"):
        kind = type(value).__name__
        raise TypeError(f"{name}={kind}: has decide but is not a Policy; derive {kind} from teamsight.policies.Policy")
    if not callable(value):
        raise TypeError(
            f"{name}={checks.shown(value)}: must be a name, a Policy, or a callable f(percept, rng) -> (turn, distance)"
        )
    try:
        inspect.signature(value).bind(None, None)
    except TypeError:
        raise TypeError(
            f"{name}={getattr(value, '__name__', value)}: a rule for one robot takes two arguments (percept, rng) "
            "and returns (turn, distance)"
        ) from None
    except ValueError:
        # Some callables written in C have no signature.
        pass
    return value


def checked_options(options: Mapping[str, Any] | None, name: str = "policy") -> dict[str, Any]:
    """Return the options given for the policy parameter `name`; empty for None.

    Raises
    ------
    TypeError
        If they are not a mapping.
    """
    if options is None:
        return {}
    if not isinstance(options, Mapping):
        raise TypeError(f"{name}_options={checks.shown(options)}: must be a mapping, such as {{'weights': 'shared'}}")
    return dict(options)


def shared_options(policy: Any, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options that the policy of this name has; none for an object.

    Options that name an idle behaviour are for policies that have one: the turn probability of an idle robot is not
    that of a random walk.
    """
    if not isinstance(policy, str) or policy not in POLICIES:
        return {}
    known = options_of(policy)
    if "idle" in options and "idle" not in known:
        return {}
    return {name: value for name, value in options.items() if name in known}


def awareness_of(value: Awareness | str) -> Awareness:
    """Return the degree of awareness that a user gives, as an object or by name.

    Raises
    ------
    TypeError, ValueError
        If it is not a degree of awareness, or its name is unknown.
    """
    if isinstance(value, str):
        return awareness_named(value)
    if not isinstance(value, Awareness):
        shown = f"{checks.shown(value)}: is not a degree of awareness; give one"
        if isinstance(value, type):
            shown = f"{value.__name__}: is a class; give an object"
        raise TypeError(f"awareness={shown}, such as PairwiseAwareness(), or one of {', '.join(AWARENESS)}")
    check_width(value, 1)
    return value


def check_fit(group: Group, team: list[Group]) -> None:
    """Refuse a policy that needs what the degree of awareness does not deliver.

    Raises
    ------
    ValueError
        Naming a degree that fits.
    """
    check_needs(group)
    policy, awareness = group.policy, group.awareness
    if not isinstance(policy, Policy):
        return
    name, inputs, degree = label(policy), policy.inputs, policy.degree
    size = max(sum(map(len, team)), 1)
    width = sum(awareness.width(size))
    if degree is not None and degree != awareness.name:
        raise ValueError(
            f"policy={name}: learned from situations of awareness {degree!r}, but these robots have "
            f"{awareness.name!r}{_fitting(awareness, inputs, size, degree)}{policy.remedy(awareness.name, width)}"
        )
    if inputs and inputs != width:
        raise ValueError(
            f"policy={name}: reads {inputs} inputs, but awareness {awareness.name!r} gives {width} in a team of {size}"
            f"{_fitting(awareness, inputs, size, degree)}"
        )


def check_needs(group: Group) -> None:
    """Refuse a policy that needs a field of the percept which the degree of awareness does not deliver."""
    policy, awareness = group.policy, group.awareness
    if not isinstance(policy, Policy):
        return
    name = label(policy)
    for need in policy.needs:
        checks.choice(f"{name}.needs", need, ("targets", "teammates", "relayed", IDENTITIES))
        if not _delivers(awareness, need):
            fit = [degree.name for degree in AWARENESS.values() if _delivers(degree, need)]
            cure = _use(fit[0]) if fit else ""
            raise ValueError(
                f"policy={name}: needs {need!r}, which awareness {awareness.name!r} does not deliver{cure}"
            )


def _delivers(awareness: Awareness | type[Awareness], need: str) -> bool:
    if need == IDENTITIES and awareness.shows_teammates:
        return True
    return need in awareness.delivers


def check_channels(group: Group, policy: Any) -> None:
    """Refuse a policy that reads a channel in which its group senses nothing.

    Raises
    ------
    ValueError
        Naming the declaration that is missing.
    """
    for name in policy.channels if isinstance(policy, Policy) else ():
        if name not in group.channels:
            raise ValueError(
                f"policy={label(policy)}: reads the channel {name!r}, in which {group.name!r} senses nothing; "
                f"declare it first: world.senses({group.name}, others, as_={name!r})"
            )


def _fitting(awareness: Awareness, inputs: int, size: int, name: str | None = None) -> str:
    """Return the cure: a degree, of this name if given, with this number of inputs."""
    for degree in AWARENESS.values():
        if name in (None, degree.name) and degree.name != awareness.name and sum(degree().width(size)) == inputs:
            return _use(degree.name)
    for degree in AWARENESS.values():
        if name in (None, degree.name) and degree.options() and inputs > OWN_SECTORS:
            fitting = degree.adding(inputs - OWN_SECTORS)
            if sum(fitting.width(size)) != inputs:
                continue
            options = {option: getattr(fitting, option) for option in degree.options()}
            values = ", ".join(f"{option}={value}" for option, value in options.items())
            flags = " ".join(f"--{option} {value}" for option, value in options.items())
            return f"; use {degree.__name__}({values}) (--awareness {degree.name} {flags})"
    return "; explore with this degree and this team" if name else "; train it for this width"


def _use(name: str) -> str:
    return f"; use awareness={name!r} (--awareness {name})"
