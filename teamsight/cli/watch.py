"""``teamsight watch``: serve a live page of a model."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, cast

from teamsight.cli import limits
from teamsight.cli.options import flag
from teamsight.cli.world_settings import WorldOptions
from teamsight.core import checks
from teamsight.core.component import Allowed, Flag


@dataclass(frozen=True, kw_only=True)
class WatchSettings(WorldOptions):
    """Options of ``teamsight watch``.

    Parameters
    ----------
    model : str, optional
        A class or function of your own that builds a world. Its numbers, truth values and choices become controls.
    beside : mapping of str to object
        A parameter in which a second world differs, which runs beside the first with the same seed. May be given
        several times.
    rate : float
        Steps a second; the page can change it.
    every : int
        Steps from one drawn frame to the next, at least.
    paused : bool
        Wait for Run.
    port : int
        Port; 0 for any that is free.
    host : str
        Address at which to listen. Others than loopback need --token.
    token : str, optional
        A word that the address of the page must carry; an empty one ('') for a new one.
    no_browser : bool
        Do not open the page in a browser; print its address only.
    """

    model: Annotated[str | None, Allowed(metavar="MODULE:NAME", shown="CMOMMT")] = None
    beside: Mapping[str, Any] = field(default_factory=dict)
    rate: Annotated[float, Allowed(least=0.1, most=10_000)] = 30.0
    every: Annotated[int, Allowed(least=1, most=10_000)] = 1
    paused: Flag = False
    port: Annotated[int, Allowed(least=0, most=65_535)] = 8713
    host: str = "127.0.0.1"
    token: Annotated[str | None, Allowed(shown="none")] = None
    no_browser: Flag = False

    def check(self) -> None:
        """Refuse settings that do not go together, and worlds that are too large."""
        if not self.beside:
            limits.check_sectors(self)
        limits.check_failures(self.failures, self.repair, self.robots)
        limits.check_worlds(
            self.robots, self.targets, self.radius, 1, awareness_range=self.awareness_range,
            degrees=(str(self.awareness),),
        )  # fmt: skip
        # Of a model of one's own, --set gives the parameters.
        self.check_task(("treatment",), others=("model", "failures", "repair"))
        if self.model or self.task:
            return
        for name in self.set:
            if name in self.options():
                raise ValueError(f"set={name}=…: is an option of its own; give --{flag(name)}")
        _check_limits({name: getattr(self, name) for name in self.given & self.world_options()} | dict(self.set))
        _check_limits(self.beside)


def _check_limits(parameters: Mapping[str, Any]) -> None:
    """Refuse numbers that the page refuses too."""
    from teamsight.agents.cmommt import CMOMMT
    from teamsight.live.controls import controls_of

    for control in controls_of(CMOMMT, {}):
        value = parameters.get(control.name)
        if control.kind in ("integer", "number") and isinstance(value, (int, float)):
            try:
                control.checked(value)
            except ValueError as error:
                raise ValueError(f"{error}, as on the page; teamsight run takes others and draws nothing") from None


def watch(settings: WatchSettings) -> None:
    """Show a running world in the browser, with controls.

    \b
    Examples:
      teamsight watch
      teamsight watch --robots 30 --awareness ring --delta 8
      teamsight watch --policy a-cmommt --beside policy=centroid
      teamsight watch --failures 500 --repair 50
      teamsight watch --model my_package.my_module:MyWorld --set hives=3
      teamsight watch --task cmommt --beside treatment=explore
      teamsight watch --port 0 --no-browser
    """
    from teamsight.live import watch as serve

    parameters = settings.parameters if settings.task else {**settings.world(), **settings.set}
    if settings.treatment is not None:
        parameters["treatment"] = settings.treatment
    if (failures := settings.source_of_failures()) is not None:
        parameters["events"] = failures
    page = serve(
        settings.task or _model(settings.model), {**parameters, **_seed(settings)},
        beside=settings.beside or None, rate=settings.rate, every=settings.every, running=not settings.paused,
        host=settings.host, port=settings.port, token=settings.token, browser=False, wait=False,
    )  # fmt: skip
    _show(page, settings)


def _model(reference: str | None) -> Any:
    """Return what builds the world."""
    if reference is None:
        from teamsight.agents.cmommt import CMOMMT

        return CMOMMT
    from teamsight.core import references

    references.search_in([os.getcwd()])
    found = references.load(reference, "model", place="start in the folder of its file")
    if not callable(found):
        raise TypeError(f"model={checks.shown(reference)}: is {checks.shown(found)}; give a class or a function")
    return cast(Callable[..., Any], found)


def _seed(settings: WatchSettings) -> dict[str, int]:
    """Return the seed under its name; a model without one has no such parameter."""
    if settings.task:
        return {"rng": settings.seed}
    return {"seed": settings.seed} if settings.model is None or "seed" in settings.given else {}


def _show(page: Any, settings: WatchSettings) -> None:
    """Print the address, open the browser, and wait for Ctrl-C."""
    from teamsight.cli.show import say
    from teamsight.core import browsers

    with page:
        say(f"{page.url}")
        is_open = not settings.no_browser and browsers.show(page.url)
        say("open in the browser; Ctrl-C ends" if is_open else "open this address in a browser; Ctrl-C ends")
        page.wait()
