"""`watch`: a live page of a model."""

from __future__ import annotations

import builtins
import inspect
import os
import sys
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from typing import Any, Self

from teamsight.agents.cmommt import CMOMMT
from teamsight.agents.world import World
from teamsight.core import browsers, checks
from teamsight.core.component import Declared, declared, of_name
from teamsight.core.references import is_reference
from teamsight.core.status_line import StatusLine, has_reader
from teamsight.live import protocol
from teamsight.live.controls import SEEDS, Control, check_parameters, controls_of, model_name, seed_name
from teamsight.live.recorded import Choice, Desk, read_recorded
from teamsight.live.security import access_to
from teamsight.live.server import Server
from teamsight.live.session import SEED, Making, Session
from teamsight.live.worlds import Worlds
from teamsight.tasks.model import TaskModel
from teamsight.tasks.named import task_of
from teamsight.tasks.registry import TASKS
from teamsight.tasks.task import Task

#: The port, unless another one is given.
PORT = 8713
_MOST_PORT = 65_535


class LivePage:
    """A live page that is being served; made by `watch`. It ends with the program, or with `close`.

    Attributes
    ----------
    url : str
        The address of the page.
    session : Session or None
        The worlds behind it; None if it shows recorded robots.
    """

    def __init__(self, session: Session | None, server: Server) -> None:
        self.session, self._server = session, server
        self.url = server.url
        self._closed = threading.Event()

    def wait(self) -> None:
        """Wait until the page is closed, or Ctrl-C is pressed, which closes it too; meanwhile say what is compiled.

        Raises
        ------
        Exception
            That of the model, if its first world cannot be built.
        """
        line, said = StatusLine() if has_reader() else None, ""
        try:
            # Without a timeout, Ctrl-C would not be noticed on Windows.
            while not self._closed.wait(0.5) and self._server.is_alive():
                if self.session is None:
                    continue
                if self.session.failure is not None:
                    break
                before, said = said, self.session.said
                if line is None:
                    if said and not before:
                        print(f"teamsight: {said}", file=sys.stderr)
                elif said:
                    line.show(f"teamsight: {said}")
                else:
                    line.close()
        except KeyboardInterrupt:
            # The usual way to end it, and no error.
            pass
        finally:
            if line is not None:
                line.close()
            self.close()
        if self.session is not None and self.session.failure is not None:
            raise self.session.failure

    def close(self) -> None:
        """Stop the worlds and the server. Idempotent."""
        self._server.close()
        if self.session is not None:
            self.session.close()
        self._closed.set()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _repr_html_(self) -> str:
        return f'<a href="{self.url}" target="_blank" rel="noopener">{self.url}</a>'

    def __repr__(self) -> str:
        return f"<LivePage: {self.url}{', closed' if self._closed.is_set() else ''}>"


def watch(
    model: Callable[..., World] | Task | str = CMOMMT,
    parameters: Mapping[str, Any] | None = None,
    *,
    beside: Mapping[str, Any] | None = None,
    rate: float | None = 30.0,
    every: int = 1,
    running: bool = True,
    host: str = "127.0.0.1",
    port: int = PORT,
    token: str | None = None,
    browser: bool = True,
    wait: bool | None = None,
    row: Callable[[str], tuple[Callable[..., World], Mapping[str, Any]]] | None = None,
) -> LivePage:
    """Serve a live page of a model, and open it in the browser.

    Parameters
    ----------
    model : callable, Task or str
        `CMOMMT`, another class of worlds, a function that builds a world, or a task or its name. Its numbers, truth
        values and choices become controls; a task also has one for its team.
    parameters : mapping of str to object, optional
        Arguments of the model, the seed included; by default seed 0.
    beside : mapping of str to object, optional
        Parameters in which a second world differs, which runs beside the first with the same seed.
    rate : float or None
        Steps a second; None for as many as possible.
    every : int
        Steps from one drawn frame to the next, at least.
    running : bool
        Whether it runs at once.
    host : str
        The address to listen at; by default only this computer reaches it. Any other needs a token.
    port : int
        The port; 0 for any that is free.
    token : str, optional
        A word that the address of the page must carry; an empty text for a new one.
    browser : bool
        Whether to open the page in the browser.
    wait : bool, optional
        Whether to return only after Ctrl-C; by default so in scripts, and not in notebooks and interactive sessions.
    row : callable, optional
        Called with the id of a run that somebody enters on the page, it returns a model and its parameters, with the
        seed; it must refuse what is no id. `teamsight watch --study` gives one.

    Returns
    -------
    LivePage
        With its `url`; `LivePage.close` ends it.

    Raises
    ------
    ModuleNotFoundError
        If the package ``websockets`` is not installed.
    TypeError, ValueError
        If the model refuses its parameters, the port is in use, or the address needs a token.
    """
    if isinstance(model, (Task, str)):
        model = TaskModel(task_of(model))
    try:
        inspect.signature(model)
    except (TypeError, ValueError):
        raise TypeError(
            f"model={checks.shown(model)}: must be a class or a function that builds a world, so that the page can "
            "start again; give the class, and what it is built with as parameters"
        ) from None
    for called, values in (("parameters", parameters), ("beside", beside)):
        if values is not None and not isinstance(values, Mapping):
            raise TypeError(f"{called}={checks.shown(values)}: must be a mapping, as in {{'robots': 5}}")
    access = access_to(host, token)
    checks.count("port", port, least=0, most=_MOST_PORT)
    speed = None if rate is None else checks.number("rate", rate, least=protocol.LEAST_RATE, most=protocol.MOST_RATE)
    worlds, controls = worlds_of(model, dict(parameters or {}), beside)
    worlds.every = checks.count("every", every, most=protocol.MOST_EVERY)
    made = None if row is None else partial(_worlds_of_row, row)
    # A link may name the class, whatever this page was started with.
    tasks: dict[str, Making] = {CMOMMT.__name__: _worlds_of_class}
    tasks |= {name: partial(_worlds_of_task, name) for name in TASKS}
    session = Session(
        worlds, controls, rate=speed, running=checks.flag("running", running), tasks=tasks, row=made
    )  # fmt: skip
    try:
        # The page is there at once where something has to be compiled.
        session.begun.wait()
        if session.failure is not None:
            raise session.failure
        page = LivePage(session, Server(session, access, port, f"teamsight: {model_name(model)}"))
    except BaseException:
        session.close()
        raise
    return _opened(page, browser, wait)


def _opened(page: LivePage, browser: bool, wait: bool | None) -> LivePage:
    """Open a page in the browser, and wait for its end, as the two ask."""
    if browser:
        browsers.show(page.url)
    is_interactive = hasattr(sys, "ps1") or bool(sys.flags.interactive) or hasattr(builtins, "get_ipython")
    if not is_interactive if wait is None else wait:
        with page, suppress(KeyboardInterrupt):
            print(f"{page.url}  (Ctrl-C ends)", flush=True)
            page.wait()
    return page


def watch_trajectories(
    path: str | os.PathLike[str] | None = None,
    awareness_range: float | None = None,
    *,
    range_shape: str = "disc",
    risk: float = 0.01,
    window: float | None = None,
    sort: bool = False,
    host: str = "127.0.0.1",
    port: int = PORT,
    token: str | None = None,
    browser: bool = True,
    wait: bool | None = None,
    progress: Callable[[str, float, float], None] = lambda phase, done, total: None,
) -> LivePage:
    """Serve a page that plays recorded robots, and shows δ for a risk; it takes further files.

    Parameters
    ----------
    path : path, optional
        The file that it shows at first; see `teamsight.analysis.delta.read_trajectories`. Without one it waits for a
        CSV file that is dropped on it.
    awareness_range : float, optional
        Distance within which two robots are neighbours [length]; the page can change it, and begins with a guess.
    range_shape, risk, window
        As for `teamsight.analysis.delta.delta_from_trajectories`; the page can change them.
    sort : bool
        Sort the rows of each robot by time instead of raising an error if times decrease.
    host, port, token, browser, wait
        As for `watch`.
    progress : callable
        Called with "reading" or "counting", and with how much of it is done and how much there is.

    Returns
    -------
    LivePage
        With its `url`; `LivePage.close` ends it.

    Raises
    ------
    ModuleNotFoundError
        If the package ``websockets`` is not installed.
    TypeError, ValueError
        If the file cannot be read, a number is outside its limits, the port is in use, or the address needs a token.
    """
    access = access_to(host, token)
    checks.count("port", port, least=0, most=_MOST_PORT)
    choice = Choice.of(awareness_range=awareness_range, range_shape=range_shape, risk=risk, window=window)
    team = None if path is None else read_recorded(path, sort=sort, progress=partial(progress, "reading"))
    if team is not None:
        # What is wrong is said here rather than on a page.
        team.report(choice, partial(progress, "counting"))
    title = "teamsight: recorded robots" if team is None else f"teamsight: {team.name}"
    return _opened(LivePage(None, Server(None, access, port, title, Desk(team, choice))), browser, wait)


def _worlds_of_task(name: str, seed: int) -> tuple[Worlds, dict[str, Control]]:
    """Return the worlds of a task of our own; its team explores where one with skill would have to learn first."""
    task = task_of(name)
    treatment = {"treatment": "explore"} if callable(task.skilled) else {}
    return worlds_of(TaskModel(task), {**treatment, "rng": seed}, None)


def _worlds_of_class(seed: int) -> tuple[Worlds, dict[str, Control]]:
    return worlds_of(CMOMMT, {"rng": seed}, None)


def _worlds_of_row(row: Callable[[str], Any], run: str) -> tuple[Worlds, dict[str, Control]]:
    """Return the world of a run of a study, and its controls."""
    model, parameters = row(run)
    return worlds_of(model, dict(parameters), None)


def worlds_of(
    model: Callable[..., World], parameters: dict[str, Any], beside: Mapping[str, Any] | None
) -> tuple[Worlds, dict[str, Control]]:
    """Return the worlds of a page and its controls.

    Parameters
    ----------
    model, parameters, beside
        As for `watch`.
    """
    given = {name: parameters.pop(name) for name in SEEDS if name in parameters}
    seed = checks.seed(given.get("rng"), given.get("seed")) if given else 0
    name = seed_name(model)
    if name is None and (given or beside is not None):
        raise TypeError(
            f"{model_name(model)}: has no parameter seed or rng, so two worlds would not meet the same noise; give it "
            "one, and pass it on to the World"
        )
    for called, one in declared(model).items():
        if one.kind == "component" and is_reference(value := parameters.get(called, "")):
            # As an object it has controls of its own.
            options = parameters.pop(f"{called}_options", {})
            parameters[called] = of_name(one, value)(**options)
    both = [parameters]
    if beside is not None:
        if any(one in beside for one in SEEDS):
            raise ValueError("beside: has a seed; both worlds run on that of the parameters, leave it out")
        both.append({**parameters, **beside})
    for values in both:
        check_parameters(model, values)
        for called, one in declared(model).items():
            if one.kind == "choice" and isinstance(values.get(called), str):
                # From a command line a member of an Enum comes as its name.
                values[called] = one.checked(values[called])
    found = controls_of(model, parameters)
    if name is not None:
        digits = Declared(SEED, "integer", 0, meaning="All random numbers follow from it.")
        found.append(Control(digits, "digits", "World", 0, checks.MOST_SEED))
    return Worlds(model, both, seed), {one.name: one for one in found}
