"""The stationary policy; with robots spread over the arena it is the paper's reference (§6)."""

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
    """Do not move.

    Notes
    -----
    *Source:* §6, "stationary ones (even well placed)". `CMOMMT` spreads robots with this policy over the arena.
    """

    kernel = _stay

    @property
    def is_sound(self) -> bool:
        return type(self).kernel is _stay

    @property
    def parameters(self) -> tuple[float, ...]:
        return ()
