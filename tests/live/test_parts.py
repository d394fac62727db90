"""The parts of the live page that need no server: rate, waiting messages, what is kept, clients."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from teamsight import CMOMMT
from teamsight.live import worlds
from teamsight.live.protocol import Message
from teamsight.live.server import MOST_UNDER_WAY, Client
from teamsight.live.session import MOST_WAITING, Frames, Pacer, Session


@pytest.mark.parametrize(
    ("rate", "every", "steps"), [(30, 1, 1), (60, 1, 1), (600, 1, 10), (600, 4, 8), (600, 50, 50), (1, 5, 5), (0.1, 1, 1)]
)
def test_a_stretch_has_the_steps_of_a_frame(rate: float, every: int, steps: int) -> None:
    assert Pacer(rate, every).stretch() == steps


@pytest.mark.parametrize(("rate", "every"), [(30.0, 1), (7.0, 3), (1000.0, 1)])
def test_the_mean_rate_is_right(rate: float, every: int) -> None:
    pacer, now, made = Pacer(rate, every), 100.0, 0
    pacer.begin(now, 0)
    while now < 110.0:
        now += pacer.wait(now)
        assert pacer.wait(now) == pytest.approx(0.0, abs=1e-9)
        steps = pacer.stretch()
        pacer.begin(now, steps)
        made += steps
        now += 0.001
    assert made == pytest.approx(10 * rate, rel=0.03, abs=2 * every)


def test_a_slow_simulation_does_not_catch_up_for_long() -> None:
    pacer = Pacer(100.0, 1)
    pacer.begin(0.0, 1)
    # It stood still for a minute.
    now, at_once = 60.0, 0
    while pacer.wait(now) == 0.0:
        pacer.begin(now, 1)
        at_once += 1
    assert at_once < 40


def test_a_run_does_not_catch_up_on_the_time_before_it() -> None:
    pacer = Pacer(100.0, 1)
    pacer.begin(0.0, 1)
    pacer.start(60.0)
    pacer.begin(60.0, 1)
    assert pacer.wait(60.0) == pytest.approx(0.01)
    # Nor does a second start make it wait less.
    pacer.start(60.0)
    assert pacer.wait(60.0) == pytest.approx(0.01)


def test_as_fast_as_possible_adapts_to_what_steps_cost() -> None:
    pacer = Pacer(None, 1)
    for _ in range(50):
        pacer.took(10, 10 * 0.001)
    assert 12 <= pacer.stretch() <= 20
    for _ in range(50):
        pacer.took(1, 3.0)
    assert pacer.stretch() == pacer.part() == 1
    assert pacer.wait(5.0) == 0.0


class Idle(Session):
    """A session without a thread."""

    def __init__(self) -> None:
        super().__init__(worlds.Worlds(CMOMMT, [{}], 0), {}, rate=None, running=False)
        self.close()

    def _work(self) -> None:
        pass


def test_of_messages_that_set_the_same_the_last_one_counts() -> None:
    session = Idle()
    kinds = "run step set reset pause step reset run"
    for value, kind in enumerate(f"{kinds} {kinds}".split()):
        session.ask(Message(kind, {"name": "a", "value": value, "track": 1} if kind == "set" else {}))
    session.ask(Message("set", {"name": "b", "value": 1, "track": 1}))
    assert session.busy()
    found = session._take()
    assert " ".join(one.type for one in found) == "step step step set pause step reset run set"
    assert [one.fields["value"] for one in found if one.fields] == [10, 1]


def test_only_so_many_messages_wait() -> None:
    session = Idle()
    assert [one.type for one in session._take()] == ["reset"]
    for _ in range(MOST_WAITING):
        session.ask(Message("step", {}))
    with pytest.raises(ValueError, match="step: 64 messages wait already"):
        session.ask(Message("step", {}))


def test_frames_are_kept_within_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worlds, "MOST_FRAMES", 4)
    track = worlds.LiveTrack(CMOMMT, {"robots": 2, "targets": 2}, 1, 1)
    blocks = [track.look()]
    for _ in range(6):
        track.run(1)
        blocks.append(track.look())
    assert track.newest()[1] == blocks[-4:]
    assert track.newest(len(blocks[-1]) + len(blocks[-2]))[1] == blocks[-2:]
    blocks[-1] = track.look(again=True)
    assert track.newest()[1] == blocks[-4:]
    monkeypatch.setattr(worlds, "MOST_BYTES", 1)
    assert track.look() == blocks[-1]
    assert track.newest()[1] == blocks[-1:]


def test_a_client_has_two_frames_under_way_and_skips_the_others() -> None:
    async def talk() -> None:
        scenes = ("scene",)
        board: dict[str, Any] = {"error": "an old one", "scene": scenes}
        client, sent = Client(board), []
        for number in range(1, 7):
            board |= {"frame": Frames(number, scenes, (b"%d" % number,)), "state": f"state {number}"}
            client.news.set()
            sent.append(await client.messages())
        assert sent[0] == ["scene", "state 1", b"1"]
        assert sent[1] == ["state 2", b"2"]
        # Frames 3 to 6 are not sent, and wait nowhere.
        assert [len(one) for one in sent[2:]] == [1, 1, 1, 1]
        client.acknowledge(1)
        assert await client.messages() == [b"6"]
        client.acknowledge(6)
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(client.messages(), 0.01)

    assert MOST_UNDER_WAY == 2
    asyncio.run(talk())


def test_frames_are_not_sent_before_their_scene() -> None:
    async def talk() -> None:
        old, new = ("old",), ("new",)
        board: dict[str, Any] = {"scene": old, "frame": Frames(1, old, (b"1",))}
        client = Client(board)
        assert await client.messages() == ["old", b"1"]
        board["scene"] = new
        client.acknowledge(1)
        assert await client.messages() == ["new"]
        board["frame"] = Frames(2, new, (b"2",))
        client.news.set()
        assert await client.messages() == [b"2"]

    asyncio.run(talk())


def test_what_was_meant_for_other_worlds_is_not_done() -> None:
    session = Idle()
    session._run = "now"
    with pytest.raises(ValueError, match="move: the worlds were built anew meanwhile, so nothing was done"):
        session._intervene("move", run="before", track=0, both=True, body=1, x=0.0, y=0.0)


def test_before_anything_is_kept_a_film_says_so() -> None:
    session = Idle()
    with pytest.raises(ValueError, match="nothing is recorded yet; wait until"):
        session.reel(session._run)
    with pytest.raises(ValueError, match="nothing is recorded yet; wait until"):
        session.film(lambda done, frames: None, session._run)
