"""mesa's own events happen when they do in a plain mesa model, and batches keep their seeds."""

from __future__ import annotations

import inspect
from typing import Any

import mesa
import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teamsight import CMOMMT, Disc, Robot, Target, World

needs_events = pytest.mark.skipif(not hasattr(mesa.Model, "schedule_event"), reason="this mesa has no events")
names_seeds = "rng" in inspect.signature(mesa.batch_run).parameters

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")


class Logging:
    """Notes each step and each event with mesa's counters."""

    log: list[Any]

    def note(self, what: str) -> None:
        self.log.append((what, self.steps, self.time))  # type: ignore[attr-defined]


class PlainModel(Logging, mesa.Model):  # type: ignore[misc]
    def __init__(self) -> None:
        super().__init__(rng=1)
        self.log = []

    def step(self) -> None:
        self.note("step")


class OurModel(Logging, World):
    def __init__(self) -> None:
        super().__init__(Disc(2.0), rng=1)
        self.log = []
        self.add(Robot, 1, policy="random-walk")

    def step(self) -> None:
        self.note("step")
        super().step()


# A priority that is high would put an event of a whole time before the step that leads to it; here it comes after.
plans = st.lists(
    st.tuples(
        st.sampled_from(["at", "after", "recurring", "nested", "cancelled", "cancelled later"]),
        st.integers(0, 8),
        st.sampled_from(["DEFAULT", "LOW"]),
        st.integers(0, 5),
    ),
    max_size=6,
)


def played(model: Any, plan: list[tuple[str, int, str, int]]) -> list[Any]:
    """Return what a model notes under a plan of events, each of which is scheduled between two steps."""
    from mesa.time import Priority, Schedule

    kept, later = [], []
    for tick in range(12):
        for number, (kind, time, priority, planned_at) in enumerate(plan):
            if planned_at != tick:
                continue

            def event(number: int = number) -> None:
                model.note(f"event {number}")

            def nested(number: int = number, event: Any = event, priority: str = priority) -> None:
                model.note(f"nested {number}")
                model.schedule_event(event, after=1.0, priority=Priority[priority])

            kept += [nested, event]
            chosen = nested if kind == "nested" else event
            if kind == "recurring":
                model.schedule_recurring(event, Schedule(interval=max(time, 1), count=3), priority=Priority[priority])
            elif kind == "after":
                model.schedule_event(chosen, after=time, priority=Priority[priority])
            else:
                planned = model.schedule_event(chosen, at=model.time + time, priority=Priority[priority])
                if kind == "cancelled":
                    planned.cancel()
                if kind == "cancelled later":
                    later.append((tick + 2, planned))
        for when, planned in later:
            if when == tick:
                planned.cancel()
        model.step()
    return model.log  # type: ignore[no-any-return]


@needs_events
@settings(deadline=None)
@given(plans)
def test_events_happen_as_in_plain_mesa(plan: list[tuple[str, int, str, int]]) -> None:
    assert played(OurModel(), plan) == played(PlainModel(), plan)


@pytest.mark.parametrize("path", ["run", "step"])
def test_an_event_at_3_happens_after_three_steps(path: str) -> None:
    model, log = CMOMMT(rng=1), []

    def note() -> None:
        log.append((model.tick, model.steps, model.clock.now))

    model.schedule_event(note, at=3)
    model.schedule_event(note, after=4.5)
    model.schedule_event(note, at=8)
    model.run(8) if path == "run" else [model.step() for _ in range(8)]
    # The clock's rule for times between two ticks: before the next step that starts.
    assert log == [(3, 3, 3.0), (5, 5, 4.5), (8, 8, 8.0)]
    assert (model.tick, model.steps, model.clock.now) == (8, 8, 8.0)


def test_an_event_of_mesa_that_is_planned_by_one_of_ours_is_not_missed() -> None:
    model, log = CMOMMT(rng=1), []

    def note() -> None:
        log.append(model.tick)

    model.clock.at(2, lambda: model.schedule_event(note, after=2))
    model.run(10)
    assert log == [4]
    assert model.tick == 10


def test_an_event_that_fails_leaves_the_counters_as_they_are() -> None:
    model = CMOMMT(rng=1)

    def fail() -> None:
        raise ZeroDivisionError

    model.schedule_event(fail, at=2.5)
    with pytest.raises(ZeroDivisionError):
        model.run(10)
    assert (model.tick, model.steps) == (3, 3)
    model.run(3)
    assert (model.tick, model.steps, model.clock.now) == (6, 6, 6.0)


class Patrol(CMOMMT):
    """A model of a user's own, which passes on what it does not know."""

    def __init__(self, watchers: int = 3, **others: Any) -> None:
        super().__init__(robots=watchers, **others)


class Sparse(World):
    """A plain world of a user's own."""

    def __init__(self, robots: int = 3, rng: int | None = None, seed: int | None = None) -> None:
        super().__init__(Disc(2.0), rng=rng, seed=seed)
        watchers = self.add(Robot, robots, policy="a-cmommt", awareness="pairwise")
        self.senses(watchers, self.add(Target, 4, policy="random-walk", speed=0.05))


@pytest.mark.short
@pytest.mark.parametrize("how", ["as parameters", "as seeds"])
@pytest.mark.parametrize(("kind", "size"), [(Patrol, "watchers"), (Sparse, "robots")])
def test_a_batch_keeps_its_seeds(kind: type[World], size: str, how: str) -> None:
    if how == "as seeds" and not names_seeds:
        pytest.skip("this batch_run hands out no seeds")
    swept: dict[str, Any] = {size: [3, 4]}
    named: dict[str, Any] = {"rng": [7, 8]} if how == "as seeds" else {}
    if not named:
        swept["rng"] = [7, 8]
    rows = mesa.batch_run(kind, swept, max_steps=12, number_processes=1, display_progress=False, **named)
    table = pd.DataFrame(rows)
    assert sorted(table.seed_used) == [7, 7, 8, 8]
    for row in table.to_dict("records"):
        model = kind(**{size: row[size], "rng": row["seed_used"]})
        model.run(12)
        assert row["Step"] == 12
        assert row["observed_fraction"] == model.observed_fraction
        assert row["max_neighbours"] == model.max_neighbours


def test_a_subclass_that_names_everything_is_left_alone() -> None:
    assert "watchers" in inspect.signature(Patrol).parameters
    assert {"rng", "seed"} <= set(inspect.signature(Patrol).parameters)
    assert list(inspect.signature(Sparse).parameters) == ["robots", "rng", "seed"]
    assert "radius" in inspect.signature(CMOMMT).parameters


@pytest.mark.short
def test_a_plain_world_collects_its_history() -> None:
    run, stepped, mixed = (Sparse(rng=3) for _ in range(3))
    run.run(10)
    for _ in range(10):
        stepped.step()
    mixed.step()
    mixed.run(5)
    mixed.step()
    mixed.run(3)
    tables = [world.datacollector.get_model_vars_dataframe() for world in (run, stepped, mixed)]
    assert len(tables[0]) == 11
    assert tables[0].equals(tables[1])
    assert tables[0].equals(tables[2])
    assert tables[0].observed.tolist()[1:] == run.recording.history.observed.tolist()
    assert np.isnan(tables[0].observed_fraction[0])
    run.reset()
    run.run(10)
    assert run.datacollector.get_model_vars_dataframe().equals(tables[0])
