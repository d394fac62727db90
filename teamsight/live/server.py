"""The server: the page by HTTP, and a socket for each page, in a thread of its own."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import errno
import logging
import socket
import threading
from collections.abc import Callable, Iterator
from functools import partial
from html import escape
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from teamsight.core import checks
from teamsight.core.extras import extra
from teamsight.live import protocol
from teamsight.live.recorded import ASSETS, Desk
from teamsight.live.security import Access
from teamsight.live.session import Session
from teamsight.view.page import asset, digest

if TYPE_CHECKING:
    from websockets.asyncio.server import Server as SocketServer
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

#: Pages at once.
MOST_CLIENTS = 32
#: Frames that a page has been sent and has not acknowledged.
MOST_UNDER_WAY = 2
# Kinds of messages on the board, in the order in which pages need them.
_SHOWN = ("scene", "state", "events", "controls", "band", "error", "frame")
# Browsers send data that is no HTTP, close while they are answered, and so on; a user can do nothing about it.
_LOGGER = logging.getLogger("teamsight.live")
_LOGGER.addHandler(logging.NullHandler())
_LOGGER.propagate = False

_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{title}</title>
<link rel="icon" href="data:,">
{styles}
</head>
<body>
<main id="teamsight"></main>
{scripts}
</body>
</html>
"""
# Those of worlds and of recorded robots.
_SOCKETS = ("/socket", "/recorded-socket")
# Headers of all answers.
_SAFE = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}


class Client:
    """A connection: what its page has been sent of a board, and how many frames are on their way to it.

    Parameters
    ----------
    board : dict of str to object
        See `Session`.

    Attributes
    ----------
    news : asyncio.Event
        Set it to let the client look at the board again.
    under_way : list of int
        The numbers of frames that the page has not acknowledged.
    cancelled : threading.Event
        Set it to end the film that is being made for the page.
    """

    def __init__(self, board: dict[str, Any]) -> None:
        self._board = board
        # An error that is there already was made by somebody else, perhaps long ago.
        self._seen: dict[str, Any] = {"error": board.get("error")}
        self.under_way: list[int] = []
        self.cancelled = threading.Event()
        self.news = asyncio.Event()
        self.news.set()

    def acknowledge(self, number: int) -> None:
        """Note that the page has drawn a frame, and all before it."""
        self.under_way = [other for other in self.under_way if other > number]
        self.news.set()

    async def messages(self) -> list[str | bytes]:
        """Wait for messages that the page has not had, and return them."""
        while True:
            await self.news.wait()
            self.news.clear()
            if found := list(self._unseen(dict(self._board))):
                return found

    def _unseen(self, board: dict[str, Any]) -> Iterator[str | bytes]:
        for kind in _SHOWN:
            shown: Any = board.get(kind)
            is_frame = kind == "frame" and shown is not None
            if shown is self._seen.get(kind) or (
                is_frame and (shown.scenes is not self._seen.get("scene") or len(self.under_way) >= MOST_UNDER_WAY)
            ):
                continue
            self._seen[kind] = shown
            if is_frame:
                self.under_way.append(shown.number)
            yield from shown.messages if is_frame else shown if kind == "scene" else (shown,)


class Server:
    """Serves the page of a session, and that of recorded robots, until it is closed.

    Parameters
    ----------
    session : Session or None
        The worlds; None for the page of recorded robots alone.
    access : Access
        The address, and what requests must have.
    port : int
        The port; 0 for any that is free.
    title : str
        The title of the page.
    desk : Desk, optional
        What answers the page of recorded robots.

    Attributes
    ----------
    port : int
        The port.

    Raises
    ------
    ModuleNotFoundError
        If ``websockets`` is not installed.
    ValueError
        If the port is in use, or the address is none of this computer.
    """

    def __init__(
        self, session: Session | None, access: Access, port: int, title: str, desk: Desk | None = None
    ) -> None:
        self._websockets = extra("websockets", "the live page", "live")
        import websockets.asyncio.server  # noqa: F401
        self._session, self._access, self._title, self._desk = session, access, title, desk or Desk()
        self.port = port
        self.clients: set[Client] = set()
        # What is being made for pages, by the message that asked for it.
        self._making: dict[str, asyncio.Task[None]] = {}
        self._failure: Exception | None = None
        self._ready = threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve()), name="teamsight page", daemon=True)
        self._thread.start()
        self._ready.wait()
        if self._failure is not None:
            raise self._named(self._failure)

    @property
    def url(self) -> str:
        """The address of the page."""
        host = self._access.host
        if host in ("0.0.0.0", "::"):
            host = socket.gethostname()
        name = f"[{host}]" if ":" in host else host
        token = f"?token={self._access.token}" if self._access.token else ""
        return f"http://{name}:{self.port}/{token}"

    def is_alive(self) -> bool:
        """Return whether the page is being served."""
        return self._thread.is_alive()

    def close(self) -> None:
        """Close all connections and free the port. Idempotent."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._stopped.set)
            self._thread.join(timeout=10)

    def _named(self, error: Exception) -> Exception:
        """Return an error of the socket with its cure."""
        if not isinstance(error, OSError):
            return error
        if error.errno in (errno.EADDRINUSE, errno.EACCES, errno.EPERM):
            is_used = error.errno == errno.EADDRINUSE
            why = "is in use by another program" if is_used else "may not be used by this user"
            return ValueError(f"port={self.port}: {why}; give another, or 0 for any that is free (--port 0)")
        shown = checks.shown(self._access.host)
        return ValueError(f"host={shown}: is no address of this computer ({error.strerror or error})")

    async def _serve(self) -> None:
        self._loop, self._stopped = asyncio.get_running_loop(), asyncio.Event()
        try:
            server: SocketServer = await self._websockets.asyncio.server.serve(
                self._connection, self._access.address, self.port, process_request=self._answer, compression=None,
                max_size=protocol.MOST_BYTES, max_queue=8, write_limit=2**16, close_timeout=2, logger=_LOGGER,
                server_header=None,
            )  # fmt: skip
        except Exception as error:  # raised again by the thread that has started this one
            self._failure = error
            self._ready.set()
            return
        self.port = int(next(iter(server.sockets)).getsockname()[1])
        if self._session is not None:
            self._session.on_news = lambda: self._loop.call_soon_threadsafe(self._wake)
        self._ready.set()
        await self._stopped.wait()
        if self._session is not None:
            self._session.on_news = lambda: None
        self._desk.close()
        server.close()
        await server.wait_closed()

    def _wake(self) -> None:
        for client in self.clients:
            client.news.set()

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Return the answer to a request; None lets it open a socket."""
        host, origin, site = map(request.headers.get, ("Host", "Origin", "Sec-Fetch-Site"))
        path, is_socket = urlsplit(request.path).path, "Upgrade" in request.headers
        refusal = self._access.refusal(request.path, host, origin, site, is_socket=is_socket)
        if refusal:
            return _plain(connection, 403, f"Refused: {refusal}.\n")
        if is_socket:
            if path not in _SOCKETS[self._session is None :]:
                return _plain(connection, 404, "There is no such socket.\n")
            pages = len(self.clients) + self._desk.pages
            return _plain(connection, 503, "Too many pages.\n") if pages >= MOST_CLIENTS else None
        if path not in ("/", "/recorded"):
            return _plain(connection, 404, "There are only the pages / and /recorded\n")
        is_live = path == "/" and self._session is not None
        own = [("live", "css"), ("recorded", "css"), *[("live", "js")] * is_live, ("recorded", "js")]
        styles, scripts = (
            [asset(f"view.{kind}"), *(asset(f"{name}.{kind}", ASSETS) for name, one in own if one == kind)]
            for kind in ("css", "js")
        )
        title = self._title if path == "/" else "teamsight: recorded robots"
        response = _plain(connection, 200, _PAGE.format(
            title=escape(title), styles="\n".join(f"<style>{one}</style>" for one in styles),
            scripts="\n".join(f"<script>{one}</script>" for one in scripts),
        ))  # fmt: skip
        del response.headers["Content-Type"]
        response.headers["Content-Type"] = "text/html; charset=utf-8"
        # Only its own scripts and styles, and only its own socket.
        known = [" ".join(map(digest, each)) for each in (scripts, styles)]
        response.headers["Content-Security-Policy"] = (
            f"default-src 'none'; script-src {known[0]}; style-src {known[1]}; "
            f"img-src data: blob:; connect-src ws://{host} wss://{host}; base-uri 'none'; form-action 'none'; "
            "frame-ancestors 'none'"
        )
        return response

    async def _connection(self, connection: ServerConnection) -> None:
        path = urlsplit(connection.request.path).path if connection.request else ""
        with contextlib.suppress(self._websockets.exceptions.ConnectionClosed):
            if self._session is None or path == _SOCKETS[1]:
                await self._desk.serve(connection)
            else:
                await self._show(connection, self._session)

    async def _show(self, connection: ServerConnection, session: Session) -> None:
        """Show a page the worlds, and let them do what it asks for."""
        client = Client(session.board)
        self.clients.add(client)
        session.watched_by(len(self.clients))
        sender = asyncio.create_task(self._send_news(connection, client, session))
        try:
            await self._receive(connection, client, session)
        finally:
            sender.cancel()
            self.clients.discard(client)
            session.watched_by(len(self.clients))

    async def _send_news(self, connection: ServerConnection, client: Client, session: Session) -> None:
        try:
            for message in await asyncio.to_thread(session.history):
                await connection.send(message)
            while True:
                for message in await client.messages():
                    await connection.send(message)
        except self._websockets.exceptions.ConnectionClosed:
            pass
        except Exception:
            # A page without news would wait for ever; one whose connection ends tries again.
            _LOGGER.exception("a page could not be sent its news")
            await connection.close(1011)

    async def _receive(self, connection: ServerConnection, client: Client, session: Session) -> None:
        async for data in connection:
            try:
                message = protocol.parsed(data)
                if message.type == "ack":
                    client.acknowledge(message.fields["frame"])
                elif message.type == "save":
                    self._begin("save", connection, partial(_recording, session))
                elif message.type == "reel":
                    await connection.send(protocol.text("reel", **session.reel(**message.fields)))
                elif message.type == "film":
                    cancelled = threading.Event()
                    self._begin("film", connection, partial(self._film, connection, session, cancelled, message.fields))
                    client.cancelled = cancelled
                elif message.type == "cancel":
                    client.cancelled.set()
                elif message.type == "copy":
                    form = message.fields["form"]
                    text, said = session.copied(form)
                    await connection.send(protocol.text("copied", form=form, text=text, said=said))
                else:
                    session.ask(message)
            except (TypeError, ValueError) as error:
                await connection.send(protocol.refusal(error, session.labels))

    def _begin(self, kind: str, connection: ServerConnection, make: Callable[[], str]) -> None:
        """Let the answer to a message be made, which takes time; one of a kind at a time.

        Raises
        ------
        ValueError
            If one is being made.
        """
        if kind in self._making and not self._making[kind].done():
            raise ValueError(f"{kind}: one is being made; wait for it")
        # Beside the messages of the page, which would otherwise get no frames meanwhile, and could not pause.
        self._making[kind] = asyncio.create_task(self._make(kind, connection, make))

    async def _make(self, kind: str, connection: ServerConnection, make: Callable[[], str]) -> None:
        """Send what `make` returns, or why there is none."""
        try:
            answer = await asyncio.to_thread(make)
        except Exception as error:  # whatever the texts of a model contain
            answer = protocol.refusal(error, kind=f"{kind}: ")
        with contextlib.suppress(self._websockets.exceptions.ConnectionClosed):
            await connection.send(answer)

    def _film(
        self, connection: ServerConnection, session: Session, cancelled: threading.Event, ticks: dict[str, Any]
    ) -> str:
        """Return the message with the film, after those that say how far it is; for another thread."""

        def report(done: int, frames: int) -> None:
            if cancelled.is_set():
                raise _CancelledError
            # Raises when the page is closed: nobody wants the film then.
            message = protocol.text("filming", done=done, frames=frames)
            asyncio.run_coroutine_threadsafe(connection.send(message), self._loop).result()

        try:
            name, content = session.film(report, **ticks)
        except _CancelledError:
            return protocol.text("cancelled")
        return protocol.text("film", name=name, content=base64.b64encode(content).decode())


class _CancelledError(Exception):
    """Nobody wants the film any more."""


def _recording(session: Session) -> str:
    name, html = session.recording()
    return protocol.text("recording", name=name, html=html)


def _plain(connection: ServerConnection, status: int, text: str) -> Response:
    response = connection.respond(status, text)
    for name, value in _SAFE.items():
        response.headers[name] = value
    return response
