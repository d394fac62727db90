"""Interventions: what visitors do is in the event log, and in Python that gives the same world bit for bit."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT, Disc, Failures, World
from teamsight.agents.components.durations import Weibull
from teamsight.cli.look import WatchSettings
from teamsight.cli.options import Command
from teamsight.live import interventions
from teamsight.live.copying import command_of, script_of
from teamsight.live.live_page import worlds_of
from teamsight.live.protocol import parsed
from teamsight.live.worlds import Worlds
from teamsight.policies import ACmommt
from teamsight.tasks.model import TaskModel
from teamsight.tasks.named import task_of
from teamsight.tasks.pursuit import Pursuit


@pytest.fixture
def closing() -> Iterator[list[Worlds]]:
    made: list[Worlds] = []
    yield made
    for worlds in made:
        for track in worlds.tracks:
            track.world.close()


def built(closing: list[Worlds], model: Any, parameters: dict[str, Any], beside: Any = None) -> Worlds:
    worlds, _ = worlds_of(model, parameters, beside)
    worlds.replace(worlds.build(worlds.settings, worlds.seed), worlds.seed)
    closing.append(worlds)
    return worlds


def bits(world: World) -> list[bytes]:
    found = [array.tobytes() for group in world.groups for array in (group.position, group.heading, group.active)]
    history = world.recording.history.to_numpy(float)
    return [*found, history.tobytes(), np.float64(world.observed_fraction).tobytes()]


def repeated(worlds: Worlds) -> dict[str, Any]:
    names: dict[str, Any] = {}
    exec(script_of(worlds), names)
    return names


def body(world: World, group: int, row: int) -> int:
    return int(world.groups[group].identity[row])


def do(worlds: Worlds, kind: str, track: int = 0, both: bool = True, **fields: Any) -> None:
    """Do what a message of a page asks for."""
    message = parsed(json.dumps({"type": kind, "track": track, "both": both, "run": "", **fields}))
    given = {name: value for name, value in message.fields.items() if name not in ("track", "both", "run")}
    worlds.intervene(message.type, track, given, both=both)


def a_free_place(world: World) -> tuple[float, float]:
    places = np.concatenate([group.position for group in world.groups])
    x, y = max(((x, y) for x in np.linspace(-3, 3, 25) for y in np.linspace(-3, 3, 25)), key=lambda one: np.hypot(*(places - one).T).min())
    return float(x), float(y)


def a_session(worlds: Worlds) -> None:
    world = worlds.tracks[0].world
    do(worlds, "add", group=0, x=0.5, y=-0.25)
    worlds.run(30)
    do(worlds, "move", body=body(world, 0, 3), x=1.23456, y=-0.5)
    do(worlds, "move", body=body(world, 1, 2), x=0.1, y=0.7)
    do(worlds, "switch", body=body(world, 0, 1), on=False)
    worlds.run(21)
    x, y = a_free_place(world)
    do(worlds, "obstruct", shape="circle", points=[[x, y], [x + 0.02, y]])
    worlds.run(5)
    x, y = a_free_place(world)
    do(worlds, "obstruct", shape="polygon", points=[[x, y], [x + 0.02, y], [x, y + 0.02]])
    do(worlds, "remove", body=body(world, 0, 0))
    do(worlds, "add", group=1, x=0.0, y=0.0)
    worlds.run(17)
    do(worlds, "switch", body=body(world, 0, 0), on=True)
    do(worlds, "clear")
    worlds.run(9)


@pytest.mark.parametrize(
    "parameters",
    [
        {"seed": 5}, {"seed": 2, "policy": "centroid", "uniform_target_speed": True, "events": Failures(60, 20)},
        {"seed": 7, "awareness": "ring", "delta": 4, "contact": "slide", "robot_radius": 0.05, "robots": 5, "targets": 5},
        {"seed": 3, "arena_shape": "torus"}, {"seed": 3, "arena_shape": "square"},
    ],
)  # fmt: skip
def test_the_copied_python_gives_the_same_world(closing: list[Worlds], parameters: dict[str, Any]) -> None:
    worlds = built(closing, CMOMMT, parameters)
    a_session(worlds)
    world, again = worlds.tracks[0].world, repeated(worlds)["model"]
    assert again.tick == world.tick == 82
    assert bits(again) == bits(world)
    assert again.events.equals(world.events)
    logged = world.events.what.tolist()
    for what in ("joined", "moved", "inactive", "obstacle added", "left", "active", "obstacles removed"):
        assert what in logged
    # Without the interventions it is another world.
    undisturbed = CMOMMT(**parameters)
    undisturbed.run(82)
    assert bits(undisturbed) != bits(world)


def test_settings_that_were_changed_in_the_run_are_repeated(closing: list[Worlds]) -> None:
    worlds = built(closing, CMOMMT, {"seed": 3, "awareness": "ring"})
    worlds.run(10)
    for name, value in (("policy", "centroid"), ("delta", 3), ("robot_speed", 0.3), ("robot_speed", 0.05), ("sensing_range", 1.5)):
        worlds.change(worlds.tracks, name, value)
    worlds.run(10)
    world, again = worlds.tracks[0].world, repeated(worlds)["model"]
    assert bits(again) == bits(world)
    set_to = world.events[world.events.what == "set"]
    # The slider was moved to the last value before the next step.
    assert set_to.setting.tolist() == ["policy", "awareness", "robot_speed", "sensing_range"]
    assert "0.05" in set_to.value.tolist()


def test_two_worlds_meet_the_same_interventions_or_one_alone(closing: list[Worlds]) -> None:
    worlds = built(closing, CMOMMT, {"seed": 5, "awareness": "none"}, {"awareness": "pairwise"})
    a_session(worlds)
    do(worlds, "switch", track=1, both=False, body=body(worlds.tracks[1].world, 0, 2), on=False)
    worlds.run(10)
    names = repeated(worlds)
    for name, track in zip(("left", "right"), worlds.tracks, strict=True):
        assert bits(names[name]) == bits(track.world)
    assert [track.world.groups[0].active[2] for track in worlds.tracks] == [True, False]
    assert bits(names["left"]) != bits(names["right"])


def test_what_one_of_two_worlds_refuses_is_done_to_none(closing: list[Worlds]) -> None:
    worlds = built(closing, CMOMMT, {"seed": 5, "radius": 5.0}, {"radius": 3.0})
    worlds.run(5)
    before = [bits(track.world) for track in worlds.tracks]
    agent = body(worlds.tracks[0].world, 0, 0)
    for kind, fields in (
        ("move", {"body": agent, "x": 4.0, "y": 0.0}), ("add", {"group": 0, "x": 4.0, "y": 0.0}),
        ("obstruct", {"shape": "circle", "points": [[4.5, 0], [4.51, 0]]}),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=r"Disc\(radius=3\.0\)"):
            do(worlds, kind, **fields)
    assert [bits(track.world) for track in worlds.tracks] == before
    assert [len(track.world.events) for track in worlds.tracks] == [0, 0]
    assert not any(track.journal.entries for track in worlds.tracks)
    worlds.run(5)
    assert repeated(worlds)["left"].tick == 10


class Breaking(CMOMMT):
    """A world whose log breaks after what is to be logged was done."""

    def __init__(self, breaks: bool = False, process: bool = False, **parameters: Any) -> None:
        super().__init__(robots=4, targets=3, **parameters)
        self._breaks = breaks
        if process:
            self.clock.process(self._wait())

    def _wait(self) -> Any:
        yield self.clock.timeout(1000)

    def log(self, what: str, *about: Any, **details: Any) -> None:
        super().log(what, *about, **details)
        if self._breaks:
            raise RuntimeError("the disk is full")


_ACTS = {
    "move": {"x": 1.0, "y": 1.0}, "remove": {}, "switch": {"on": False}, "add": {"group": 0, "x": 1.0, "y": 1.0},
    "obstruct": {"shape": "circle", "points": [[0.0, 0.0], [0.001, 0.0]]},
}  # fmt: skip


def act(worlds: Worlds, kind: str, both: bool = True) -> None:
    place = {"body": body(worlds.tracks[0].world, 0, 1)} if kind in ("move", "remove", "switch") else {}
    do(worlds, kind, both=both, **place, **_ACTS[kind])


@pytest.mark.parametrize("kind", _ACTS)
@pytest.mark.parametrize("beside", [None, {"breaks": True}])
def test_what_fails_half_way_is_put_back_in_all_worlds(closing: list[Worlds], kind: str, beside: Any) -> None:
    # At tick 0 the world does not log by itself, so all of them fail after they were done.
    worlds = built(closing, Breaking, {"seed": 5, "breaks": beside is None}, beside)
    other = built(closing, Breaking, {"seed": 5})
    with pytest.raises(RuntimeError, match="the disk is full"):
        act(worlds, kind)
    other.run(20)
    worlds.run(20)
    for track in worlds.tracks:
        assert bits(track.world) == bits(other.tracks[0].world)
        assert track.world.arena == Disc(5.0)
        assert not len(track.world.events)
        assert not track.journal.entries


@pytest.mark.parametrize("kind", _ACTS)
def test_a_world_that_cannot_be_put_back_is_named(closing: list[Worlds], kind: str) -> None:
    worlds = built(closing, Breaking, {"seed": 5, "process": True}, {"breaks": True})
    with pytest.raises(ValueError, match=r"the disk is full .*; the left and right world may keep .* processes .*; Reset"):
        act(worlds, kind)
    # What was done in the left one is in its Python.
    assert [len(track.journal.entries) for track in worlds.tracks] == [1, 0]
    # Where that is possible nothing is done in either: those that cannot be put back come last.
    for left, right in ((True, False), (False, True)):
        worlds = built(closing, Breaking, {"seed": 5, "process": left, "breaks": left}, {"process": right, "breaks": right})
        seen = [bits(track.world) for track in worlds.tracks]
        with pytest.raises(ValueError, match=rf"the {'left' if left else 'right'} world may keep"):
            act(worlds, kind)
        assert [bits(track.world) for track in worlds.tracks][left] == seen[left]
        assert not any(track.journal.entries for track in worlds.tracks)


def test_a_refusal_touches_no_world_that_cannot_be_put_back(closing: list[Worlds]) -> None:
    worlds = built(closing, Breaking, {"seed": 5, "process": True}, {"awareness": "none"})
    with pytest.raises(ValueError, match=r"inside the arena, Disc\(radius=5.0\)$"):
        do(worlds, "move", body=body(worlds.tracks[0].world, 0, 1), x=9.0, y=0.0)
    do(worlds, "remove", track=1, both=False, body=body(worlds.tracks[1].world, 0, 1))
    seen = [bits(track.world) for track in worlds.tracks]
    with pytest.raises(ValueError, match=r"is not in both worlds; choose another, or one world$"):
        act(worlds, "move")
    assert [bits(track.world) for track in worlds.tracks] == seen


def test_a_setting_that_has_no_room_in_the_journal_is_refused_before_it_is_set(
    closing: list[Worlds], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(interventions, "MOST_INTERVENTIONS", 1)
    worlds = built(closing, CMOMMT, {"seed": 5})
    act(worlds, "move")
    with pytest.raises(ValueError, match="1 interventions: a run has at most 1; Reset"):
        worlds.change(worlds.tracks, "robot_speed", 0.3)
    assert (worlds.tracks[0].world.robots.speed != 0.3).all()


@pytest.mark.parametrize(
    ("kind", "fields", "said"),
    [
        ("move", {"body": 999, "x": 0, "y": 0}, "body=999: is not in the world any more"),
        ("move", {"body": 1, "x": 9, "y": 0}, r"position=\(9.0, 0.0\): must be .* inside the arena, Disc"),
        ("switch", {"body": 1, "on": True}, "works already"), ("clear", {}, "there are no drawn obstacles"),
        ("add", {"group": 7, "x": 0, "y": 0}, "there are 2 groups"),
        ("obstruct", {"shape": "polygon", "points": [[0, 0], [1, 1], [1, 0], [0, 1]]}, "."),
        ("obstruct", {"shape": "circle", "points": [[0, 0], [5, 0]]}, "."),
        ("obstruct", {"shape": "circle", "points": [[4.5, 4.5], [4.6, 4.5]]}, "outside of the arena"),
        ("obstruct", {"shape": "circle", "points": [[0, 0], [1, 0], [0, 1]]}, "3 for a circle"),
        ("obstruct", {"shape": "circle", "points": [[0, 0], [4, 0]]}, "would be in an obstacle; move it"),
    ],
)  # fmt: skip
def test_what_is_refused_changes_nothing(closing: list[Worlds], kind: str, fields: Any, said: str) -> None:
    worlds = built(closing, CMOMMT, {"seed": 5})
    before = bits(worlds.tracks[0].world)
    with pytest.raises((TypeError, ValueError), match=said):
        do(worlds, kind, **fields)
    assert bits(worlds.tracks[0].world) == before
    assert not worlds.tracks[0].journal.entries
    assert worlds.tracks[0].world.arena == Disc(5.0)


@pytest.mark.parametrize(
    ("message", "said"),
    [
        ({"type": "move", "track": 0, "both": True, "body": 1, "x": 1e300, "y": 0}, "at most 1e"),
        ({"type": "move", "track": 2, "both": True, "body": 1, "x": 1, "y": 0}, "track=2"),
        ({"type": "move", "track": 0, "both": 1, "body": 1, "x": 1, "y": 0}, "both=1"),
        ({"type": "obstruct", "track": 0, "both": True, "shape": "os:system", "points": [[0, 0], [1, 1]]}, "shape='os:system'"),
        ({"type": "obstruct", "track": 0, "both": True, "shape": "polygon", "points": [[0, 0]] * 65}, "2 to 64 points"),
        ({"type": "obstruct", "track": 0, "both": True, "shape": "polygon", "points": [[0, 0], [1]]}, "points=None"),
        ({"type": "obstruct", "track": 0, "both": True, "shape": "polygon", "points": [[0, 0], ["1", 2]]}, "points='1'"),
        ({"type": "copy", "form": "/etc/passwd"}, "form='/etc/passwd'"),
    ],
)  # fmt: skip
def test_wrong_messages_are_refused(message: dict[str, Any], said: str) -> None:
    with pytest.raises((TypeError, ValueError)) as error:
        parsed(json.dumps(message if message["type"] == "copy" else {**message, "run": ""}))
    assert said in str(error.value)


def test_bodies_of_a_world_of_cells_stay_in_their_centres(closing: list[Worlds]) -> None:
    worlds = built(closing, Pursuit, {"seed": 4})
    world = worlds.tracks[0].world
    do(worlds, "move", body=body(world, 0, 1), x=1.3, y=1.2)
    do(worlds, "add", group=1, x=-4.9, y=5.0)
    assert world.groups[0].position[1].tolist() == [1.5, 1.5]
    assert world.groups[1].position[-1].tolist() == [-4.5, 4.5]
    with pytest.raises(ValueError, match=r"\(5\.2, 0\.0\)"):
        do(worlds, "add", group=1, x=5.2, y=0.0)
    worlds.run(20)
    assert all((group.position % 1 == 0.5).all() for group in world.groups)
    again = repeated(worlds)["model"]
    for one, other in zip(again.groups, world.groups, strict=True):
        np.testing.assert_array_equal(one.position, other.position)
    assert again.events.equals(world.events)


@pytest.mark.parametrize("name", ["cmommt", "forage", "push"])
def test_a_task_is_repeated(closing: list[Worlds], name: str) -> None:
    worlds = built(closing, TaskModel(task_of(name)), {"treatment": "explore", "rng": 4})
    worlds.run(20)
    do(worlds, "switch", body=body(worlds.tracks[0].world, 0, 0), on=False)
    worlds.run(20)
    assert bits(repeated(worlds)["model"]) == bits(worlds.tracks[0].world)


def test_the_command_is_read_as_these_settings(closing: list[Worlds]) -> None:
    parameters = {
        "robots": 7, "policy": ACmommt(), "robot_speed": 0.25, "uniform_target_speed": True, "events": Failures(60, 20), "seed": 9,
        "arena_shape": "torus",
    }  # fmt: skip
    worlds = built(closing, CMOMMT, parameters, {"policy": "centroid", "radius": 4.5})
    words, found = shlex.split(command_of(worlds)), []
    assert words[:2] == ["teamsight", "watch"]
    Command(found.append, WatchSettings).main(words[2:], standalone_mode=False)
    (settings,) = found
    assert settings.world() == {"robots": 7, "policy": "a-cmommt", "robot_speed": 0.25, "uniform_target_speed": True, "arena_shape": "torus"}
    assert repr(settings.source_of_failures()) == repr(Failures(60, 20))
    assert settings.seed == 9
    assert settings.beside == {"policy": "centroid", "radius": 4.5}


def test_the_command_has_options_of_policies_and_says_what_it_has_not(closing: list[Worlds]) -> None:
    options = {"policy_options": {"weights": "shared", "gain": 2.5}, "target_policy_options": {"turn_probability": 0.25}}
    words, found = shlex.split(command_of(built(closing, CMOMMT, options))), []
    Command(found.append, WatchSettings).main(words[2:], standalone_mode=False)
    assert found[0].world() == options
    # A mean is not all of a duration.
    unknown: list[str] = []
    said = command_of(built(closing, CMOMMT, {"events": Failures(Weibull(50, 2))}), unknown)
    assert "--failures" not in said
    assert "# not given: events=Failures(" in said
    assert unknown[0].startswith("events=Failures(")


def test_an_obstacle_may_reach_beyond_the_wall(closing: list[Worlds]) -> None:
    worlds = built(closing, CMOMMT, {"robots": 1, "targets": 1, "radius": 8.0, "seed": 3})
    # Neither its centre nor a corner is inside of the disc.
    do(worlds, "obstruct", shape="polygon", points=[[-9, 7.5], [9, 7.5], [0, 12]])
    assert len(worlds.tracks[0].world.arena.obstacles) == 1


def test_the_script_prints_a_mean_only_where_there_is_one(closing: list[Worlds]) -> None:
    worlds = built(closing, CMOMMT, {"robots": 3})
    assert "observed" not in script_of(worlds)
    worlds.run(5)
    assert "mean observed fraction {model.observed_fraction" in script_of(worlds)


def test_words_of_a_shell_are_quoted(closing: list[Worlds]) -> None:
    def odd(name: str = "a", seed: int = 0) -> World:
        return CMOMMT(seed=seed)

    worlds = built(closing, odd, {"name": "it's $(rm -rf /); `x`"})
    assert "name=it's $(rm -rf /); `x`" in shlex.split(command_of(worlds))
