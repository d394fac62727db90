"""Scenes and frames: what does not change in a recording, and what does."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from teamsight.core.checks import shown

#: The format of scenes, frames and packed frames. A page plays only recordings of its own format.
FORMAT = 1
#: Slots are numbered by 16 bits.
MOST_SLOTS = 65_535

Point: TypeAlias = tuple[float, float]
Line: TypeAlias = tuple[Point, ...]
Fact: TypeAlias = str | float | bool | None

_FULL_TURN = 2 * math.pi


@dataclass(frozen=True)
class SceneGroup:
    """A group of bodies.

    Attributes
    ----------
    name, colour : str
        Its name, and its colour as ``#rrggbb``.
    role : str
        "robot" for bodies on a team, "target" for bodies that count in the observed fraction, otherwise "other".
    team, policy : str or None
        Its team, and the name of its policy.
    awareness : mapping, optional
        Its degree of awareness, such as ``{"name": "ring", "delta": 8}``.
    fields : mapping
        Further facts for people.
    range_shape : {"disc", "square"}
        The shape of the ranges of its bodies.
    lidar : mapping, optional
        The lidar of each of its bodies: the number of `rays`, their `range` [length] and `field_of_view` [rad].
    """

    name: str
    role: str
    colour: str
    team: str | None = None
    policy: str | None = None
    awareness: Mapping[str, Fact] | None = None
    fields: Mapping[str, Fact] = field(default_factory=dict)
    range_shape: str = "disc"
    lidar: Mapping[str, float] | None = None


@dataclass(frozen=True)
class Slot:
    """A body, in the column of frames that it has in all frames.

    Attributes
    ----------
    group : int
        Its group, by number.
    id : int
        Its identity in the world: `unique_id`.
    sensing_range, awareness_range : float
        Distances within which it senses targets and teammates [length].
    field_of_view : float
        The angle within which it senses targets [rad].
    radius : float
        The radius of the body [length]; 0 for a point.
    name : str
        What people call it, if that is not its identity.
    """

    group: int
    id: int
    sensing_range: float
    awareness_range: float
    field_of_view: float = _FULL_TURN
    radius: float = 0.0
    name: str = ""


@dataclass(frozen=True)
class LinkList:
    """A list of links that each frame has: who senses whom in a channel.

    Attributes
    ----------
    name, channel : str
        The name of the list, and the channel.
    counts : bool
        Whether what is sensed in it counts in the observed fraction.
    measured : bool
        Whether the list also has the offsets that sensors delivered, because they have noise or a delay.
    scale : float
        The offset for which 32,767 stands [length].
    """

    name: str
    channel: str
    counts: bool = False
    measured: bool = False
    scale: float = 0.0


@dataclass(frozen=True)
class Clock:
    """The times of the ticks of a record, in pieces between its gaps.

    Attributes
    ----------
    step : float
        From one tick to the next [time of the record].
    ticks : sequence of int
        The first tick of each piece.
    times : sequence of float
        Their times [time of the record].
    """

    step: float
    ticks: Sequence[int]
    times: Sequence[float]


@dataclass(frozen=True)
class Scene:
    """What does not change from frame to frame.

    Attributes
    ----------
    title, model : str
        What is recorded, for people, and the class of the world.
    version : str
        The version of teamsight that made it.
    seed : int
        The seed of the world.
    every : int
        Ticks from one frame to the next.
    bounds : tuple of float
        The box around the arena, x0, y0, x1, y1 [length]; frames hold positions as parts of it.
    walls, obstacles : tuple of lines
        Lines through points (x, y) [length].
    wraps : tuple of float, optional
        The distance after which the arena repeats along x and along y [length], 0 along an axis that does not repeat;
        None if it does not repeat at all.
    groups : tuple of SceneGroup
        The groups.
    slots : tuple of Slot
        The bodies that are in the frames, by slot.
    series : tuple of str
        The names of the numbers that each frame has.
    links : tuple of LinkList
        The lists of links that each frame has.
    clock : Clock, optional
        Of recorded positions, the times of its ticks.
    """

    title: str
    model: str
    version: str
    seed: int
    every: int
    bounds: tuple[float, float, float, float]
    walls: tuple[Line, ...] = ()
    obstacles: tuple[Line, ...] = ()
    wraps: Point | None = None
    groups: tuple[SceneGroup, ...] = ()
    slots: tuple[Slot, ...] = ()
    series: tuple[str, ...] = ()
    links: tuple[LinkList, ...] = ()
    clock: Clock | None = None

    def as_json(self) -> dict[str, Any]:
        """Return the scene as values of JSON."""
        value = asdict(self)
        for slot in value["slots"]:
            # Most bodies are points without a name.
            for name in ("radius", "name"):
                if not slot[name]:
                    del slot[name]
        for group in value["groups"]:
            if group["lidar"] is None:
                del group["lidar"]
        if self.clock is None:
            del value["clock"]
        # Python has no larger exact float, and neither has JavaScript.
        value["seed"] = self.seed if self.seed < 2**53 else str(self.seed)
        return {"format": FORMAT, **value}

    @classmethod
    def from_json(cls, value: Any) -> Scene:
        """Return the scene of what `as_json` returned, also after it was written as JSON.

        Parameters
        ----------
        value : Any
            Values of JSON, from a file that anybody may have written.

        Raises
        ------
        ValueError
            If it is not a scene, or one of another format.
        """
        if not isinstance(value, dict) or "format" not in value:
            raise ValueError(f"scene={shown(value)}: is not the scene of a recording; open a page that teamsight wrote")
        if value["format"] != FORMAT:
            raise ValueError(
                f"format={shown(value['format'])}: must be {FORMAT}, which this version of teamsight reads; open the "
                f"recording with the version that wrote it, {shown(value.get('version'))}"
            )
        try:
            return _scene_of({name: part for name, part in value.items() if name != "format"})
        except (TypeError, ValueError, KeyError) as error:
            reason = " ".join(str(error).split())
            raise ValueError(f"scene: is damaged ({reason}); record the run again") from error


def _scene_of(value: dict[str, Any]) -> Scene:
    """Return the scene of checked keys; raise what Python raises if parts are missing or of a wrong kind."""
    x0, y0, x1, y1 = map(float, value["bounds"])
    wraps = value["wraps"]
    scene = Scene(**{
        **value,
        "seed": int(value["seed"]),
        "every": int(value["every"]),
        "bounds": (x0, y0, x1, y1),
        "walls": _lines(value["walls"]),
        "obstacles": _lines(value["obstacles"]),
        "wraps": None if wraps is None else _point(wraps),
        "groups": tuple(SceneGroup(**group) for group in value["groups"]),
        "slots": tuple(Slot(**slot) for slot in value["slots"]),
        "series": tuple(map(str, value["series"])),
        "links": tuple(LinkList(**links) for links in value["links"]),
        "clock": Clock(**value["clock"]) if "clock" in value else None,
    })  # fmt: skip
    if len(scene.slots) > MOST_SLOTS:
        raise ValueError(f"{len(scene.slots)} slots, and at most {MOST_SLOTS} can be numbered")
    if any(not 0 <= slot.group < len(scene.groups) for slot in scene.slots):
        raise ValueError("a slot is of a group that is not there")
    return scene


def _lines(value: Any) -> tuple[Line, ...]:
    return tuple(tuple(_point(point) for point in line) for line in value)


def _point(value: Any) -> Point:
    x, y = map(float, value)
    return x, y


Words: TypeAlias = npt.NDArray[np.uint16]
Offsets: TypeAlias = npt.NDArray[np.int16]

#: The bits of `Frame.flags`: the body is in the world; it is active; it is sensed in a channel that counts; another
#: body has blocked its way in the step before.
PRESENT, ACTIVE, OBSERVED, BLOCKED = 1, 2, 4, 8
#: The largest part of the box around the arena, and the number of parts of a full turn.
MOST_PART, TURN = 65_535, 65_536
#: What stands for the scale of a list of links.
MOST_OFFSET = 32_767
#: How many links of a relation the frames of a live page hold; view.js names it too.
MOST_LINKS = 100_000


@dataclass(frozen=True, eq=False)
class Links:
    """Who senses whom, sorted by who senses.

    Attributes
    ----------
    source, target : ndarray, shape (m,), uint16
        The slots of who senses and of who is sensed.
    dx, dy : ndarray, shape (m,), int16, optional
        Where it appears to be, seen from the source along the axes of the arena: 32,767 stands for `LinkList.scale`.
        None unless the list is measured.
    omitted : int
        How many links there are that are not in the arrays, since they are more than a frame holds.
    """

    source: Words
    target: Words
    dx: Offsets | None = None
    dy: Offsets | None = None
    omitted: int = 0

    def __len__(self) -> int:
        return len(self.source)


@dataclass(frozen=True, eq=False)
class Frame:
    """What is drawn of one tick. All arrays have one entry for each slot.

    Attributes
    ----------
    time : float
        The tick.
    series : ndarray, shape (S,), float32
        The numbers that `Scene.series` names; NaN where there is none.
    x, y : ndarray, shape (n,), uint16
        Positions as parts of the box around the arena: 0 at its lower, 65,535 at its upper side.
    heading : ndarray, shape (n,), uint16
        Directions as parts of a turn, counter-clockwise from x: 65,536 would be a full turn.
    flags : ndarray, shape (n,), uint16
        `PRESENT`, `ACTIVE`, `OBSERVED` and `BLOCKED`; 0 for a body that has left or not yet come.
    links : tuple of Links
        One for each of `Scene.links`.
    """

    time: float
    series: npt.NDArray[np.float32]
    x: Words
    y: Words
    heading: Words
    flags: Words
    links: tuple[Links, ...] = ()

    def __len__(self) -> int:
        return len(self.x)

    def positions(self, bounds: tuple[float, float, float, float]) -> npt.NDArray[np.float64]:
        """Return the positions in the arena, shape (n, 2) [length].

        Parameters
        ----------
        bounds : tuple of float
            `Scene.bounds`.
        """
        x0, y0, x1, y1 = bounds
        part = np.stack([self.x, self.y], axis=-1) / MOST_PART
        return np.asarray([x0, y0] + part * [x1 - x0, y1 - y0])

    def angles(self) -> npt.NDArray[np.float64]:
        """Return the directions, shape (n,) [rad], counter-clockwise from x, in [0, 2π)."""
        return np.asarray(self.heading * (2 * np.pi / TURN))
