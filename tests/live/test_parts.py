"""The parts of the live page that need no server: rate, waiting messages, the board, what is kept, clients."""

from __future__ import annotations

import asyncio
from itertools import pairwise
from typing import Any

import pytest

from teamsight.live.board import Board, Frames, Scenes
from teamsight.live.client import MOST_UNDER_WAY, Client
from teamsight.live.commands import MOST_WAITING, Commands, keep
from teamsight.live.kept import MOST_BYTES, MOST_FRAMES, Kept
from teamsight.live.pacing import Pacer
from teamsight.live.protocol import Message


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


def test_as_fast_as_possible_adapts_to_what_steps_cost() -> None:
    pacer = Pacer(None, 1)
    for _ in range(50):
        pacer.took(10, 10 * 0.001)
    assert 12 <= pacer.stretch() <= 20
    for _ in range(50):
        pacer.took(1, 3.0)
    assert pacer.stretch() == pacer.part() == 1
    assert pacer.wait(5.0) == 0.0


def test_of_messages_that_set_the_same_the_last_one_counts() -> None:
    commands = Commands()
    sets = [Message("set", {"name": name, "value": value, "track": None}) for name, value in (("a", 1), ("b", 2), ("a", 3))]
    for message in [*sets[:2], Message("step", {}), Message("step", {}), sets[2]]:
        commands.put(message)
    assert [(one.type, one.fields.get("value")) for one in commands.take(0.0)] == [("set", 2), ("step", None), ("step", None), ("set", 3)]
    assert commands.take(0.0) == []
    assert len(commands) == 4


def test_each_message_is_replaced_wherever_it_waits() -> None:
    waiting: dict[Any, Message] = {}
    kinds = "run step set reset pause step reset run"
    for message in [Message(kind, {"name": "a", "track": 1} if kind == "set" else {}) for kind in f"{kinds} {kinds}".split()]:
        keep(waiting, message)
    assert " ".join(one.type for one in waiting.values()) == "step step step set pause step reset run"


def test_only_so_many_messages_wait() -> None:
    commands = Commands()
    for _ in range(MOST_WAITING):
        commands.put(Message("step", {}))
    with pytest.raises(ValueError, match="step: 64 messages wait already"):
        commands.put(Message("step", {}))


def test_frames_are_kept_within_limits() -> None:
    kept = Kept()
    for number in range(MOST_FRAMES + 10):
        kept.append(number.to_bytes(4, "little"))
    assert len(kept) == MOST_FRAMES
    assert kept.blocks()[0] == (10).to_bytes(4, "little")
    kept.replace_last(b"last")
    assert (len(kept), kept.blocks()[-1]) == (MOST_FRAMES, b"last")
    kept.clear()
    for _ in range(5):
        kept.append(bytes(MOST_BYTES // 2))
    assert len(kept) == 2
    kept.append(bytes(2 * MOST_BYTES))
    assert len(kept) == 1


def _frames(number: int, scenes: int = 1) -> Frames:
    return Frames(number, scenes, (b"%d" % number,))


def test_a_client_has_two_frames_under_way_and_skips_the_others() -> None:
    async def talk() -> None:
        board = Board()
        board.post_scenes(Scenes(1, 1, ("scene",)))
        client, sent = Client(board), []
        for number in range(1, 7):
            board.post_frames(_frames(number))
            client.wake()
            board.post("state", f"state {number}")
            sent.append(await client.news())
        assert sent[0] == ["scene", "state 1", b"1"]
        assert sent[1] == ["state 2", b"2"]
        # Frames 3 to 6 are not sent, and wait nowhere.
        assert [len(one) for one in sent[2:]] == [1, 1, 1, 1]
        client.acknowledge(1)
        assert await client.news() == [b"6"]
        client.acknowledge(6)
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(client.news(), 0.01)

    assert MOST_UNDER_WAY == 2
    asyncio.run(talk())


def test_frames_are_not_sent_before_their_scene() -> None:
    async def talk() -> None:
        board = Board()
        board.post_scenes(Scenes(1, 1, ("old",)))
        board.post_frames(_frames(1, scenes=1))
        client = Client(board)
        assert await client.news() == ["old", b"1"]
        board.post_scenes(Scenes(2, 2, ("new",)))
        client.wake()
        client.acknowledge(1)
        assert await client.news() == ["new"]
        board.post_frames(_frames(2, scenes=2))
        client.wake()
        assert await client.news() == [b"2"]

    asyncio.run(talk())


def test_the_board_wakes_once_until_it_is_read() -> None:
    board, woken = Board(), []
    board.listen(lambda: woken.append(1))
    for number in range(1, 50):
        board.post_frames(_frames(number))
    assert len(woken) == 1
    assert board.read().frames == _frames(49)
    board.post("state", "one")
    board.post("state", "two")
    assert len(woken) == 2
    assert board.read().texts["state"] == (2, "two")
    versions = []
    for text in ("two", "two", "three"):
        board.post("state", text)
        versions.append(board.read().texts["state"][0])
    assert [later - earlier for earlier, later in pairwise(versions)] == [0, 1]
