"""What a state holds of the policies of single robots: the policies themselves, where they can be pickled."""

from __future__ import annotations

import pickle
import weakref
from typing import Any

from teamsight.agents.decisions.other_policies import OtherPolicy
from teamsight.agents.group import Group


class SavedPolicy:
    """A policy of single robots of a group, in a state. Copies of the state share it.

    Attributes
    ----------
    description : str
        See `described`.
    """

    def __init__(self, policy: Any, group: Group) -> None:
        self.description = described(policy)
        self._policy, self._bytes = policy, b""
        self._group: Any = weakref.ref(group)

    def is_of(self, group: Group, policy: Any) -> bool:
        """Whether a policy of a group is this one, or like it."""
        return policy is self._policy if self._is_of(group) else described(policy) == self.description

    def made_for(self, group: Group) -> Any:
        """Return the policy for a group that has none like it; None if it cannot be pickled."""
        # A copy for another group: a policy in Python may hold data, or be a method, of the world that it comes from.
        return self._policy if self._is_of(group) else _unpickled(self._bytes or _pickled(self._policy))

    def _is_of(self, group: Group) -> bool:
        return self._group is not None and self._group() is group

    def __deepcopy__(self, memo: Any) -> SavedPolicy:
        return self

    def __getstate__(self) -> dict[str, Any]:
        # As bytes: a state can be loaded where the policy's class is not known.
        policy = self._bytes or _pickled(self._policy)
        return {"description": self.description, "_policy": None, "_group": None, "_bytes": policy}


def _pickled(policy: Any) -> bytes:
    """Return a pickled policy; nothing if that is not possible."""
    try:
        return b"" if policy is None else pickle.dumps(policy)
    except Exception:  # Whatever the user's class raises.
        return b""


def _unpickled(policy: bytes) -> Any:
    try:
        return pickle.loads(policy) if policy else None
    except Exception:  # A class that is not known here, or whatever it raises.
        return None


def described(policy: Any) -> str:
    """Return a text that is equal for equal policies, also in other processes."""
    text = repr(policy)
    # A repr that contains a memory address differs between processes.
    return getattr(policy, "__qualname__", type(policy).__name__) if " at 0x" in text else text


def others_of(group: Group, saved: tuple[tuple[SavedPolicy, Any], ...]) -> list[OtherPolicy]:
    """Return the policies of single robots with their saved states: its own, those like them that it has, or copies.

    Raises
    ------
    ValueError
        If the group does not have a policy, and it cannot be pickled.
    """
    known, found = [other.policy for other in group.others], []
    for one, state in saved:
        alike = [policy for policy in known if one.is_of(group, policy)]
        policy = alike[0] if alike else one.made_for(group)
        if policy is None:
            raise ValueError(
                f"restore(…): the state is of a world in which single {group.name} have the policy {one.description}, "
                f"which could not be pickled and which {group.name} do not have here; give it to one of them first, "
                f"as in {group.name}[0].policy = …"
            )
        known = [other for other in known if other is not policy]
        found.append(OtherPolicy(policy, state))
    return found
