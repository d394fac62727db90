"""A controller: the policy of one robot outside of a simulated world, on readings of the robot's own sensors.

It asks the kernels that a world asks, on arrays of one row. So a policy that was found in simulation runs on a robot
unchanged, and on the readings of a simulated robot a controller decides as the world does, to the last bit.
"""

from __future__ import annotations

import copy
import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from operator import itemgetter
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.attributes import protected
from teamsight.agents.awareness.interface import (
    SENSING,
    TEAM_GROUP,
    Awareness,
    Perception,
    Scene,
    Sensing,
    TeamGroup,
    perceive_entry,
    situate_entry,
)
from teamsight.agents.resolve import awareness_of, check_fit, policy_of, take_rows
from teamsight.agents.sensing.lidar import Lidar
from teamsight.core import checks
from teamsight.core.kernel import Packed
from teamsight.core.neighbour_list import NeighbourList, filled, neighbour_room, no_neighbours
from teamsight.core.table import Field
from teamsight.policies.actions import check_action, check_answer
from teamsight.policies.channels import NO_COLUMNS, channels_of, columns_of
from teamsight.policies.compiled import CompiledPolicy, decides_in_kernel, pack_decision
from teamsight.policies.interface import IDENTITIES, Action, Percept, Policy, turned
from teamsight.policies.percept_of_one import percept_of_one
from teamsight.policies.registry import label
from teamsight.world.arena import Torus
from teamsight.world.drive import Drive, Free, drive_of
from teamsight.world.motion import FINISHED, bodies_at, intend_entry, pack_move
from teamsight.world.motion import turn_limit as turn_limit_of
from teamsight.world.noise import PERIOD, TICKS_A_BLOCK, Stream, generator, key_of, stream_number, uniforms_of_block
from teamsight.world.registry import DriveName

Floats = npt.NDArray[np.float64]

# Room for targets at first; more is made when it is needed.
_ROOM = 16
_NOTHING = np.zeros(0)
_UNKNOWN = -1
# Targets without an identity of their own have larger ones than any that is given.
_MOST = 2**31 - 1
_MOST_PATIENCE = 10_000
# What policies can read of bodies by identity, as in a world, and up to which identity.
_COLUMNS, _MOST_COLUMN = ("moved_x", "moved_y", "radius", "speed"), 1_000_000
# What `Controller._bind` makes.
_BOUND = ("_sensing", "_percept", "_decision", "_move")
# The identity of a body that was seen, its offset along the axes of headings, and its distance.
_Body = tuple[int, float, float, float]
_identity = itemgetter(0)


class Detections(NamedTuple):
    """What a sensor, or a radio, has delivered: k bodies as seen from one robot at one time.

    Attributes
    ----------
    distance : array_like, shape (k,)
        [length].
    bearing : array_like, shape (k,)
        Anticlockwise from the heading of the robot that saw them [rad].
    identity : array_like of int, shape (k,), optional
        Who they are; −1, or left out, for unknown.
    tick : int, optional
        When they were seen; by default at the present tick.
    offset : array_like, shape (k, 2), optional
        From the robot to the bodies, along the axes in which headings are given [length]; instead of `bearing`, and of
        `distance`, which is then its length.
    moved : array_like, shape (k, 2), optional
        How far each has moved in the last tick, along these axes [length]; by default since it was seen before. These
        and the next two are for policies that read them, such as `Avoiding`, by identity.
    radius, speed : float or array_like, shape (k,), optional
        The radius of each body, and its largest distance in a tick [length]. By default those of teammates are the
        robot's own, and others have none.
    """

    distance: npt.ArrayLike = _NOTHING
    bearing: npt.ArrayLike = _NOTHING
    identity: npt.ArrayLike | None = None
    tick: int | None = None
    offset: npt.ArrayLike | None = None
    moved: npt.ArrayLike | None = None
    radius: npt.ArrayLike | None = None
    speed: npt.ArrayLike | None = None

    @classmethod
    def of(cls, seen: NeighbourList, row: int, tick: int | None = None, columns: Any = NO_COLUMNS) -> Detections:
        """Return what a simulated robot senses, from a neighbour list of the percept of its group, and its columns."""
        mine = slice(seen.start[row], seen.start[row + 1])
        # Copies, since the world writes its next step into the same arrays.
        distance, identity, offset = (part[mine].copy() for part in (seen.distance, seen.identity, seen.offset))
        more: dict[str, Any] = {}
        if columns:
            more = {name: getattr(columns, name)[identity] for name in ("radius", "speed")}
            more["moved"] = np.stack([columns.moved_x[identity], columns.moved_y[identity]], axis=-1)
        return cls(distance, identity=identity, tick=tick, offset=offset, **more)


class Relayed(NamedTuple):
    """What a teammate has sent: the targets that it senses, for degrees of awareness that share them.

    Attributes
    ----------
    targets : Detections
        As seen by the teammate, with identities.
    heading : float or array_like, shape (2,)
        The teammate's heading [rad], or as a unit vector.
    sensing_range : float, optional
        The teammate's [length], to which inputs of learners are relative; by default that of the robot itself.
    """

    targets: Detections
    heading: float | npt.ArrayLike
    sensing_range: float | None = None


class Command(NamedTuple):
    """What the robot is to do until its next decision.

    Attributes
    ----------
    turn : float
        Anticlockwise [rad], from −π to π, within the turning limit.
    distance : float
        After the turn [length], from 0 to the speed.
    heading : tuple of two float
        The heading that the policy asks for, a unit vector; (0, 0) for the present one.
    """

    turn: float
    distance: float
    heading: tuple[float, float]


class Controller:
    """The policy of one robot, on readings of its own sensors.

    Parameters
    ----------
    policy : Policy, callable or str
        As for `World.add`.
    awareness : Awareness or str
        What the policy perceives of teammates; as for `World.add`.
    policy_options : mapping of str to object, optional
        The options of a policy given by name.
    identity : int
        The robot's own identity, one of `team`.
    team : sequence of int
        The identities of all robots of the team, at most those that radios or markers can tell apart.
    sensing_range, awareness_range : float
        Ranges within which targets and teammates are perceived; what is seen beyond them is ignored [length]. Further
        channels are not limited.
    speed : float
        The largest distance from one decision to the next [length].
    turn_limit : float, optional
        The largest turn from one decision to the next [rad]; none by default.
    drive : Drive or str
        What the wheels can do, as for `World.add`; see `drive_state`.
    radius : float
        The radius of the robot, for policies that read it, such as `Avoiding` [length].
    lidar : Lidar, optional
        The lidar whose distances it is given.
    seed : int
        The seed of its random numbers. Robots of a team share it: their numbers differ by their place in the team.
    jump : float, optional
        How far a target of unknown identity moves from one decision to the next, at most: the nearest one that was
        seen there is taken for the same target [length]. By default twice the speed of the robot.
    patience : int
        How many ticks old a reading may be; older ones count as nothing seen.
    group, member : int
        The number of the robot's group in a world, and its number in that group, which select its random numbers; by
        default 0, and its place in the team.

    Raises
    ------
    TypeError, ValueError
        If an argument is wrong, or the policy needs what the degree of awareness does not deliver.

    Notes
    -----
    On what a robot of a world senses, with its seed, group, member and ticks, it decides as the robot does there, to
    the last bit, if detections are given as offsets along the arena's axes and all ranges are discs. Columns of groups,
    such as those of interactions, are not available outside of a world.

    What has to be compiled is compiled here. A copy, or a controller that was pickled, goes on by itself.
    """

    def __init__(
        self,
        policy: Policy | Callable[..., Any] | str,
        awareness: Awareness | str = "none",
        *,
        policy_options: Mapping[str, Any] | None = None,
        identity: int = 0,
        team: Sequence[int] = (0,),
        sensing_range: float = 1.0,
        awareness_range: float = 1.0,
        speed: float = 0.1,
        turn_limit: float | None = None,
        drive: Drive | DriveName = "free",
        radius: float = 0.0,
        lidar: Lidar | None = None,
        jump: float | None = None,
        seed: int = 0,
        patience: int = 5,
        group: int = 0,
        member: int | None = None,
    ) -> None:
        self.policy, self.awareness = policy_of(policy, policy_options), awareness_of(awareness)
        self.team = _team(team)
        self.identity = checks.count("identity", identity, least=0)
        if self.identity not in self.team:
            raise ValueError(f"identity={checks.shown(identity)}: must be one of the team, {_list(self.team)}")
        self._ranges = {
            "targets": checks.number("sensing_range", sensing_range, above=0.0),
            "teammates": checks.number("awareness_range", awareness_range, above=0.0),
        }
        self.speed = checks.number("speed", speed, least=0.0)
        self._limit = math.pi if turn_limit is None else checks.angle("turn_limit", turn_limit, math.tau)
        self._drive = drive_of(drive)
        self.radius = checks.number("radius", radius, least=0.0)
        if not (lidar is None or isinstance(lidar, Lidar)):
            raise TypeError(f"lidar={checks.shown(lidar)}: must be a Lidar, such as Lidar(rays=32, range=2.0)")
        self._lidar = lidar
        self._jump = 2.0 * self.speed if jump is None else checks.number("jump", jump, least=0.0)
        self.patience = checks.count("patience", patience, least=0, most=_MOST_PATIENCE)
        self._key, self._group = key_of(checks.seed(seed, None)), checks.count("group", group, least=0)
        self._place = {one: place for place, one in enumerate(self.team)}
        self._own, self._others = self._place[self.identity], _list({*self.team} - {self.identity})
        self._member = self._own if member is None else checks.count("member", member, least=0, most=_MOST)
        made: Any = self.policy
        self._draws, self._inputs = (made.draws, made.inputs) if isinstance(made, Policy) else (0, 0)
        if isinstance(made, Policy):
            _check(made, self.awareness, len(self.team), lidar)
        self._columns = made.columns if isinstance(made, Policy) else ()
        if self._columns and self.team[-1] > _MOST_COLUMN:
            raise ValueError(
                f"team: has the identity {self.team[-1]}, and policy={label(made)} reads robots by identity, up to "
                f"{_MOST_COLUMN:,}; number them from 0"
            )
        self.reset()
        # Compiled now, rather than in the first decision.
        degree = perceive_entry(self.awareness), situate_entry(self.awareness) if self._inputs else None
        drives = None if isinstance(self._drive, Free) else intend_entry(self._drive)
        for entry in (*degree, drives, made.entry() if decides_in_kernel(made) else None):
            if entry is not None:
                entry.address  # noqa: B018

    def __repr__(self) -> str:
        name = label(self.policy) if isinstance(self.policy, Policy) else getattr(self.policy, "__name__", "policy")
        return f"Controller({name}, {self.awareness.name!r}, identity={self.identity}, tick={self.tick})"

    def __getstate__(self) -> dict[str, Any]:
        # The records hold addresses of arrays.
        return {name: value for name, value in vars(self).items() if name not in _BOUND}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._bind()

    def __copy__(self) -> Controller:
        return copy.deepcopy(self)

    def reset(self) -> None:
        """Begin anew: forget all that was seen, and the policy's state."""
        one = len(self.team)
        self.tick = -1
        self._heading, self._moved = np.array([[1.0, 0.0]]), np.zeros((1, 2))
        # Where the robot believes itself to be, and its heading, at the latest ticks.
        self._track: deque[_Pose] = deque(maxlen=self.patience + 1)
        self._last: dict[str, _Seen] = {}
        self._sent: dict[int, _Reported] = {}
        # Targets of unknown identity that were seen at the last decision, and how many there have been.
        self._unnamed: list[_Body] = []
        self._named = 0
        self._time, self._now = np.zeros(1), np.zeros(1, np.int64)
        self._block, self._noise = -1, np.zeros((TICKS_A_BLOCK, self._draws, 1))
        self._action = Action(np.zeros((1, 2)), np.zeros(1))
        self._body = bodies_at(np.zeros((1, 2)), self._heading)
        self._body.speed[:] = self.speed
        self._body.turn_cosine[:], self._body.turn_sine[:] = turn_limit_of(self._limit)
        self._body.declare(Field("drive", shape=(len(self._drive.state),)))
        self._command = Command(0.0, 0.0, (0.0, 0.0))
        names = self.policy.channels if isinstance(self.policy, Policy) else ()
        self._seen = {name: neighbour_room(1, _ROOM) for name in ("targets", *names)}
        self._seen["teammates"] = neighbour_room(1, one)
        self._places = np.zeros(one, np.int64)
        self._headings, self._reaches = np.zeros((one, 2)), np.full(one, self._ranges["targets"])
        self._headings[:, 0] = 1.0
        self._their_targets = neighbour_room(one, _ROOM)
        # Of bodies that are not in sight NaN; and those that have a value.
        self._by_identity = {name: np.full(self.team[-1] + 1, math.nan) for name in self._columns}
        self._valued: list[int] = []
        self._rays = np.zeros((1, 0)) if self._lidar is None else np.full((1, self._lidar.rays), self._lidar.range)
        self._measured = -1
        self._perception = Perception(1, 1)
        self._state: Any = None
        if isinstance(self.policy, Policy):
            # Its own row, since robots may begin with different states.
            size = max(one, self._member + 1)
            self._state = take_rows(self.policy.start(size), np.array([self._member]), size)
        self._bind()

    def decide(
        self,
        targets: Detections | None = None,
        teammates: Detections | None = None,
        *,
        heading: float | npt.ArrayLike | None = None,
        moved: npt.ArrayLike | None = None,
        relayed: Mapping[int, Relayed] | None = None,
        tick: int | None = None,
        blocked: bool = False,
        lidar: npt.ArrayLike | None = None,
        **channels: Detections | None,
    ) -> Command:
        """Return what the robot is to do next.

        Parameters
        ----------
        targets, teammates : Detections, optional
            Who is seen. None if nothing has arrived since the last decision: the last detections are used again, and
            so they are if those that have arrived are older. Late and old ones are moved by the way that the robot has
            gone since; those that are older than `patience` are ignored. ``Detections()`` says that nobody is there.
        heading : float or array_like, shape (2,), optional
            Of the robot, by its compass or odometry [rad], or as a unit vector. By default it has turned as it was
            commanded to, or as its drive does.
        moved : array_like, shape (2,), optional
            Its displacement since the last decision, by odometry, along the axes of headings [length]. By default it
            has gone as it was commanded to.
        relayed : mapping of int to Relayed, optional
            What teammates have sent, by identity; of those that are not seen, nothing is known. From whom nothing has
            arrived, the last counts, up to `patience`.
        tick : int, optional
            The present tick, a whole number; by default the one after the last decision's, at first 0. Later decisions
            may leave out some.
        blocked : bool
            Whether a bumper, or the motors, say that something was in its way since the last decision: a drive then
            begins at rest, as in a world. A drive makes one step for each decision.
        lidar : array_like, shape (rays,), optional
            The distances along the rays of its lidar, in the order of `Lidar.bearings` [length]; larger ones, and inf,
            are the range. By default those before, and the range once they are older than `patience`.
        **channels : Detections
            What is seen in further channels that the policy reads.

        Raises
        ------
        TypeError, ValueError
            If a reading is malformed, from the future, or of somebody who is not in the team. The controller is then as
            before.
        """
        now = checks.count("tick", self.tick + 1 if tick is None else tick, least=self.tick + 1, most=PERIOD - 1)
        track = [*self._track, self._pose(now, heading, moved)]
        rays = self._distances(lidar)
        known = self._seen.keys() - {"targets", "teammates"}
        for name in channels.keys() - known:
            raise TypeError(f"{name}: is no channel that policy={label(self.policy)} reads; it reads {_list(known)}")
        given = {name: channels.get(name) for name in known} | {"targets": targets, "teammates": teammates}
        last = {name: self._latest(name, one, track) for name, one in given.items()}
        bodies = {name: self._bodies(name, one, track[-1]) for name, one in last.items()}
        sent = self._messages(relayed, now) if relayed is not None or self._sent else {}
        unnamed, named = self._name(bodies["targets"], track[-1])
        if self._columns:
            self._show_columns(last, track[-1])
        self._fill(bodies, sent)
        if lidar is not None or now - self._measured > self.patience:
            self._rays[0] = rays
        _, _, _, ahead, left, *step = track[-1]
        self._heading[0, 0], self._heading[0, 1] = ahead, left
        self._moved[0], self._time[0], self._now[0] = step, now, now
        self._draw(now)
        x, y, distance = self._ask()
        turn = math.atan2(y * ahead - x * left, x * ahead + y * left) if x or y else 0.0
        turn = min(max(turn, -self._limit), self._limit)
        command = Command(turn, min(max(distance, 0.0), self.speed), (x, y))
        self._carry_out(checks.flag("blocked", blocked))
        self.tick, self._last, self._sent, self._command = now, last, sent, command
        self._measured = self._measured if lidar is None else now
        self._unnamed, self._named = unnamed, named
        self._track.append(track[-1])
        return command

    def _distances(self, given: Any) -> Any:
        """Return the readings of the lidar; the range where nothing is given."""
        if given is None:
            return math.inf if self._lidar is None else self._lidar.range
        if self._lidar is None:
            raise TypeError("lidar: this controller has none; give it one, as in Controller(…, lidar=Lidar(rays=32))")
        size, reach = self._lidar.rays, self._lidar.range
        try:
            rays = np.asarray(given, float)
        except (TypeError, ValueError):
            rays = np.zeros(0)
        if rays.shape != (size,):
            raise TypeError(f"lidar={checks.shown(given)}: must be {size} distances, one for each ray")
        if not (rays >= 0.0).all():
            raise ValueError(f"lidar={checks.shown(given)}: must be at least 0; give inf where a ray meets nothing")
        return np.minimum(rays, reach)

    def _show_columns(self, last: Mapping[str, _Seen], here: _Pose) -> None:
        """Write what the policy reads of bodies by identity."""
        facts = {self.identity: (here.moved_x, here.moved_y, self.radius, self.speed)}
        for seen in last.values():
            facts |= seen.facts
        largest = max(facts)
        if largest >= len(next(iter(self._by_identity.values()))):
            self._by_identity = {
                name: np.concatenate([values, np.full(2 * largest + 1 - len(values), math.nan)])
                for name, values in self._by_identity.items()
            }
            self._bind()
        for name, values in self._by_identity.items():
            values[self._valued] = math.nan
            at = _COLUMNS.index(name)
            for one, fact in facts.items():
                values[one] = fact[at]
        self._valued = list(facts)

    @property
    def drive_state(self) -> dict[str, float]:
        """What the drive makes of the last command, such as the speeds of wheels; see `Drive.state`."""
        return dict(zip(self._drive.state, self._body.drive[0].tolist(), strict=True))

    def _carry_out(self, is_blocked: bool) -> None:
        """Let the drive carry out the action that is in the arrays."""
        if isinstance(self._drive, Free):
            return
        body = self._body
        before = {name: body[name].copy() for name in ("drive", "heading", "moved")}
        body.heading[:], body.speed[:], body.blocked[:] = self._heading, self.speed, is_blocked
        if intend_entry(self._drive)(self._move) not in (0, FINISHED):
            for name, values in before.items():
                body[name][:] = values
            raise ValueError(
                f"drive={type(self._drive).__name__}: carry returned a way that is not finite or longer than the "
                "speed, or no turn; check it with check_drive()"
            )

    def _pose(self, now: int, heading: Any, moved: Any) -> _Pose:
        """Return where the robot is now: as it says, or as it was commanded to go."""
        before, done = self._track[-1] if self._track else _Pose(now), self._command
        driven = self.tick >= 0 and not isinstance(self._drive, Free)
        if heading is None and driven:
            ahead, left = self._body.heading[0].tolist()
        elif heading is None:
            cosine, sine = math.cos(done.turn), math.sin(done.turn)
            ahead, left = cosine * before.ahead - sine * before.left, sine * before.ahead + cosine * before.left
        else:
            ahead, left = _unit("heading", heading)
        if moved is None and driven:
            x, y = self._body.moved[0].tolist()
        else:
            x, y = (done.distance * ahead, done.distance * left) if moved is None else _vector("moved", moved)
        return _Pose(now, before.x + x, before.y + y, ahead, left, x, y)

    def _latest(self, name: str, given: Detections | None, track: Sequence[_Pose]) -> _Seen:
        """Return the bodies that count, as they were seen: those given, or the last ones, unless they are too old."""
        here = track[-1]
        seen = self._last.get(name, _Seen(-1, here, []))
        if given is not None:
            tick = _tick_of(name, given, here.tick)
            # What was seen before the first decision, was seen from there.
            there = here if tick == here.tick else max((one for one in track if one.tick <= tick), default=track[0])
            bodies = _bodies_of(name, given, there.ahead, there.left)
            if name == "teammates":
                self._check_teammates(bodies)
            if tick >= seen.tick:
                facts = self._facts(name, given, bodies, seen, there) if self._columns else {}
                seen = _Seen(tick, there, bodies, facts)
        return seen if here.tick - seen.tick <= self.patience else _Seen(-1, here, [])

    def _facts(
        self, name: str, given: Detections, bodies: list[_Body], before: _Seen, there: _Pose
    ) -> dict[int, tuple[float, float, float, float]]:
        """Return displacement, radius and speed of the bodies of a channel that were seen from a place, by identity."""
        size, is_team = len(bodies), name == "teammates"
        radii, speeds = (
            _each(name, part, value, own if is_team else math.nan, size)
            for part, value, own in (("radius", given.radius, self.radius), ("speed", given.speed, self.speed))
        )
        moved: list[Any] = [None] * size if given.moved is None else _pairs(f"{name}.moved", given.moved)
        if len(moved) != size:
            raise ValueError(f"{name}.moved: has {len(moved)} displacements, and there are {size} bodies; give each")
        # Where they were seen before, from the place of now.
        ticks = there.tick - before.tick
        x, y = before.pose.x - there.x, before.pose.y - there.y
        known = before.bodies if ticks and given.moved is None else []
        was = {one: (x + ahead, y + left) for one, ahead, left, _ in known}
        facts = {}
        for (one, ahead, left, _), radius, speed, way in zip(bodies, radii, speeds, moved, strict=True):
            if one == _UNKNOWN:
                if radius > 0.0:
                    raise ValueError(
                        f"{name}: a body with a radius has no identity, by which policy={label(self.policy)} reads it; "
                        "give identities"
                    )
                continue
            if one > _MOST_COLUMN:
                raise ValueError(
                    f"{name}.identity={one}: policy={label(self.policy)} reads bodies by identity, up to "
                    f"{_MOST_COLUMN:,}; number them from 0"
                )
            if way is None:
                old = was.get(one, (ahead, left))
                way = (ahead - old[0]) / max(ticks, 1), (left - old[1]) / max(ticks, 1)
            facts[one] = *way, radius, speed
        return facts

    def _bodies(self, name: str, seen: _Seen, here: _Pose) -> list[_Body]:
        """Return what was seen as bodies around the robot as it is now, those in range."""
        bodies = seen.bodies
        if seen.pose is not here:
            x, y = here.x - seen.pose.x, here.y - seen.pose.y
            bodies = [(one, ahead - x, left - y, math.hypot(ahead - x, left - y)) for one, ahead, left, _ in bodies]
        return _within(bodies, self._ranges.get(name, math.inf))

    def _name(self, targets: list[_Body], now: _Pose) -> tuple[list[_Body], int]:
        """Give targets of unknown identity one: that of the nearest such target that was near there, or a new one.

        Returns those targets, and how many there have been.
        """
        unknown, named = [row for row, one in enumerate(targets) if one[0] == _UNKNOWN], self._named
        if not unknown:
            return [], named
        before = [(one, x - now.moved_x, y - now.moved_y) for one, x, y, _ in self._unnamed]
        gaps = sorted(
            (gap, row, one)
            for row in unknown for one, x, y in before
            if (gap := math.hypot(targets[row][1] - x, targets[row][2] - y)) <= self._jump
        )  # fmt: skip
        names, taken = dict[int, int](), set[int]()
        for _, row, one in gaps:
            if row not in names and one not in taken:
                names[row] = one
                taken.add(one)
        for row in unknown:
            if row not in names:
                named += 1
                names[row] = _MOST + named
            targets[row] = names[row], *targets[row][1:]
        return [targets[row] for row in unknown], named

    def _messages(self, relayed: Mapping[int, Relayed] | None, now: int) -> dict[int, _Reported]:
        """Return the last message of each teammate that is not too old, by its identity."""
        if relayed is not None and not isinstance(relayed, Mapping):
            raise TypeError(f"relayed={checks.shown(relayed)}: must be a mapping of identities to Relayed(…)")
        sent = {one: last for one, last in self._sent.items() if now - last.tick <= self.patience}
        for identity, message in (relayed or {}).items():
            name = f"relayed[{identity!r}]"
            of_targets = f"{name}.targets"
            if identity not in self._place or identity == self.identity:
                raise ValueError(f"{name}: must be of a teammate, one of {self._others}")
            if not isinstance(message, Relayed):
                raise TypeError(f"{name}={checks.shown(message)}: must be Relayed(targets, heading)")
            ahead, left = _unit(f"{name}.heading", message.heading)
            reach = self._ranges["targets"]
            if message.sensing_range is not None:
                reach = checks.number(f"{name}.sensing_range", message.sensing_range, above=0)
            tick = _tick_of(of_targets, message.targets, now)
            bodies = _bodies_of(of_targets, message.targets, ahead, left)
            if bodies and min(bodies)[0] == _UNKNOWN:
                raise ValueError(f"{name}.targets: have no identities, so that nobody knows which they are; give them")
            if now - tick <= self.patience and (identity not in sent or tick >= sent[identity].tick):
                sent[identity] = _Reported(tick, ahead, left, reach, _within(bodies, math.inf))
        return sent

    def _check_teammates(self, bodies: list[_Body]) -> None:
        """Refuse teammates that cannot be."""
        met: set[int] = set()
        for identity, *_ in bodies:
            if identity == _UNKNOWN:
                continue
            if identity not in self._place or identity == self.identity or identity in met:
                why = "seen twice" if identity in met else f"not one of {self._others}"
                why = "the robot itself" if identity == self.identity else why
                raise ValueError(f"teammates: {identity} is {why}; give each teammate that is seen once")
            met.add(identity)
        if len(bodies) > len(self.team) - 1:
            raise ValueError(f"teammates: {len(bodies)} are seen, and the team has {len(self.team) - 1} others")
        if len(met) == len(bodies):
            return
        made: Any = self.policy
        if (self._inputs and self.awareness.shows_teammates) or IDENTITIES in getattr(made, "needs", ()):
            raise ValueError(
                f"teammates: their identities are needed by policy={label(made)} under awareness "
                f"{self.awareness.name!r}; give them, or a policy or a degree that does not need them"
            )

    def _fill(self, bodies: Mapping[str, list[_Body]], sent: Mapping[int, _Reported]) -> None:
        """Write what is seen into the arrays that the kernels read."""
        seen_now = [self._place.get(one, _UNKNOWN) for one, *_ in bodies["teammates"]]
        # Those of unknown identity have the places that others leave.
        free = (place for place in range(len(self.team)) if place != self._own and place not in seen_now)
        places = [next(free) if place == _UNKNOWN else place for place in seen_now]
        reported = {self._place[one]: sent[one] for one, *_ in bodies["teammates"] if one in sent}
        total = sum(len(one.targets) for one in reported.values())
        small = [name for name, seen in bodies.items() if len(seen) > len(self._seen[name].identity)]
        if small or total > len(self._their_targets.identity):
            self._seen |= {name: neighbour_room(1, 2 * len(bodies[name])) for name in small}
            if total > len(self._their_targets.identity):
                self._their_targets = neighbour_room(len(self.team), 2 * total)
            self._bind()
        for name, seen in bodies.items():
            self._seen[name].start[1] = len(seen)
            _write(seen, self._seen[name])
        if places:
            self._places[: len(places)] = places
        if reported or self._their_targets.start[-1]:
            start, targets = [0], []
            for place in range(len(self.team)):
                if one := reported.get(place):
                    self._headings[place, 0], self._headings[place, 1] = one.ahead, one.left
                    self._reaches[place] = one.reach
                    targets += one.targets
                start.append(len(targets))
            self._their_targets.start[:] = start
            _write(targets, self._their_targets)

    def _draw(self, now: int) -> None:
        """Draw the random numbers of the present tick, four ticks at a time."""
        if self._draws and now // TICKS_A_BLOCK != self._block:
            self._block = now // TICKS_A_BLOCK
            stream = stream_number(Stream.POLICY, self._group)
            self._noise[:] = uniforms_of_block(self._key, stream, now, np.array([self._member]), self._draws)

    def _bind(self) -> None:
        """Make the records that the kernels read."""
        # Where a body goes depends on no arena before it meets a wall.
        self._move = pack_move(Torus(1.0, 1.0), self._body, *self._action, drive=self._drive)
        size, degree, perception = len(self.team), self.awareness, self._perception
        # A list shows its part in use where it is read.
        perception.make_room(degree, size, max(size, len(self._their_targets.identity)), self._inputs)
        reach, wide = np.array([self._ranges["targets"]]), np.array([self._ranges["teammates"]])
        team = [TEAM_GROUP.pack(TeamGroup(
            0, np.array(self.team), self._headings, self._reaches, self._their_targets, no_neighbours(size),
            np.zeros(0, np.int64), [],
        ))]  # fmt: skip
        scene = Scene(
            self._heading, reach, wide, self._seen["targets"], self._seen["teammates"], self._places, self._own, team
        )
        parameters = np.ascontiguousarray(degree.parameters, float)
        self._sensing = SENSING.pack(
            Sensing(scene, parameters, perception.shown, perception.relayed, perception.situation)
        )
        policy = self.policy
        shown = self._seen["teammates"] if degree.shows_teammates else perception.shown
        relayed = perception.relayed
        if isinstance(policy, CompiledPolicy) and not policy.reads_teammates:
            shown = relayed = perception.nothing
        names = policy.channels if isinstance(policy, Policy) else ()
        self._percept = Percept(
            self._heading, self._moved, np.array([self.speed]), reach, wide, self._seen["targets"], shown, relayed,
            perception.situation, channels_of(names, (self._seen[name] for name in names)), self._time,
            np.zeros(1), np.zeros(1, np.bool_), np.array([self.identity]),
            columns_of(self._columns, self._by_identity.values()), self._rays,
        )  # fmt: skip
        self._decision: Packed[Any] | None = None
        if decides_in_kernel(policy):
            self._decision = pack_decision(policy, self._percept, self._state, self._noise, self._now, self._action)

    def _ask(self) -> tuple[float, float, float]:
        """Return the heading and the distance that the policy decides on what is in the arrays."""
        if perceive := perceive_entry(self.awareness):
            need = perceive(self._sensing)
            while need > self._perception.room:
                self._perception.room = need
                self._bind()
                need = perceive(self._sensing)
        if self._inputs:
            situate_entry(self.awareness)(self._sensing)
        policy: Any = self.policy
        if self._decision is not None:
            policy.entry()(self._decision)
            x, y = self._action.heading[0].tolist()
            if not (abs(x * x + y * y - 1.0) < 1e-6 or x == y == 0.0) or math.isnan(self._action.distance[0]):
                check_action(label(policy), self._action, 1)
        else:
            bound, tick = self._percept, int(self._now[0])
            lists: Any = bound.channels
            percept = bound._replace(
                targets=filled(bound.targets), teammates=filled(bound.teammates), relayed=filled(bound.relayed),
                channels=channels_of(lists._fields, map(filled, lists)),
            )  # fmt: skip
            percept = protected(percept)
            if isinstance(policy, Policy):
                action, after = policy.decide(percept, self._state, self._noise[tick % TICKS_A_BLOCK])
                check_action(label(policy), action, 1)
                self._state = after
            else:
                rng = generator(self._key, stream_number(Stream.CALLABLE, self._group), tick, self._member)
                name = str(getattr(policy, "__name__", type(policy).__name__))
                turn, distance = check_answer(name, policy(percept_of_one(percept, 0), rng), 0)
                action = Action(turned(self._heading, [turn]), np.array([distance]))
            self._action.heading[:], self._action.distance[:] = action
        return (*self._action.heading[0].tolist(), float(self._action.distance[0]))


class _Pose(NamedTuple):
    """Where the robot believes itself to be at a tick, its heading, and its last displacement."""

    tick: int
    x: float = 0.0
    y: float = 0.0
    ahead: float = 1.0
    left: float = 0.0
    moved_x: float = 0.0
    moved_y: float = 0.0


class _Seen(NamedTuple):
    """The bodies of a channel, when they were seen, from where, and what policies read of them by identity."""

    tick: int
    pose: _Pose
    bodies: list[_Body]
    facts: dict[int, tuple[float, float, float, float]] = {}  # noqa: RUF012  nobody writes it


class _Reported(NamedTuple):
    """What a teammate has sent: when, its heading, its range and the targets in it."""

    tick: int
    ahead: float
    left: float
    reach: float
    targets: list[_Body]


def _tick_of(name: str, given: Any, now: int) -> int:
    """Return when detections were made."""
    if not isinstance(given, Detections):
        raise TypeError(f"{name}={checks.shown(given)}: must be Detections(distance, bearing, identity)")
    return now if given.tick is None else checks.count(f"{name}.tick", given.tick, least=0, most=now)


def _bodies_of(name: str, seen: Detections, ahead: float, left: float) -> list[_Body]:
    """Return detections as bodies; bearings are from this heading."""
    distances = _numbers(name, "distance", seen.distance)
    if seen.offset is not None:
        ways = _pairs(f"{name}.offset", seen.offset)
        distances = distances or [math.sqrt(x * x + y * y) for x, y in ways]
    else:
        bearings = _numbers(name, "bearing", seen.bearing)
        if len(bearings) != len(distances):
            raise ValueError(f"{name}: has {len(distances)} distances and {len(bearings)} bearings; give both of each")
        cos, sin = math.cos, math.sin
        ways = [
            ((x := one * cos(angle)) * ahead - (y := one * sin(angle)) * left, x * left + y * ahead)
            for one, angle in zip(distances, bearings, strict=True)
        ]
    named = [_UNKNOWN] * len(ways) if seen.identity is None else _numbers(name, "identity", seen.identity)
    if not len(ways) == len(distances) == len(named):
        raise ValueError(f"{name}: has {len(ways)} bodies, {len(distances)} distances and {len(named)} identities")
    if not distances:
        return []
    if min(distances) < 0.0:
        raise ValueError(f"{name}: has the distance {min(distances)}; leave out what was not measured")
    identities = list(map(int, named))
    if identities != named or not _UNKNOWN <= min(identities) <= max(identities) <= _MOST:
        raise ValueError(
            f"{name}.identity={checks.shown(named)}: must be whole numbers up to {_MOST}, and -1 for unknown"
        )
    if name == "targets" and len({*identities}) + max(identities.count(_UNKNOWN) - 1, 0) < len(identities):
        raise ValueError(f"{name}.identity={checks.shown(named)}: has a target twice; give each that is seen once")
    return [(who, x, y, far) for who, (x, y), far in zip(identities, ways, distances, strict=True)]


def _pairs(name: str, given: Any) -> list[tuple[float, float]]:
    if not np.iterable(given):
        raise TypeError(f"{name}={checks.shown(given)}: must be a list of pairs, one for each body")
    return [_vector(name, one) for one in given]


def _each(name: str, part: str, given: Any, usual: float, size: int) -> list[float]:
    """Return a number at least 0 for each of some bodies; one may be given for all."""
    if given is None:
        return [usual] * size
    if np.ndim(given) == 0:
        return [checks.number(f"{name}.{part}", given, least=0.0)] * size
    found = _numbers(name, part, given)
    if len(found) != size or min(found, default=0.0) < 0.0:
        raise ValueError(f"{name}.{part}={checks.shown(given)}: must be {size} numbers, at least 0, one a body")
    return found


def _numbers(name: str, part: str, values: Any) -> list[float]:
    """Return a list of finite numbers."""
    try:
        numbers: list[float] = values.tolist() if isinstance(values, np.ndarray) else [*values]
        # Their sum can only be finite if all are; but for large ones the reverse does not hold.
        if math.isfinite(sum(numbers)) or all(map(math.isfinite, numbers)):
            return numbers
    except (TypeError, OverflowError):
        raise TypeError(f"{name}.{part}={checks.shown(values)}: must be a list of numbers, one for each body") from None
    raise ValueError(f"{name}.{part}={checks.shown(values)}: must be finite; leave out what was not measured")


def _within(bodies: list[_Body], reach: float) -> list[_Body]:
    """Return the bodies within a range, in the order of their identities; those of unknown identity come last."""
    near = [one for one in bodies if one[3] <= reach]
    # Stable, so that those of equal identity stay in order, which are unknown.
    near.sort(key=_identity)
    unknown = next((row for row, one in enumerate(near) if one[0] != _UNKNOWN), 0) if near and near[0][0] < 0 else 0
    return near[unknown:] + near[:unknown] if unknown else near


def _write(bodies: list[_Body], room: NeighbourList) -> None:
    """Write bodies as the first entries of a neighbour list."""
    if bodies:
        size, (identity, *numbers) = len(bodies), zip(*bodies, strict=True)
        room.identity[:size] = identity
        room.offset[:size, 0], room.offset[:size, 1], room.distance[:size] = numbers


def _unit(name: str, value: Any) -> tuple[float, float]:
    """Return a heading, given as an angle or a unit vector, as a unit vector."""
    if type(value) is float and math.isfinite(value):
        return math.cos(value), math.sin(value)
    if np.ndim(value) == 0:
        angle = checks.number(name, value)
        return math.cos(angle), math.sin(angle)
    x, y = _vector(name, value)
    if abs(x * x + y * y - 1.0) > 1e-6:
        raise ValueError(f"{name}={checks.shown(value)}: must be a unit vector, or an angle [rad]")
    return x, y


def _vector(name: str, value: Any) -> tuple[float, float]:
    try:
        x, y = map(float, value)
    except (TypeError, ValueError):
        x = y = math.nan
    if not math.isfinite(x + y):
        raise ValueError(f"{name}={checks.shown(value)}: must be two finite numbers")
    return x, y


def _team(given: Sequence[int]) -> tuple[int, ...]:
    """Return the identities of a team in ascending order."""
    if not np.iterable(given):
        raise TypeError(f"team={checks.shown(given)}: must be a list of identities")
    team = tuple(sorted(checks.count("team", one, least=0, most=_MOST) for one in given))
    if not team or len({*team}) < len(team):
        raise ValueError(f"team={checks.shown(given)}: must be the identities of all robots, each once")
    return team


def _list(values: Any) -> str:
    return ", ".join(map(str, sorted(values))) or "none"


def _check(policy: Policy, awareness: Awareness, size: int, lidar: Lidar | None) -> None:
    """Refuse a policy that needs what a controller, or its degree of awareness, does not deliver."""
    group: Any = SimpleNamespace(policy=policy, awareness=awareness, lidar=lidar)
    team: Any = [range(size)]
    check_fit(group, team)
    if awareness.spreads:
        raise ValueError(
            f"awareness={awareness.name!r}: needs what teammates sense of each other, which no controller is given; "
            "use 'shared', and pass the reports on by your own radio"
        )
    if others := [name for name in policy.columns if name not in _COLUMNS]:
        raise ValueError(
            f"policy={label(policy)}: reads the column {others[0]!r}, which only a world has; a controller has "
            f"{', '.join(_COLUMNS)}"
        )
    if policy.decides_together:
        raise ValueError(f"policy={label(policy)}: decides for all robots together, which only a world can ask")
