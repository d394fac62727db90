"""mesa, as far as its versions differ: counting steps, keeping time, events, identities, and letting go of a model."""

from __future__ import annotations

import inspect
import itertools
import math
from functools import partial
from typing import Any

import mesa

# What mesa 3.5 gives its own event for a step: it precedes events of the same time whose priority is the default one.
_HIGH = 1


def take_over_step(model: mesa.Model) -> None:
    """Put our own wrapper around the user's ``step``.

    mesa 3.5 steps through an event list which, once a step has raised, silently does nothing for ever; and it cannot be
    told that many steps were made at once. The user's own mesa events still happen at their times.
    """
    schedule = getattr(model, "_default_schedule", None)
    if schedule is not None:
        schedule.stop()
    model._step_event = _next_event_number(model)
    model.step = partial(_counted_step, model)  # type: ignore[method-assign]


def _counted_step(model: mesa.Model, *arguments: Any, **named: Any) -> None:
    steps, tick = model.steps, model.tick
    if has_events(model):
        _let_happen(model, (steps + 1.0, _HIGH, model._step_event))
    try:
        count_steps(model, 1)
        model._user_step(*arguments, **named)
    except BaseException:
        set_counters(model, steps + model.tick - tick)
        raise
    end_step(model)


def end_step(model: mesa.Model) -> None:
    """Let mesa's events happen that are due at the end of the step which was counted last."""
    if has_events(model):
        # As in mesa: what was scheduled during this step, with high priority and for the next, precedes the next.
        model._step_event = _next_event_number(model)
        _let_happen(model, (float(model.steps), math.inf, math.inf))


def _let_happen(model: mesa.Model, until: tuple[float, float, float]) -> None:
    """Let mesa's events happen that precede (time, priority, number); mesa's own step does so around the user's."""
    events = model._event_list
    while has_events(model):
        try:
            event = events.pop_event()
        except IndexError:
            break
        if (event.time, event.priority, event.unique_id) >= until:
            events.add_event(event)
            break
        model.time = event.time
        event.execute()
    model.time = until[0]


def _next_event_number(model: mesa.Model) -> int:
    """Return the number that mesa's event for the next step would have; it orders events of one time and priority."""
    if not hasattr(model, "_event_list"):
        return 0
    from mesa.time import Event

    return int(next(Event._ids))


def count_steps(model: mesa.Model, steps: int) -> None:
    """Advance mesa's own counters by this many steps."""
    set_counters(model, model.steps + steps)


def set_counters(model: mesa.Model, steps: int) -> None:
    """Set mesa's own counters."""
    model.steps = steps
    if hasattr(model, "_event_list"):
        model.time = float(steps)


def has_events(model: mesa.Model) -> bool:
    """Whether the user has scheduled events with mesa; then steps are made one by one."""
    events: Any = getattr(model, "_event_list", None)
    return bool(events is not None and len(events))


def next_identity(model: mesa.Model) -> int:
    """Return the `unique_id` that the next agent will get."""
    if hasattr(model, "agent_id_counter"):
        return int(model.agent_id_counter)
    following = int(next(mesa.Agent._ids[model]))
    set_next_identity(model, following)
    return following


def set_next_identity(model: mesa.Model, identity: int) -> None:
    """Set the `unique_id` that the next agent gets."""
    if hasattr(model, "agent_id_counter"):
        model.agent_id_counter = identity
    else:
        mesa.Agent._ids[model] = itertools.count(identity)


def signature_for_batches(model_class: type[mesa.Model]) -> inspect.Signature | None:
    """Return a signature that names `rng` and `seed`, for a class whose ``__init__`` passes them on by ``**kwargs``.

    mesa 3.5's ``batch_run`` looks for the name `seed`; where it finds none, it replaces the seeds of the user's `rng`
    by None.
    """
    signature = inspect.signature(model_class.__init__)
    own = list(signature.parameters.values())[1:]
    if not own or own[-1].kind is not inspect.Parameter.VAR_KEYWORD:
        return None
    names = {parameter.name for parameter in own}
    passed_on = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None)
        for name in ("rng", "seed")
        if name not in names
    ]
    return signature.replace(parameters=[*own[:-1], *passed_on, own[-1]])


def release(model: mesa.Model) -> None:
    """Drop the references to a model that mesa 3.3 would keep for ever."""
    numbers = getattr(mesa.Agent, "_ids", None)
    if numbers is not None:
        numbers.pop(model, None)
