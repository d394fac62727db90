"""mesa as this package sees it: its base classes with types, and what differs between its versions.

Those are step counters, time, events, identities and the release of models.
"""

from __future__ import annotations

import inspect
import math
from functools import partial
from typing import Any, NamedTuple

import mesa
import numpy as np

# The priority of mesa 3.5's own event for a step: it precedes events of the same time and default priority.
_HIGH = 1


class LazyGenerator:
    """The attribute `rng` of a model: mesa's generator. After it is set to None, the next use seeds a new one."""

    def __get__(self, model: Any, owner: type | None = None) -> Any:
        if model is None:
            return self
        if model._generator is None:
            model._generator = np.random.default_rng(model.seed_used)
        return model._generator

    def __set__(self, model: Any, generator: np.random.Generator | None) -> None:
        model._generator = generator


class Generators(NamedTuple):
    """Where the random numbers of a model are: the state of `random`, and `rng`, None if it has not been used."""

    random: Any
    rng: np.random.Generator | None


def generators(model: Any) -> Generators:
    """Return where the random numbers of a model are; not a copy."""
    return Generators(model.random.getstate(), model._generator)


def put_generators(model: Any, saved: Generators) -> None:
    """Go on from where the random numbers were; an `rng` of the same kind stays the same object."""
    model.random.setstate(saved.random)
    mine, theirs = (getattr(one, "bit_generator", None) for one in (model._generator, saved.rng))
    if mine is not None and theirs is not None and type(mine) is type(theirs):
        mine.state = theirs.state
    else:
        model.rng = saved.rng


def take_over_step(model: mesa.Model) -> None:
    """Wrap the user's ``step``, in place of mesa 3.5's wrapper, and count the agents from 1.

    mesa 3.5 steps through an event list. After a step has raised, it silently does nothing; and it cannot count many
    steps at once. The user's own mesa events are still processed at their times.
    """
    if not hasattr(model, "agent_id_counter"):
        model.agent_id_counter = 1
    schedule = getattr(model, "_default_schedule", None)
    if schedule is not None:
        schedule.stop()
    model._step_event = _next_event_number(model)
    model.step = partial(_counted_step, model)  # type: ignore[method-assign]


def _counted_step(model: mesa.Model, *arguments: Any, **named: Any) -> None:
    stepper = model._stepper
    stepper.finish_tick()
    steps, tick, calls = model.steps, model.tick, stepper.calls
    if has_events(model):
        _process_until(model, (steps + 1.0, _HIGH, model._step_event))
    stepper.in_own_step = True
    try:
        count_steps(model, 1)
        model._user_step(*arguments, **named)
        if stepper.calls == calls:
            stepper.check_step_made()
            set_counters(model, steps + model.tick - tick)
    except BaseException:
        set_counters(model, steps + model.tick - tick)
        raise
    finally:
        stepper.in_own_step = False
    end_step(model)
    stepper.finish_tick()


def end_step(model: mesa.Model) -> None:
    """Process mesa's events that are due at the end of the last counted step."""
    if has_events(model):
        # As in mesa: high-priority events that this step scheduled for the next one precede it.
        model._step_event = _next_event_number(model)
        _process_until(model, (float(model.steps), math.inf, math.inf))


def _process_until(model: mesa.Model, until: tuple[float, float, float]) -> None:
    """Process mesa's events that precede (time, priority, number), as mesa's own step does around the user's."""
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
    """Return the number of mesa's event for the next step. Numbers order events of one time and priority."""
    if "_event_list" not in vars(model):
        return 0
    from mesa.time import Event

    return int(next(Event._ids))


def count_steps(model: mesa.Model, steps: int) -> None:
    """Advance mesa's own counters by this many steps."""
    set_counters(model, model.steps + steps)


def set_counters(model: mesa.Model, steps: int) -> None:
    """Set mesa's own counters."""
    model.steps = steps
    if "_event_list" in vars(model):
        model.time = float(steps)


def has_events(model: mesa.Model) -> bool:
    """Whether the user has scheduled events with mesa. Then steps are made one by one."""
    events: Any = vars(model).get("_event_list")
    return bool(events is not None and len(events))


def number(model: mesa.Model, agent: mesa.Agent) -> None:
    """Give an agent that is being made its `unique_id`, as mesa 3.5 does.

    mesa 3.3 has counted it in a dictionary of all models, which would keep them in memory for ever.
    """
    numbers = getattr(mesa.Agent, "_ids", None)
    if numbers is not None:
        numbers.pop(model, None)
        agent.unique_id = model.agent_id_counter
        model.agent_id_counter += 1


def signature_for_batches(model_class: type[mesa.Model]) -> inspect.Signature | None:
    """Return a signature with `rng` and `seed` for a class whose ``__init__`` passes them on by ``**kwargs``.

    If there is no parameter `seed`, mesa 3.5's ``batch_run`` replaces the user's `rng` by None.
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
