"""The policy and the degree of awareness that a user names or gives, whether they fit, and the state of a policy."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.interface import OWN_SECTORS, Awareness, check_width
from teamsight.agents.awareness.registry import AWARENESS, awareness_named
from teamsight.core import checks
from teamsight.policies.compiled import check_declarations, check_state, decides_in_kernel
from teamsight.policies.interface import IDENTITIES, Policy, PolicyState
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
    rays = group.lidar.rays if group.lidar else 0
    if policy.rays not in (0, rays):
        have = f"a lidar with {rays}" if rays else "no lidar"
        raise ValueError(
            f"policy={name}: reads {policy.rays} rays, and its robots have {have}; give them one, as in world.add(…, "
            f"lidar=Lidar(rays={policy.rays}))"
        )
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


class IN_TABLE:  # noqa: N801 (a mark, which pickles as itself)
    """In place of the state of a policy that is in the table of its group: one that is a `PolicyState`."""


@cache
def columns_of_state(index: int) -> tuple[str, str]:
    """Return the columns that hold the floats and the ints of the state of a policy, by its index in its group."""
    return f"floats of policy {index}", f"ints of policy {index}"


def has_rows(state: Any, size: int) -> bool:
    """Whether a state is two arrays with a row for each of `size` robots, which a table can hold."""
    return isinstance(state, PolicyState) and all(
        isinstance(array, np.ndarray) and array.ndim == 3 and len(array) == size and array.dtype == dtype
        for array, dtype in zip(state, (np.float64, np.int64), strict=True)
    )


def _walked(state: Any, act: Callable[..., Any], *others: Any) -> Any:
    """Return a state with the result of ``act(part, *parts of the others)`` for each part that is no container.

    Where another is arranged in another way, what is acted on is the container.
    """
    alike = [one for one in others if type(one) is type(state)]
    if isinstance(state, dict) and all(one.keys() == state.keys() for one in alike) and len(alike) == len(others):
        return {name: _walked(part, act, *(one[name] for one in others)) for name, part in state.items()}
    if isinstance(state, (tuple, list)) and all(len(one) == len(state) for one in alike) and len(alike) == len(others):
        parts = [_walked(one, act, *more) for one, *more in zip(state, *others, strict=True)]
        return type(state)(*parts) if hasattr(state, "_fields") else type(state)(parts)
    return act(state, *others)


def take_rows(state: Any, rows: npt.NDArray[Any], size: int) -> Any:
    """Return the state of some of the `size` robots; what is not an array with a row for each is returned unchanged."""

    def taken(part: Any) -> Any:
        has_each = isinstance(part, np.ndarray) and part.shape[:1] == (size,)
        return np.ascontiguousarray(part[rows]) if has_each else part

    return _walked(state, taken)


def put_rows(state: Any, rows: npt.NDArray[Any], part: Any, size: int) -> Any:
    """Return a copy of the state with the rows of some robots replaced by `part`, which is as from `take_rows`.

    Values without rows are replaced for all robots.
    """

    def put_in(before: Any, after: Any) -> Any:
        if not (isinstance(before, np.ndarray) and before.shape[:1] == (size,)):
            return after
        changed = before.copy()
        changed[rows] = after
        return changed

    return _walked(state, put_in, part)


def with_more_rows(state: Any, fresh: Any, size: int, total: int, name: str) -> Any:
    """Return the state of `size` robots with the rows of more, from the `fresh` state of `total` robots.

    Values without rows stay. `name` says in errors where the fresh state comes from.

    Raises
    ------
    TypeError
        If the fresh state is arranged in another way.
    """

    def with_more(before: Any, new: Any) -> Any:
        if isinstance(before, np.ndarray) and isinstance(new, np.ndarray) and before.shape[1:] == new.shape[1:]:
            if before.shape[:1] == (size,) and new.shape[:1] == (total,):
                return np.concatenate([before, new[size:].astype(before.dtype)])
            if before.shape == new.shape:
                return before
        elif not isinstance(before, (np.ndarray, dict, tuple, list)):
            return before
        raise TypeError(
            f"{name} returns {layout(new)}, and the state of {size} is {layout(before)}; return arrays with a row for "
            "each robot from start, so that robots can join"
        )

    return _walked(state, with_more, fresh)


def layout(state: Any) -> str:
    """Return a description of the types and shapes in a state; a policy can continue only from a state with its own."""
    if isinstance(state, np.ndarray):
        return f"{state.dtype}{list(state.shape)}"
    if isinstance(state, dict):
        return "{" + ", ".join(f"{name}: {layout(part)}" for name, part in state.items()) + "}"
    if isinstance(state, (tuple, list)) and any(isinstance(part, (np.ndarray, dict, tuple, list)) for part in state):
        return f"{type(state).__name__}({', '.join(layout(part) for part in state)})"
    return type(state).__name__


Integers = npt.NDArray[np.int64]


def first_state(policy: Any, size: int) -> Any:
    """Return the state of a policy for `size` agents before their first decision.

    Raises
    ------
    TypeError, ValueError
        If the policy has a kernel that cannot read the state.
    """
    state = policy.start(size) if isinstance(policy, Policy) else None
    if decides_in_kernel(policy):
        check_state(policy, state, size)
    return state


def first_state_of_members(policy: Any, members: Integers, members_so_far: int) -> Any:
    """Return the state before their first decision of those that are in a group, of all that have been.

    A policy may have a state for each: with tables per robot, those that stay keep their own.

    Raises
    ------
    TypeError, ValueError
        As `first_state`.
    """
    if len(members) == members_so_far:
        return first_state(policy, members_so_far)
    state = take_rows(first_state(policy, members_so_far), members, members_so_far)
    if decides_in_kernel(policy):
        check_state(policy, state, len(members))
    return state


def state_of_more(policy: Any, state: Any, present: Integers, new: Integers, *, is_in_table: bool) -> Any:
    """Return the state of the robots that are `present` with first states for `new` ones, all given by member.

    Of a state that a table holds, only that of the new ones.

    Raises
    ------
    TypeError, ValueError
        If the policy's ``start`` returns none that fit.
    """
    so_far, size = int(new[-1]) + 1, len(present)
    total = size + len(new)
    if is_in_table or has_rows(state, size):
        fresh = first_state(policy, so_far)
        if has_rows(fresh, so_far) and all(a.shape[1:] == b.shape[1:] for a, b in zip(fresh, state, strict=True)):
            return PolicyState(*(array[so_far - len(new) :] for array in fresh))
    else:
        fresh = first_state_of_members(policy, np.append(present, new), so_far)
    return with_more_rows(state, fresh, size, total, f"policy={label(policy)}: start({so_far})")
