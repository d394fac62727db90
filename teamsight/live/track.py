"""One of the worlds on a page: its settings, its frames and what it says."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

from teamsight.agents.awareness.registry import AWARENESS, awareness_named
from teamsight.agents.cmommt import CMOMMT
from teamsight.agents.engine.engine import kernels_needed
from teamsight.agents.world import World
from teamsight.core import checks
from teamsight.core.component import Component, declared
from teamsight.live.controls import model_name, seed_name, value_of
from teamsight.live.event_rows import event_rows
from teamsight.live.kept import Kept
from teamsight.live.observer import Observer
from teamsight.view.packing import from_raw, raw
from teamsight.view.scene import Frame, Scene

_DEGREE = ("awareness", "delta")


class LiveTrack:
    """A world that runs, and can be built again.

    Parameters
    ----------
    model : callable
        A class or function that builds a world.
    parameters : mapping of str to object
        Its arguments, without the seed.
    seed : int
        The seed.
    every : int
        Ticks from one frame to the next.
    others : iterable of World
        Worlds that the model has built before, and must not return again.

    Attributes
    ----------
    kept : Kept
        The newest frames.
    made : int
        The number of steps since the world was built.

    Raises
    ------
    TypeError, ValueError
        If the model refuses its arguments, or does not build a new world.
    """

    def __init__(
        self, model: Callable[..., World], parameters: Mapping[str, Any], seed: int, every: int,
        others: Iterable[World] = (),
    ) -> None:  # fmt: skip
        self._model, self.parameters = model, dict(parameters)
        self.world = _built(model, self.parameters, seed)
        if any(self.world is other for other in others):
            raise ValueError(f"{model_name(model)}: returns a world that it returned before; build one on each call")
        self.made = 0
        self.kept = Kept()
        self._observer = Observer(self.world, every)
        # Held while the scene and the frames change together.
        self._lock = threading.Lock()

    def compile(self) -> None:
        """Compile what steps and frames need; another world with these settings then finds it."""
        self._observer.frame()
        for entry in kernels_needed(self.world._data)():
            _ = entry.address

    @property
    def scene(self) -> Scene:
        """The scene of the newest frame."""
        return self._observer.present

    def recorded(self) -> tuple[Scene, list[Frame]]:
        """Return the scene and the frames that are kept; other threads may call it."""
        scene, blocks = self.newest()
        return scene, [from_raw(block, scene) for block in blocks]

    def newest(self, most: int | None = None) -> tuple[Scene, list[bytes]]:
        """Return the scene and the frames that are kept as raw blocks, or the newest of them; for other threads too."""
        with self._lock:
            return self.scene, self.kept.blocks(most)

    def draw_every(self, every: int) -> None:
        """Change what the scene says about the ticks from one frame to the next."""
        with self._lock:
            self._observer.shown_every = every
            self._observer.changed()

    def entitle(self, title: str | None) -> None:
        """Change the title of the scene; None for its own."""
        if title != self._observer.title:
            with self._lock:
                self._observer.title = title
                self._observer.changed()

    def value(self, name: str) -> Any:
        """Return the value of a parameter."""
        base, _, option = name.partition(".")
        value = self.parameters[base] if base in self.parameters else value_of(self._model, base)
        return getattr(value, option, None) if option else value

    def with_value(self, name: str, value: Any) -> dict[str, Any]:
        """Return the arguments with another value of a parameter, or of a setting of a component: ``policy.gain``.

        Raises
        ------
        ValueError
            If the component is another one now.
        """
        base, _, option = name.partition(".")
        if option:
            component = self.value(base)
            if not isinstance(component, Component) or option not in declared(type(component)):
                shown = checks.shown(component)
                raise ValueError(f"{name}: {base} is {shown} now, which has none; choose the other first")
            again: Any = replace
            value = again(component, **{option: value})
        return {**self.parameters, base: value}

    def run(self, steps: int) -> None:
        """Make steps; fewer if the model stops."""
        before = self.world.tick
        try:
            self.world.run(steps, progress=False)
        finally:
            # An event may have reset the world, whose tick then says nothing.
            made = self.world.tick - before
            self.made += made if 0 <= made <= steps else steps

    def look(self, *, again: bool = False) -> bytes:
        """Return the present frame as a raw block and keep it.

        Parameters
        ----------
        again : bool
            Whether it takes the place of the newest frame, which shows the same moment.
        """
        before = self.scene
        with self._lock:
            frame = self._observer.frame()
            if (before.links, before.series) != (self.scene.links, self.scene.series):
                self.kept.clear()
            block = raw(frame, self.scene)
            (self.kept.replace_last if again else self.kept.append)(block)
        return block

    def set(self, name: str, value: Any) -> None:
        """Change a parameter of the running world.

        Raises
        ------
        TypeError, ValueError
            If the world refuses the value; nothing is changed then.
        """
        parameters = self.with_value(name, value)
        _apply(self.world, parameters, name.partition(".")[0], self)
        self.parameters = parameters
        with self._lock:
            self._observer.changed()

    def state(self) -> dict[str, Any]:
        """Return what the page shows beside the picture."""
        world = self.world
        return {
            "tick": world.tick, "observed": float(world.observed), "mean": float(world.observed_fraction),
            "most": int(world.max_neighbours), "kept": len(self.kept),
        }  # fmt: skip

    def events(self) -> dict[str, Any]:
        """Return the newest events; see `event_rows`."""
        return event_rows(self.world)

    def close(self) -> None:
        """Release the world."""
        self.world.close()


def _built(model: Callable[..., World], parameters: dict[str, Any], seed: int) -> World:
    name = seed_name(model)
    world = model(**parameters, **({} if name is None else {name: seed}))
    if not isinstance(world, World):
        shown = checks.shown(world)
        raise TypeError(
            f"{model_name(model)}: builds {shown}, which is no World; derive the class from teamsight.World, or return "
            "one from the function"
        )
    if not world.groups or not sum(map(len, world.groups)):
        raise ValueError(f"{model_name(model)}: builds a world without agents; add some, as in world.add(Robot, 10)")
    return world


def _apply(world: World, parameters: Mapping[str, Any], name: str, track: LiveTrack) -> None:
    """Set a parameter on a world; a degree of awareness by name has the present δ."""
    if name not in _DEGREE or not isinstance(world, CMOMMT):
        setattr(world, name, parameters[name])
        return
    degree, delta = (parameters[one] if one in parameters else track.value(one) for one in _DEGREE)
    if isinstance(degree, str):
        if name == "awareness" or "delta" in AWARENESS[degree].options():
            world.awareness = awareness_named(degree, {"delta": delta})
    elif name == "awareness":
        world.awareness = degree
