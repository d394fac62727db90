"""The degree of awareness of the robots of `CMOMMT`, and the policy of its targets, from its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from teamsight.agents.awareness import Awareness, RingAwareness
from teamsight.agents.awareness.registry import awareness_named
from teamsight.agents.resolve import awareness_of, policy_of

# Options of policies by name whose defaults are for robots.
_TARGET_OPTIONS = {"random-walk": {"turn_probability": 0.05}}


def target_policy_of(value: Any, options: Mapping[str, Any]) -> Any:
    """Return the policy of the targets: a name with its options, or an object."""
    defaults = _TARGET_OPTIONS.get(value, {}) if isinstance(value, str) else {}
    return policy_of(value, {**defaults, **options}, "target_policy")


def degree_of(plan: Mapping[str, Any]) -> Awareness:
    """Return the degree of awareness of the robots; `delta` is that of a degree given by name."""
    # Checked for every degree, so that a wrong one is never ignored.
    delta = RingAwareness(plan["delta"]).delta
    degree = plan["awareness"]
    return awareness_named(degree, {"delta": delta}) if isinstance(degree, str) else awareness_of(degree)
