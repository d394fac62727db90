"""The stationary policy: stay where you are. Spread well, it is the paper's yardstick for mobile robots (§6)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from teamsight.core.kernel import inlined
from teamsight.policies.compiled import CompiledPolicy


@inlined
def _stay(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    action.heading[:] = 0.0
    action.distance[:] = 0.0


@dataclass(frozen=True)
class Stationary(CompiledPolicy):
    """Stay where you are.

    Notes
    -----
    *Source:* §6, "stationary ones (even well placed)". A model that is given this policy spreads its robots instead of
    placing them at random.
    """

    kernel = _stay

    @property
    def is_sound(self) -> bool:
        return type(self).kernel is _stay

    @property
    def parameters(self) -> tuple[float, ...]:
        return ()
