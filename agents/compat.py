"""mesa, as far as its versions differ: counting steps, keeping time, and letting go of a model."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import mesa

if TYPE_CHECKING:
    from teamsight.agents.model import World


def take_over_step(model: World) -> None:
    """Put our own wrapper around the user's ``step``.

    mesa 3.5 steps through an event list which, once a step has raised, silently does nothing for ever; and it cannot be
    told that many steps were made at once. The user's own mesa events still happen at their times.
    """
    schedule = getattr(model, "_default_schedule", None)
    if schedule is not None:
        schedule.stop()
    model.step = partial(_counted_step, model)  # type: ignore[method-assign]


def _counted_step(model: World, *arguments: Any, **named: Any) -> None:
    count_steps(model, 1)
    try:
        model._user_step(*arguments, **named)
    except BaseException:
        model.running = False
        raise


def count_steps(model: World, steps: int) -> None:
    """Advance mesa's own counters by this many steps."""
    if steps == 0:
        return
    model.steps += steps
    if hasattr(model, "_advance_time"):
        model._advance_time(model.time + steps)


def set_counters(model: World, tick: int) -> None:
    """Set mesa's own counters."""
    model.steps = tick
    if hasattr(model, "_advance_time"):
        model.time = float(tick)


def has_events(model: World) -> bool:
    """Whether the user has scheduled events with mesa; then steps are made one by one."""
    events = getattr(model, "_event_list", None)
    return events is not None and len(events) > 0


def release(model: World) -> None:
    """Drop the references to a model that mesa 3.3 would keep for ever."""
    numbers = getattr(mesa.Agent, "_ids", None)
    if numbers is not None:
        numbers.pop(model, None)
