"""The band of other seeds: its numbers are those of worlds run by hand, and it ends when nobody wants it."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator
from typing import Any

import live_models
import numpy as np
import pytest

from teamsight import CMOMMT
from teamsight.live import protocol
from teamsight.live.band import MOST_WORK, Band
from teamsight.live.controls import controls_of
from teamsight.live.protocol import LEAST_RUNS, Message, parsed
from teamsight.live.session import Session
from teamsight.live.worlds import Worlds

_PATIENCE = 300.0  # seconds, against a hang
_SMALL: dict[str, Any] = {"robots": 4, "targets": 5}


class Posts:
    """What a band posts, and waiting for it."""

    def __init__(self) -> None:
        self.all: list[tuple[str, dict[str, Any]]] = []
        self._news = threading.Condition()

    def __call__(self, kind: str, **fields: Any) -> None:
        with self._news:
            self.all.append((kind, fields))
            self._news.notify_all()

    def until(self, kind: str, test: Any = lambda fields: True) -> dict[str, Any]:
        """Wait for a post of a kind that passes a test."""

        def found() -> list[dict[str, Any]]:
            return [fields for one, fields in self.all if one == kind and test(fields)]

        with self._news:
            assert self._news.wait_for(found, _PATIENCE)
        return found()[0]


def worlds_of(model: Any = CMOMMT, *settings: dict[str, Any], seed: int = 3) -> Worlds:
    """Return worlds that have been built."""
    worlds = Worlds(model, list(settings) or [dict(_SMALL)], seed)
    worlds.replace(worlds.build(worlds.settings, seed), seed)
    return worlds


@pytest.fixture
def posts() -> Posts:
    return Posts()


def begun(worlds: Worlds, runs: int, ticks: int, posts: Posts) -> Band:
    band = Band(worlds, runs, ticks, posts)
    band.start()
    return band


def by_hand(settings: dict[str, Any], seeds: range, ticks: int) -> Any:
    """Return the observed fractions, shape (runs, 1 + ticks), step by step."""
    rows = []
    for seed in seeds:
        world = CMOMMT(**settings, seed=seed)
        row = [world.observed]
        for _ in range(ticks):
            world.step()
            row.append(world.observed)
        rows.append(row)
    return np.array(rows)


def test_the_numbers_are_those_of_worlds_run_by_hand(posts: Posts) -> None:
    settings = dict(_SMALL), {**_SMALL, "awareness": "none", "policy": "random-walk"}
    begun(worlds_of(CMOMMT, *settings), 9, 40, posts)
    found = posts.until("band", lambda fields: fields["bands"])
    assert (found["runs"], found["done"], found["ticks"], found["first"], found["last"]) == (9, 9, 40, "4", "12")
    for one, parameters in zip(found["bands"], settings, strict=True):
        rows = np.sort(by_hand(parameters, range(4, 13), 40), axis=0)
        assert one["ticks"] == list(range(41))
        np.testing.assert_allclose(one["mean"], rows.mean(axis=0), rtol=1e-14)
        # Of nine runs the 5th percentile lies 0.4 of the way from the least to the next.
        np.testing.assert_allclose(one["low"], rows[0] + 0.4 * (rows[1] - rows[0]), atol=1e-14)
        np.testing.assert_allclose(one["high"], rows[-1] - 0.4 * (rows[-1] - rows[-2]), atol=1e-14)
    assert [fields["done"] for _, fields in posts.all] == [*range(10), 9]


def test_of_long_runs_a_thousand_ticks_are_shown(posts: Posts) -> None:
    begun(worlds_of(), 8, 2_500, posts)
    one = posts.until("band", lambda fields: fields["bands"])["bands"][0]
    assert (len(one["ticks"]), one["ticks"][0], one["ticks"][-1]) == (1_001, 0, 2_500)
    rows = [CMOMMT(**_SMALL, seed=4 + k) for k in range(8)]
    for world in rows:
        world.run(2_500, progress=False)
    assert one["mean"][-1] == pytest.approx(np.mean([world.observed for world in rows]), rel=1e-14)


def test_it_counts_the_runs_that_go_on_and_ends_where_they_are_too_few(posts: Posts) -> None:
    begun(worlds_of(live_models.stopping, {}), 10, 30, posts)
    one = posts.until("band", lambda fields: fields["bands"])["bands"][0]
    # The run of seed s stops after s steps; those of the band have the seeds 4 to 13.
    assert one["count"] == [sum(tick <= seed for seed in range(4, 14)) for tick in range(31)]
    rows = {seed: live_models.stopping(seed=seed) for seed in range(4, 14)}
    for world in rows.values():
        world.run(30, progress=False)
    observed = {seed: world.recording.history["observed"].to_numpy() for seed, world in rows.items()}
    for tick in range(1, 31):
        left = [values[tick - 1] for seed, values in observed.items() if tick <= seed]
        if len(left) >= LEAST_RUNS:
            assert one["mean"][tick] == pytest.approx(np.mean(left), rel=1e-14)
        else:
            assert [one[name][tick] for name in ("mean", "low", "high")] == pytest.approx([np.nan] * 3, nan_ok=True)
    assert [one["count"][tick] for tick in (6, 7)] == [8, 7]


def test_a_band_is_cancelled_in_the_middle_of_a_run(posts: Posts) -> None:
    reached, go_on = threading.Event(), threading.Event()

    def slow(robots: int = 4, seed: int = 0) -> CMOMMT:
        world = CMOMMT(robots, 5, seed=seed)
        if seed == 5:
            reached.set()
            assert go_on.wait(_PATIENCE)
        return world

    band = begun(worlds_of(slow, {}), 8, 50, posts)
    assert reached.wait(_PATIENCE)
    band.cancel()
    go_on.set()
    band._thread.join(_PATIENCE)
    assert not band._thread.is_alive()
    assert [fields["done"] for _, fields in posts.all] == [0, 1]


@pytest.mark.parametrize("error", [RuntimeError("no\ntable"), SystemExit(3)])
def test_a_model_that_fails_is_named_with_its_seed(posts: Posts, error: BaseException) -> None:
    def breaking(seed: int = 0) -> CMOMMT:
        if seed == 6:
            raise error
        return CMOMMT(4, 5, seed=seed)

    begun(worlds_of(breaking, {}), 8, 5, posts)
    said = posts.until("error")["message"]
    assert said.startswith("band: the run of seed 6 failed: ")
    assert type(error).__name__ in said
    assert "\n" not in said
    assert posts.all[-2] == ("band", {"runs": 0})


def test_a_model_that_fails_in_a_step_says_so(posts: Posts) -> None:
    begun(worlds_of(live_models.Failing, {"breaks_at": 5}), 8, 10, posts)
    assert "seed 4 failed: RuntimeError: the battery is on fire" in posts.until("error")["message"]


def test_a_world_of_the_page_is_not_run_by_two_threads(posts: Posts) -> None:
    one = CMOMMT(2, 2, seed=1)
    begun(worlds_of(lambda seed=0: one, {}), 8, 5, posts)
    assert "returns a world that it returned before" in posts.until("error")["message"]
    assert one.tick == 0


def test_what_cannot_be_run_is_refused(posts: Posts) -> None:
    with pytest.raises(ValueError, match="nothing has been run yet"):
        Band(worlds_of(), 8, 0, posts)
    with pytest.raises(ValueError, match=r"64 runs of 100,000 ticks are 2,560,000,000 agent-ticks, at most 1,000,000,000"):
        Band(worlds_of(CMOMMT, {"robots": 300, "targets": 100}), 64, 100_000, posts)
    assert MOST_WORK == 10**9
    with pytest.raises(ValueError, match="ticks=100001: must be at most 100000"):
        Band(worlds_of(), 8, 100_001, posts)
    with pytest.raises(ValueError, match="has no parameter seed"):
        Band(worlds_of(lambda: CMOMMT(2, 2, seed=1), {}), 8, 5, posts)
    assert posts.all == []


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"runs": 7, "ticks": None}, "runs=7: must be at least 8"), ({"runs": 65, "ticks": None}, "runs=65: must be at most 64"),
        ({"runs": 8, "ticks": 0}, "ticks=0: must be at least 1"), ({"runs": 8, "ticks": 10**6}, "at most 100000"),
        ({"runs": 8.5, "ticks": 3}, "runs=8.5"), ({"runs": 8}, "band: must have runs, ticks"),
    ],
)  # fmt: skip
def test_wrong_messages_are_refused(fields: dict[str, Any], said: str) -> None:
    with pytest.raises((TypeError, ValueError), match=said):
        parsed(json.dumps({"type": "band", **fields}))


@pytest.fixture
def session() -> Iterator[Session]:
    worlds = Worlds(CMOMMT, [dict(_SMALL)], 3)
    one = Session(worlds, {one.name: one for one in controls_of(CMOMMT, _SMALL)}, rate=None, running=False)
    one.watched_by(1)
    yield one
    one.close()


def done(session: Session) -> None:
    """Wait until a session has carried out all messages."""
    end = time.monotonic() + _PATIENCE
    while session.busy():
        assert time.monotonic() < end
        time.sleep(0.005)


@pytest.mark.parametrize("why", ["reset", "live", "again", "drop", "closed"])
def test_a_band_is_dropped_when_it_is_of_something_else(session: Session, why: str) -> None:
    acts = {
        "reset": lambda: session.ask(Message("reset", {})),
        "live": lambda: session.ask(Message("set", {"name": "policy", "value": "centroid", "track": None})),
        "again": lambda: session.ask(Message("set", {"name": "robots", "value": 3, "track": None})),
        "drop": lambda: session.ask(Message("drop", {})),
        "closed": lambda: session.watched_by(0),
    }
    session.ask(Message("step", {}))
    session.ask(Message("band", {"runs": 8, "ticks": None}))
    done(session)
    band = session._band
    assert band is not None
    band._thread.join(_PATIENCE)
    assert '"runs":8,"done":8,"ticks":1' in session.board["band"]
    # A step leaves it, and so does a setting that is refused.
    session.ask(Message("step", {}))
    session.ask(Message("set", {"name": "robots", "value": -1, "track": None}))
    done(session)
    assert session._band is band
    acts[why]()
    done(session)
    assert session._band is None
    assert session.board["band"] == protocol.text("band", runs=0)
