"""The server: what it serves, whom it refuses, and that nonsense does not bring it down."""

from __future__ import annotations

import base64
import contextlib
import http.client
import io
import json
import random
import re
import socket
import threading
import time
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import live_models
import pytest
from websockets.exceptions import ConnectionClosed, ConnectionClosedError, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from teamsight import CMOMMT, Disc, World
from teamsight.agents.engine import engine
from teamsight.core.kernel.report import REPORT
from teamsight.live import LivePage, session, watch
from teamsight.live.protocol import KINDS, MOST_BYTES
from teamsight.live.worlds import LiveTrack
from teamsight.tasks.registry import TASKS

_PATIENCE = 300.0  # seconds, against a hang


@pytest.fixture
def live() -> Iterator[Callable[..., LivePage]]:
    """Serves live pages on free ports, and closes them."""
    made: list[LivePage] = []

    def serve(model: Any = CMOMMT, parameters: Any = None, **how: Any) -> LivePage:
        made.append(watch(model, parameters, **{"port": 0, "running": False, "browser": False, "wait": False, **how}))
        return made[-1]

    yield serve
    for one in made:
        one.close()


def opened(page: LivePage, **how: Any) -> ClientConnection:
    """Open a socket as the page does."""
    base, _, query = page.url.partition("?")
    address = base.replace("http", "ws") + "socket" + ("?" + query if query else "")
    return connect(address, **{"origin": base.rstrip("/"), "max_size": None, "proxy": None, **how})


def answer(page: LivePage, path: str = "/", **headers: str) -> http.client.HTTPResponse:
    """Return what the server answers to a request."""
    connection = http.client.HTTPConnection("127.0.0.1", port_of(page), timeout=_PATIENCE)
    connection.request("GET", path, headers=headers)
    return connection.getresponse()


def port_of(page: LivePage) -> int:
    return int(page.url.split(":")[2].partition("/")[0])


def until(socket: ClientConnection, kind: str, test: Callable[[dict[str, Any]], bool] = lambda message: True) -> dict[str, Any]:
    """Read until a message of a kind that passes a test, and acknowledge the frames before it."""
    while True:
        data = socket.recv(timeout=_PATIENCE)
        if isinstance(data, bytes):
            socket.send(json.dumps({"type": "ack", "frame": int.from_bytes(data[4:8], "little")}))
            continue
        message: dict[str, Any] = json.loads(data)
        if message["type"] == kind and test(message):
            return message


def rest(page: LivePage) -> None:
    """Wait until all messages are carried out."""
    end = time.monotonic() + _PATIENCE
    while page.session.busy():
        assert time.monotonic() < end
        time.sleep(0.01)


def ask(socket: ClientConnection, kind: str, **fields: Any) -> None:
    socket.send(json.dumps({"type": kind, **fields}))


def test_the_page_allows_itself_only(live: Callable[..., LivePage]) -> None:
    page = live()
    found = answer(page)
    assert found.status == 200
    policy = found.headers["Content-Security-Policy"]
    assert policy.startswith("default-src 'none'; script-src 'sha256-")
    assert f"connect-src ws://127.0.0.1:{port_of(page)} " in policy
    assert "unsafe" not in policy
    assert found.headers["X-Content-Type-Options"] == "nosniff"
    assert found.headers["Cache-Control"] == "no-store"
    body = found.read().decode()
    # No script or style but those whose digests are named; what the title says is text.
    assert body.count("<script>") == body.count("</script>") == policy.partition("style-src")[0].count("sha256-")
    assert "http://" not in body.replace("http://www.w3.org/", "")
    assert answer(page, "/view.js").status == 404
    assert answer(page, "/../../etc/passwd").status == 404


@pytest.mark.parametrize("beside", [None, {"policy": "centroid"}])
def test_a_picture_is_sent_before_the_kernels_of_steps_are_ready(
    live: Callable[..., LivePage], monkeypatch: pytest.MonkeyPatch, beside: Any
) -> None:
    go, ready = threading.Event(), engine.connect

    def slowly(data: Any) -> Any:
        REPORT.begin("rule")
        assert go.wait(_PATIENCE)
        REPORT.end(is_done=True)
        return ready(data)

    # Before it a world has no binding, which holds the addresses of all kernels.
    monkeypatch.setattr(engine, "connect", slowly)
    page = live(CMOMMT, {"robots": 4, "targets": 3, "seed": 5}, beside=beside)
    with opened(page) as socket:
        assert until(socket, "scene")["tracks"] == 1
        assert "Compiling kernels" in until(socket, "state")["busy"]
        while not isinstance(socket.recv(timeout=_PATIENCE), bytes):
            pass
        assert not page.session.worlds.tracks
        go.set()
        until(socket, "controls")
        assert len(page.session.worlds.tracks) == (1 if beside is None else 2)
        assert not page.session._engines


def test_strangers_are_refused(live: Callable[..., LivePage]) -> None:
    page = live()
    assert answer(page, Host="evil.example").status == 403
    assert answer(page, Origin="http://evil.example").status == 403
    for origin in ("http://evil.example", None):
        with pytest.raises(InvalidStatus, match="403"):
            opened(page, origin=origin)
    with pytest.raises(InvalidStatus, match="403"):
        opened(page, additional_headers={"Sec-Fetch-Site": "cross-site"})


def test_the_token_opens_the_page(live: Callable[..., LivePage]) -> None:
    page = live(token="")
    token = page.url.partition("token=")[2]
    assert len(token) >= 20
    assert answer(page).status == 403
    assert answer(page, f"/?token={token[:-1]}").status == 403
    assert answer(page, f"/?token={token}").status == 200
    with opened(page) as socket:
        until(socket, "scene")


def test_a_port_in_use_is_named(live: Callable[..., LivePage]) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(ValueError, match=rf"port={port}: is in use .*--port 0"):
            live(port=port)
    with pytest.raises(ValueError, match=r"host='203\.0\.113\.7': is no address of this computer"):
        live(host="203.0.113.7", token="")


def test_sets_steps_and_saves(live: Callable[..., LivePage]) -> None:
    page = live(parameters={"robots": 4, "seed": 9})
    with opened(page) as socket:
        assert until(socket, "scene")["scene"]["seed"] == 9
        ask(socket, "set", name="policy", value="centroid", track=None)
        assert until(socket, "controls", lambda one: one["values"][0]["policy"] == "centroid")
        ask(socket, "step")
        assert until(socket, "state", lambda one: one["made"] == 1)["running"] is False
        ask(socket, "save")
        saved = until(socket, "recording")
        assert saved["name"].startswith("teamsight-cmommt-")
        assert saved["name"].endswith("-seed-9.html")
        assert saved["html"].startswith("<!doctype html>")
        ask(socket, "set", name="robots", value=7, track=None)
        state = until(socket, "state", lambda one: "robots 7" in one["note"])
        assert state["made"] == 0
    assert len(page.session.worlds.tracks[0].world.robots) == 7
    assert type(page.session.worlds.tracks[0].world.robots.policy).__name__ == "Centroid"


def no_video() -> None:
    raise ImportError


def filmed(page: LivePage, socket: ClientConnection, kind: str = "film", first: int | None = None, last: int | None = None) -> None:
    """Ask for a film of the worlds that there are."""
    ask(socket, kind, run=page.session._run, first=first, last=last)


def stepped(socket: ClientConnection, steps: int) -> None:
    for made in range(1, steps + 1):
        ask(socket, "step")
        until(socket, "state", lambda one, made=made: one["made"] == made)


def test_a_film_is_of_the_newest_frames_or_of_chosen_ones(live: Callable[..., LivePage], monkeypatch: pytest.MonkeyPatch) -> None:
    image = pytest.importorskip("PIL.Image")
    monkeypatch.setattr(session, "check_video", no_video)
    monkeypatch.setattr(session, "MOST_IN_GIF", 3)
    shown = list[list[float]]()
    rendered = session.rendered

    def watched(tracks: Any, *given: Any, **more: Any) -> bytes:
        shown.append([frame.time for frame in tracks[0].frames])
        return rendered(tracks, *given, **more)

    monkeypatch.setattr(session, "rendered", watched)
    page = live(parameters={"robots": 4, "targets": 3, "seed": 9})
    with opened(page) as socket:
        stepped(socket, 7)
        for (first, last), kept in {(None, None): [5, 6, 7], (1, 3): [1, 2, 3], (4, 4): [4], (None, 2): [0, 1, 2], (1, 6): [1, 3, 5]}.items():
            filmed(page, socket, "reel", first, last)
            reel = until(socket, "reel")
            assert (reel["oldest"], reel["newest"], reel["ending"], reel["most"]) == (0, 7, "GIF", 3)
            assert (reel["pictures"], reel["seconds"]) == (len(kept), len(kept) / 20)
            assert reel["frames"] == (6 if (first, last) == (1, 6) else len(kept))
            filmed(page, socket, "film", first, last)
            assert [until(socket, "filming")["done"] for _ in kept] == list(range(len(kept)))
            film = until(socket, "film")
            assert film["name"].endswith("-seed-9.gif")
            with image.open(io.BytesIO(base64.b64decode(film["content"]))) as one:
                assert one.n_frames == len(kept)
                assert one.width == reel["width"]
            assert shown.pop() == kept


@pytest.mark.parametrize(("first", "last"), [(0, 9), (3, 1), (9, 12), (2**53, 2**53)])
def test_ticks_without_frames_are_refused(live: Callable[..., LivePage], first: int, last: int) -> None:
    page = live(parameters={"robots": 4, "targets": 3})
    with opened(page) as socket:
        stepped(socket, 4)
        for kind in ("film", "reel"):
            filmed(page, socket, kind, first, last)
            said = until(socket, "error")["message"]
            assert f"ticks {first:,} to {last:,}: frames are kept of ticks 0 to 4" in said
            assert "choose others" in said


def test_a_film_of_other_worlds_is_refused(live: Callable[..., LivePage]) -> None:
    page = live(parameters={"robots": 4, "targets": 3})
    with opened(page) as socket:
        until(socket, "state")
        before = page.session._run
        for kind, fields in (("reset", {}), ("task", {"name": "forage"})):
            ask(socket, kind, **fields)
            until(socket, "state", lambda one: page.session._run != before)
            ask(socket, "film", run=before, first=0, last=0)
            assert "built anew meanwhile" in until(socket, "error")["message"]
            before = page.session._run


def test_a_film_is_cancelled_by_the_page_that_asked_for_it(live: Callable[..., LivePage], monkeypatch: pytest.MonkeyPatch) -> None:
    page = live(parameters={"robots": 4, "targets": 3})
    go_on, ends = threading.Event(), list[str]()

    def film(progress: Callable[[int, int], object], **ticks: Any) -> tuple[str, bytes]:
        progress(0, 9)
        assert go_on.wait(_PATIENCE)
        progress(1, 9)
        ends.append("whole")
        return "film.gif", b"GIF"

    monkeypatch.setattr(page.session, "film", film)
    with opened(page) as socket, opened(page) as stranger:
        filmed(page, socket)
        assert until(socket, "filming")["frames"] == 9
        # Of somebody else, who has none.
        ask(stranger, "cancel")
        ask(stranger, "copy", form="command")
        until(stranger, "copied")
        go_on.set()
        assert base64.b64decode(until(socket, "film")["content"]) == b"GIF"
        go_on.clear()
        filmed(page, socket)
        until(socket, "filming")
        ask(socket, "cancel")
        ask(socket, "copy", form="command")
        until(socket, "copied")
        go_on.set()
        until(socket, "cancelled")
        assert ends == ["whole"]
        # The next one is not cancelled.
        filmed(page, socket)
        until(socket, "film")


def test_a_film_that_nobody_waits_for_ends(live: Callable[..., LivePage], monkeypatch: pytest.MonkeyPatch) -> None:
    page = live(parameters={"robots": 4, "targets": 3})
    ended, closed, failures = threading.Event(), threading.Event(), list[BaseException]()

    def film(progress: Callable[[int, int], object], **ticks: Any) -> tuple[str, bytes]:
        try:
            progress(0, 9)
            assert closed.wait(_PATIENCE)
            for done in range(1, 9):
                progress(done, 9)
        except ConnectionClosed as error:
            failures.append(error)
            raise
        finally:
            ended.set()
        return "film.gif", b""

    monkeypatch.setattr(page.session, "film", film)
    with opened(page) as socket:
        filmed(page, socket)
        assert until(socket, "filming")["frames"] == 9
        filmed(page, socket)
        assert until(socket, "error")["message"] == "film: one is being made; wait for it"
    end = time.monotonic() + _PATIENCE
    while page.session._viewers:
        assert time.monotonic() < end
        time.sleep(0.01)
    closed.set()
    assert ended.wait(_PATIENCE)
    assert failures


def test_a_film_that_cannot_be_made_says_why(live: Callable[..., LivePage], monkeypatch: pytest.MonkeyPatch) -> None:
    page = live(parameters={"robots": 4, "targets": 3})

    def film(progress: Callable[[int, int], object], **ticks: Any) -> tuple[str, bytes]:
        raise RuntimeError("no reel")

    monkeypatch.setattr(page.session, "film", film)
    with opened(page) as socket:
        filmed(page, socket)
        assert until(socket, "error")["message"].startswith("film: RuntimeError: no reel")


@pytest.fixture
def hold(monkeypatch: pytest.MonkeyPatch) -> Callable[[LivePage], threading.Event]:
    """Let the worlds of a page that are asked for from now on wait until the event is set."""

    def hold(page: LivePage) -> threading.Event:
        build, go_on = page.session.worlds.build, threading.Event()

        def slowly(*asked: Any) -> Any:
            assert go_on.wait(_PATIENCE)
            return build(*asked)

        monkeypatch.setattr(page.session.worlds, "build", slowly)
        return go_on

    return hold


@pytest.mark.parametrize(
    ("asked", "steps", "runs"),
    [("step step", 2, False), ("run pause step", 1, False), ("run pause", 0, False), ("reset step reset step", 1, False), ("step run", 2, True)],
)
def test_what_is_asked_while_worlds_are_built_comes_after_that(
    live: Callable[..., LivePage], hold: Callable[[LivePage], threading.Event], asked: str, steps: int, runs: bool
) -> None:
    """Else a reset under way took the steps away."""
    page = live(parameters={"robots": 4})
    with opened(page) as socket:
        ask(socket, "step")
        until(socket, "state", lambda one: one["made"] == 1)
        go_on = hold(page)
        ask(socket, "set", name="robots", value=7, track=None)
        state = until(socket, "state", lambda one: one["busy"] == "Building …")
        assert (state["made"], state["running"], state["two"]) == (1, False, False)
        # The page shows what was chosen.
        assert json.loads(page.session.board["controls"])["values"][0]["robots"] == 7
        for kind in asked.split():
            ask(socket, kind)
        # Else the last may come when what was asked before is under way.
        while [one.type for one in page.session._waiting.values()][-1:] != asked.split()[-1:]:
            time.sleep(0.01)
        go_on.set()
        until(socket, "state", lambda one: one["running"] == runs and one["made"] >= steps)
        rest(page)
        assert runs or page.session.worlds.tracks[0].world.tick == steps
        assert len(page.session.worlds.tracks[0].world.robots) == 7


def test_a_model_that_has_failed_runs_after_what_mends_it(live: Callable[..., LivePage]) -> None:
    page = live(live_models.Failing, running=True, rate=None)
    with opened(page) as socket:
        until(socket, "state", lambda one: one["failed"])
        ask(socket, "set", name="breaks_at", value=10**6, track=None)
        ask(socket, "run")
        until(socket, "state", lambda one: one["running"] and one["made"] > 10)


class Interrupted(live_models.Failing):
    """A model whose code raises what is no `Exception`."""

    def _decide(self, percept: Any, rng: Any) -> tuple[float, float]:
        if self.tick >= self._breaks_at:
            raise KeyboardInterrupt
        return 0.1, 0.05


def test_a_model_that_raises_no_exception_pauses_and_can_be_reset(live: Callable[..., LivePage]) -> None:
    page = live(Interrupted, running=True, rate=None)
    with opened(page) as socket:
        state = until(socket, "state", lambda one: one["failed"])
        assert not state["running"]
        assert "failed at tick 5: KeyboardInterrupt" in state["note"]
        ask(socket, "reset")
        until(socket, "state", lambda one: one["made"] == 0 and not one["failed"])


def test_a_clock_may_stand_still_between_two_reports(live: Callable[..., LivePage], monkeypatch: pytest.MonkeyPatch) -> None:
    """That of Windows does so for 16 ms."""
    page = live(running=True)
    with opened(page) as socket:
        until(socket, "state", lambda one: one["made"] > 0)
        now = time.monotonic()
        monkeypatch.setattr(session, "time", SimpleNamespace(monotonic=lambda: now))
        ask(socket, "reset")
        ask(socket, "every", value=2)
        assert until(socket, "state", lambda one: one["every"] == 2)["running"]


def test_a_rate_is_measured_before_it_is_said(live: Callable[..., LivePage], monkeypatch: pytest.MonkeyPatch) -> None:
    page = live(running=True)
    real = time.monotonic
    start = real()
    # A slow clock: twice as many steps in what it calls a second.
    monkeypatch.setattr(session, "time", SimpleNamespace(monotonic=lambda: start + (real() - start) / 2))
    with opened(page) as socket:
        seen: list[dict[str, Any]] = []
        while not seen or seen[-1]["measured"] is None:
            seen.append(until(socket, "state", lambda one: one["running"]))
        first = [one["made"] for one in seen if one["measured"] is None]
        assert first[0] <= 30 * session._MEASURED
        assert seen[-1]["made"] - first[0] >= 5
        ask(socket, "pause")
        assert until(socket, "state", lambda one: not one["running"])["measured"] is None
        ask(socket, "run")
        assert until(socket, "state", lambda one: one["running"])["measured"] is None
        until(socket, "state", lambda one: one["measured"] is not None)
        ask(socket, "reset")
        assert until(socket, "state", lambda one: one["made"] == 0 and not one["busy"])["measured"] is None


@pytest.mark.parametrize(("model", "parameters", "state", "said"), [
    (live_models.Failing, {"breaks_at": 5}, {"failed": True, "ended": False}, "The model failed at tick 5: RuntimeError"),
    (live_models.stopping, {"seed": 5}, {"failed": False, "ended": True}, "The model stopped at tick 5; Reset"),
])  # fmt: skip
def test_an_end_is_no_failure(live: Callable[..., LivePage], model: Any, parameters: Any, state: Any, said: str) -> None:
    page = live(model, parameters, running=True, rate=None)
    with opened(page) as socket:
        found = until(socket, "state", lambda one: one["note"])
        assert found["note"].startswith(said)
        assert found | state | {"running": False} == found
        ask(socket, "reset")
        found = until(socket, "state", lambda one: not one["made"])
        assert (found["failed"], found["ended"], found["running"]) == (False, False, False)


def test_what_fails_between_steps_is_no_run_any_more(live: Callable[..., LivePage], monkeypatch: pytest.MonkeyPatch) -> None:
    page = live(running=True)
    with opened(page) as socket:
        until(socket, "state", lambda one: one["running"])

        def look(track: Any, *, again: bool = False) -> bytes:
            raise RuntimeError("no light")

        monkeypatch.setattr(LiveTrack, "look", look)
        assert "RuntimeError: no light" in until(socket, "error")["message"]
    end = time.monotonic() + _PATIENCE
    while json.loads(page.session.board["state"])["running"]:
        assert time.monotonic() < end, "the page shows a run that has ended"
        time.sleep(0.01)


def test_of_two_worlds_the_one_that_failed_is_named(live: Callable[..., LivePage]) -> None:
    page = live(live_models.Failing, {"breaks_at": 90}, beside={"breaks_at": 7}, running=True, rate=None)
    with opened(page) as socket:
        said = until(socket, "state", lambda one: one["failed"])["note"]
    assert said.startswith("The world on the right failed at tick 7: RuntimeError")


def test_a_page_that_saves_is_answered_meanwhile(live: Callable[..., LivePage], monkeypatch: pytest.MonkeyPatch) -> None:
    page = live()
    made, go_on = page.session.recording, threading.Event()

    def recording() -> Any:
        assert go_on.wait(_PATIENCE)
        return made()

    monkeypatch.setattr(page.session, "recording", recording)
    with opened(page) as socket:
        ask(socket, "save")
        ask(socket, "save")
        assert "save: one is being made" in until(socket, "error")["message"]
        ask(socket, "step")
        until(socket, "state", lambda state: state["tracks"][0]["tick"] == 1)
        go_on.set()
        until(socket, "recording")
        monkeypatch.setattr(page.session, "recording", lambda: 1 / 0)
        ask(socket, "save")
        assert "save: ZeroDivisionError" in until(socket, "error")["message"]
        ask(socket, "step")
        until(socket, "state", lambda state: state["tracks"][0]["tick"] == 2)


def test_two_thousand_messages_of_nonsense(live: Callable[..., LivePage]) -> None:
    """The server stays up, goes on, and answers sense with sense."""
    page, chance = live(parameters={"robots": 2, "targets": 2}, running=True), random.Random(13)
    sent = 0
    while sent < 2_000:
        with opened(page) as socket:
            # Answers are read meanwhile, so that neither side waits for the other.
            reader = threading.Thread(target=_read_quietly, args=(socket,))
            reader.start()
            try:
                while sent < 2_000:
                    sent += 1
                    socket.send(nonsense(chance))
            except ConnectionClosed:
                # Half a character is no text, so the connection is closed.
                pass
            socket.close()
            reader.join(timeout=_PATIENCE)
            assert not reader.is_alive()
    assert page.session._thread.is_alive()
    # So many steps may wait for the first world that others are refused meanwhile.
    rest(page)
    with opened(page) as socket:
        ask(socket, "reset")
        ask(socket, "pause")
        until(socket, "state", lambda one: not one["running"])
        ask(socket, "step")
        until(socket, "state", lambda one: not one["running"] and one["made"] > 0)
    # That state may be of the world before, and the message on its way.
    end = time.monotonic() + _PATIENCE
    while not page.session.worlds.made:
        assert time.monotonic() < end, "the step was not made"
        time.sleep(0.01)


def read_all(socket: ClientConnection) -> None:
    """Read until the server closes the connection."""
    while True:
        socket.recv(timeout=_PATIENCE)


def _read_quietly(socket: ClientConnection) -> None:
    with contextlib.suppress(ConnectionClosed):
        read_all(socket)


def nonsense(chance: random.Random) -> str | bytes:
    """Return a message that is wrong, or right by chance; none that makes a world of thousands."""
    kind = chance.choice([0, 0, 0, 1, 1, 1, 2, 2, 3, 3, 3, 4, 4, 4, 5])
    if kind == 0:
        return chance.randbytes(chance.randrange(40))
    if kind == 1:
        return "".join(chr(chance.randrange(1, 0xD7FF)) for _ in range(chance.randrange(60)))
    values: list[Any] = [None, True, -1, 0, 3, 1e308, "x", "policy", "os:system", [], {}, "a" * 300, [[]], 10**30, "\0", "\ud800", 2.5]
    if kind == 2:
        return json.dumps(chance.choice(values))
    names = ["type", "name", "value", "track", "frame", "on", "extra", "__class__"]
    fields = {chance.choice(names): chance.choice(values) for _ in range(chance.randrange(5))}
    if kind > 3:
        fields["type"] = chance.choice([*KINDS, "news", "", None])
    if kind == 5 and isinstance(fields["type"], str) and fields["type"] in KINDS:
        fields = {"type": fields["type"]} | {name: chance.choice(values) for name in KINDS[fields["type"]]}
        fields |= {"name": chance.choice(["policy", "delta", "seed", "radius", "nothing"])} if "name" in fields else {}
    if fields.get("type") == "save" and chance.random() < 0.9:
        # Right ones take long.
        fields["more"] = 1
    text = json.dumps(fields)
    return text if chance.random() < 0.9 else text[: chance.randrange(len(text))]


def test_long_messages_close_the_connection(live: Callable[..., LivePage]) -> None:
    page = live()
    with opened(page) as socket, pytest.raises(ConnectionClosed):
        socket.send(" " * (MOST_BYTES + 1))
        read_all(socket)
    with opened(page) as socket:
        until(socket, "scene")


def test_requests_that_are_no_http_are_dropped(live: Callable[..., LivePage]) -> None:
    page, chance = live(), random.Random(3)
    for data in (b"", b"\r\n\r\n", b"GET / HTTP/1.1\r\n", b"POST / HTTP/1.1\r\nHost: x\r\n\r\n", chance.randbytes(3000)):
        with socket.create_connection(("127.0.0.1", port_of(page))) as raw:
            raw.sendall(data)
    assert answer(page).status == 200


def test_a_connection_that_reads_nothing_holds_nothing_up(live: Callable[..., LivePage]) -> None:
    page = live(parameters={"robots": 60, "targets": 60}, running=True, rate=None)
    with opened(page, max_queue=1, close_timeout=0.1) as silent, opened(page) as reading:
        assert silent
        for _ in range(3):
            before = until(reading, "state")["made"]
            until(reading, "state", lambda one, before=before: one["made"] > before + 100)
        client = max(page._server.clients, key=lambda one: len(one.under_way))
        assert len(client.under_way) <= 2


def test_models_that_cannot_be_watched_are_refused(live: Callable[..., LivePage]) -> None:
    for model, parameters, said in (
        (CMOMMT(), {}, "model=<CMOMMT.*: must be a class or a function"), (3, {}, "model=3: must be a class"),
        (dict, {}, "model=<class 'dict'>: must be a class"), (lambda seed=0: 3, {}, "builds 3, which is no World"), (lambda seed=0: World(Disc(3.0), seed=seed), {}, "world without agents"),
        (CMOMMT, {"seed": 1, "rng": 2}, "rng=2, seed=1: two names for one seed"), (CMOMMT, 3, "parameters=3: must be a mapping"),
        (CMOMMT, {"robot": 3}, "parameter='robot': unknown; did you mean 'robots'"), (CMOMMT, {"robots": 0}, "robots=0"),
        (live_models.hives, {"hives": 30}, "hives=30: must be at most 20"), (CMOMMT, {"seed": -1}, "-1: must be at least 0"),
        (lambda robots: CMOMMT(robots), {}, "needs a value for its parameter 'robots'"),
    ):  # fmt: skip
        with pytest.raises((TypeError, ValueError), match=said):
            live(model, parameters)
    with pytest.raises(TypeError, match="no parameter seed or rng"):
        live(lambda robots=3: CMOMMT(robots), beside={"robots": 4})
    with pytest.raises(ValueError, match="beside: has a seed"):
        live(beside={"seed": 4})
    with pytest.raises(ValueError, match="rate=0"):
        live(rate=0)


def test_a_page_whose_news_fail_is_closed_and_can_come_back(
    live: Callable[..., LivePage], monkeypatch: pytest.MonkeyPatch
) -> None:
    page = live()

    def fail(of: session.Session) -> list[str | bytes]:
        raise RuntimeError("changed size during iteration")

    with opened(page) as socket, monkeypatch.context() as patch:
        until(socket, "state")
        patch.setattr(session.Session, "history", fail)
        with opened(page) as other, pytest.raises(ConnectionClosedError, match="1011"):
            until(other, "nothing")
        # Other pages go on.
        ask(socket, "step")
        until(socket, "state", lambda state: state["tracks"][0]["tick"] == 1)
    with opened(page) as socket:
        until(socket, "state")


def test_closing_ends_its_threads(live: Callable[..., LivePage]) -> None:
    before = set(threading.enumerate())
    page = live(running=True)
    with opened(page) as socket:
        until(socket, "scene")
        page.close()
        page.close()
        with pytest.raises(ConnectionClosed):
            read_all(socket)
    end = time.monotonic() + _PATIENCE
    while set(threading.enumerate()) - before:
        assert time.monotonic() < end
        time.sleep(0.01)
    assert "closed" in repr(page)


def a_link(page: LivePage, socket: ClientConnection) -> tuple[str, list[str]]:
    """Return the link of a page when all that it has asked for is done."""
    for _ in range(2):
        ask(socket, "copy", form="link")
        copied = until(socket, "copied")
        # The server had received what was asked before.
        rest(page)
    return copied["text"], copied["said"]


def follow(page: LivePage, socket: ClientConnection, link: str, made: int) -> None:
    ask(socket, "open", link=link)
    until(socket, "state", lambda one: one["note"] == "Opened from a link." and one["made"] == made and not one["goal"])


def state_of(page: LivePage) -> list[Any]:
    """Return the bits of all worlds of a page, and their events."""
    worlds = [track.world for track in page.session.worlds.tracks]
    tables = [(world.recording.history.to_csv(), world.events.to_csv()) for world in worlds]
    return [tables, [array.tobytes() for world in worlds for group in world.groups for array in (group.position, group.heading, group.active)]]


def test_a_link_restores_what_was_done_on_another_server(live: Callable[..., LivePage]) -> None:
    page, other = live(parameters={"robots": 5, "targets": 4, "seed": 9}, beside={"awareness": "none"}), live()
    with opened(page) as socket:
        run = until(socket, "scene")["run"]
        where = {"track": 0, "both": True, "run": run}
        identity = page.session.worlds.tracks[0].world.groups[0].identity.tolist()
        ask(socket, "move", **where, body=identity[0], x=0.1, y=-0.3)
        stepped(socket, 4)
        for name, value, track in (("policy", "centroid", None), ("delta", 2, 1), ("awareness", "ring", 1), ("robot_speed", 0.21, 0)):
            ask(socket, "set", name=name, value=value, track=track)
        ask(socket, "switch", **where, body=identity[1], on=False)
        ask(socket, "add", **where, group=1, x=0.5, y=0.5)
        ask(socket, "step")
        until(socket, "state", lambda one: one["made"] == 5)
        ask(socket, "obstruct", **where, shape="circle", points=[[4.9, 0.0], [4.99, 0.0]])
        ask(socket, "remove", **{**where, "both": False, "track": 1}, body=identity[2])
        link, said = a_link(page, socket)
        assert not said
        # What the address shows is this link.
        assert json.loads(page.session.board["state"])["link"] == link
    assert [len(track.journal.entries) for track in page.session.worlds.tracks] == [6, 8]
    with opened(other) as socket:
        follow(other, socket, link, 5)
        rest(other)
        assert state_of(other) == state_of(page)
        assert a_link(other, socket) == (link, [])
        # It goes on as the other does.
        ask(socket, "step")
        until(socket, "state", lambda one: one["made"] == 6)
    page.session.worlds.run(1)
    assert state_of(other) == state_of(page)


def test_options_of_a_link_become_controls(live: Callable[..., LivePage]) -> None:
    page = live()
    with opened(page) as socket:
        follow(page, socket, "v=1&task=CMOMMT&preset=touzet2000&robots=4&policy=a-cmommt&policy.gain=2&failures=50", 0)
        assert json.loads(page.session.board["controls"])["values"][0]["preset"] == "touzet2000"
        assert json.loads(page.session.board["controls"])["values"][0]["policy.gain"] == 2
        ask(socket, "set", name="policy.gain", value=3, track=None)
        assert "failures=50.0&did=0+set+policy.gain+3" in a_link(page, socket)[0]
        assert page.session.worlds.tracks[0].world.sources[0].time_to_failure.mean == 50
        # While it runs, the link leads to the start, with the present settings.
        ask(socket, "run")
        until(socket, "state", lambda one: one["running"] and one["made"] > 0)
        link, said = a_link(page, socket)
        assert "policy.gain=3" in link
        assert "did" not in link
        assert "the link leads to their start" in said[0]
        assert "What was done to the worlds is not in the link" in said[1]


@pytest.mark.parametrize(
    ("did", "said"),
    [
        ("2+move+7+0+1+1", "group 7: there are 2 groups"), ("2+move+0+99+1+1", "body 99 of robots"), ("2+move+0+0+99+0", "inside the arena, disc (radius 5.0)"),
        ("2+remove+0+0*2+switch+0+0+0", "body 0 of robots"), ("0+obstruct+circle+0+0+4+0", "would be in an obstacle"), ("2+clear", "there are no drawn obstacles"),
        ("2+obstruct+polygon+0+0+1+1+1+0+0+1", "cross or touch"),
    ],
)  # fmt: skip
def test_what_a_link_cannot_do_is_a_sentence_and_the_page_goes_on(live: Callable[..., LivePage], did: str, said: str) -> None:
    page = live(parameters={"robots": 4})
    with opened(page) as socket:
        stepped(socket, 1)
        ask(socket, "open", link=f"v=1&task=CMOMMT&seed=3&tick=4&robots=6&did={did}")
        message = until(socket, "error")["message"]
        assert message.startswith(f"This link cannot be followed beyond tick {did[0]}: ")
        assert said in message
        rest(page)
        (track,) = page.session.worlds.tracks
        assert (len(track.world.groups[0]), track.made, page.session._goal) == (4, 0, 0)
        stepped(socket, 1)


def test_a_refused_link_is_quoted_in_short_and_what_ran_goes_on(live: Callable[..., LivePage]) -> None:
    page = live()
    with opened(page) as socket:
        follow(page, socket, "v=1&task=CMOMMT&robots=4", 0)
        assert "Opened from a link" in json.loads(page.session.board["state"])["note"]
        ask(socket, "open", link="x" * 2000)
        message = until(socket, "error")["message"]
        assert message.startswith("This link cannot be opened: it is damaged (bad query field: 'xxx")
        assert message.endswith("xxx…). The page goes on with what ran.")
        assert len(message) < 200
        rest(page)
        assert json.loads(page.session.board["state"])["note"] == ""
    assert len(page.session.worlds.tracks[0].world.robots) == 4


def test_a_task_is_listed_once_and_links_know_both_names(live: Callable[..., LivePage]) -> None:
    page = live(parameters={"robots": 4})
    with opened(page) as socket:
        assert until(socket, "state")["tasks"] == ["CMOMMT", *[name for name in TASKS if name != "cmommt"]]
        follow(page, socket, "v=1&task=cmommt&robots=3&treatment=explore", 0)
        state = json.loads(page.session.board["state"])
        assert state["task"] == "cmommt"
        assert state["tasks"] == list(TASKS)
    page = live("forage", {"robots": 4})
    with opened(page) as socket:
        assert until(socket, "state")["tasks"] == ["forage", *[name for name in TASKS if name != "forage"]]
        follow(page, socket, "v=1&task=CMOMMT&robots=3", 0)
        assert json.loads(page.session.board["state"])["tasks"] == ["forage", "CMOMMT", *[name for name in TASKS if name not in ("forage", "cmommt")]]
        # As it was given.
        ask(socket, "task", name="forage")
        until(socket, "state", lambda one: one["task"] == "forage")
    assert page.session.worlds.settings[0]["robots"] == 4


def test_errors_have_the_words_of_the_page(live: Callable[..., LivePage]) -> None:
    page = live(parameters={"robots": 3, "targets": 3})
    world = page.session.worlds.tracks[0].world
    (x, y), body = world.robots.position[0].tolist(), world.robots[0].unique_id
    where = {"track": 0, "both": True, "run": page.session._run}
    wrong = [
        ("move", {**where, "body": body, "x": 4.9, "y": 4.9}, "position (4.9, 4.9): must be two finite numbers inside the arena, disc (radius 5.0)"),
        ("remove", {**where, "body": 10**6}, "body 1000000: is not in the world any more"),
        ("obstruct", {**where, "shape": "circle", "points": [[x, y], [x + 0.1, y]]}, "arena: Robot 1 of 'robots' at ("),
        ("obstruct", {**where, "shape": "circle", "points": [[0, 0], [0, 0]]}, "radius 0.0: must be"),
        ("clear", {**where, "track": 1}, "track 1: there is one world only; compare first"),
        ("reel", {"run": page.session._run, "first": -1, "last": None}, "first -1: must be at least 0"),
        ("open", {"link": "v=1&task=CMOMMT&target_policy=x"}, "This link cannot be opened: policy of targets 'x': unknown"),
        ("set", {"name": "policy", "value": "b-cmommt", "track": None}, "use awareness 'shared'"),
    ]  # fmt: skip
    labels = page.session.labels
    assert (labels["robot_speed"], labels["delta"], labels["sensing_range"]) == ("speed of robots", "δ", "sensing range")
    wrong += [
        ("set", {"name": name, "value": [], "track": None}, f"{labels[name]} []: ") for name in page.session._controls
    ]
    with opened(page) as socket:
        for kind, fields, said in wrong:
            ask(socket, kind, **fields)
            message = until(socket, "error")["message"]
            assert said in message
            assert not re.search(r"\w=|\w\(\w|--", message), message
