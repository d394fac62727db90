"""``teamsight watch``: serve a live page of a model."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any, cast

from teamsight.cli import limits, task_options, values
from teamsight.cli.world_settings import WorldSettings, source_of_failures
from teamsight.core import checks

# Options that are parameters of the model.
_MODEL = ("robots", "targets", "radius", "policy", "awareness", "delta", "awareness_range", "preset")


class WatchSettings(WorldSettings):
    """Settings of ``teamsight watch``."""

    model: str | None = values.text(
        "A class or function of your own that builds a world. Its numbers, truth values and choices become controls.",
        "CMOMMT", metavar="MODULE:NAME",
    )  # fmt: skip
    task: str | None = task_options.task("A task in place of CMOMMT: {names}. Its team is a control.")
    set: dict[str, Any] = values.assignments("Another parameter of the model. May be given several times.")
    beside: dict[str, Any] = values.assignments(
        "A parameter in which a second world differs, which runs beside the first with the same seed. May be given "
        "several times."
    )
    rate: float = values.number(30.0, "Steps a second; the page can change it.", least=0.1, most=10_000)
    every: int = values.count(1, "Steps from one drawn frame to the next, at least.", most=10_000)
    paused: bool = values.flag("Wait for Run.")
    port: int = values.count(8713, "Port; 0 for any that is free.", least=0, most=65_535)
    host: str = values.word_option("127.0.0.1", "Address at which to listen. Others than loopback need --token.")
    token: str | None = values.text(
        "A word that the address of the page must carry; an empty one ('') for a new one.", "none"
    )
    no_browser: bool = values.flag("Do not open the page in a browser; print its address only.")

    def check(self) -> None:
        """Refuse settings that do not go together, and worlds that are too large."""
        if not self.beside:
            limits.check_sectors(self)
        limits.check_failures(self.failures, self.repair, self.robots)
        limits.check_worlds(
            self.robots, self.targets, self.radius, 1, awareness_range=self.awareness_range, degrees=(self.awareness,)
        )
        if self.task:
            task_options.check(self, (*_MODEL, "model", "failures", "repair"))
        if self.model or self.task:
            return
        for name in set(self.set) & {*_MODEL, "seed"}:
            raise ValueError(f"set={name}=…: is an option of its own; give --{name.replace('_', '-')}")
        _check_limits({name: getattr(self, name) for name in _MODEL if name in self.given} | self.set)
        _check_limits(self.beside)


def _check_limits(parameters: dict[str, Any]) -> None:
    """Refuse numbers that the page refuses too."""
    from teamsight.agents.cmommt import CMOMMT
    from teamsight.live.cmommt_controls import controls_for

    for control in controls_for(CMOMMT, {}):
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

    parameters = {name: getattr(settings, name) for name in _MODEL if name in settings.given}
    if (failures := source_of_failures(settings)) is not None:
        parameters["events"] = failures
    page = serve(
        settings.task or _model(settings.model), {**parameters, **settings.set, **_seed(settings)},
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
