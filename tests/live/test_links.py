"""Links: what a page's address says is restored, or refused with a reason."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any
from urllib.parse import parse_qs, urlencode

import live_models
import pytest
from hypothesis import given as drawn
from hypothesis import strategies as st

from teamsight import CMOMMT, Failures
from teamsight.agents.awareness import RelayedAwareness, RingAwareness
from teamsight.agents.components.durations import Weibull
from teamsight.agents.sensing.sensor import Sensor
from teamsight.core.component import declared
from teamsight.live import links
from teamsight.live.interventions import Act, Place
from teamsight.live.links import Opened
from teamsight.live.live_page import worlds_of
from teamsight.live.worlds import Worlds, value_of
from teamsight.policies import ACmommt, Centroid
from teamsight.tasks.model import TaskModel
from teamsight.tasks.named import task_of

_GIVEN = {"robots": 30, "policy": "centroid", "sensor": Sensor(missed=0.25)}


def opened(text: str, given: Any = None, model: Any = CMOMMT) -> Opened:
    worlds, controls = worlds_of(model, dict(given or {}), None)
    return links.opened(links.read(text), model, controls, worlds.settings[0])


def test_what_a_link_names_is_set_and_all_else_has_its_default() -> None:
    link = {"v": 1, "task": "CMOMMT", "seed": 2**62 + 1, "tick": 120, "robots": 12, "uniform_target_speed": "true", "robot_speed": 0.25}
    settings, seed, tick, acts = opened(urlencode(link), _GIVEN)
    # A sensor can be in no link, so it stays.
    assert settings == [{"sensor": _GIVEN["sensor"], "robots": 12, "uniform_target_speed": True, "robot_speed": 0.25}]
    assert (seed, tick, acts) == (2**62 + 1, 120, [[]])


def test_a_link_of_two_worlds() -> None:
    settings, seed, tick, acts = opened("v=1&task=CMOMMT&two=yes&robots=4&awareness=none&right.awareness=ring")
    assert settings == [{"robots": 4, "awareness": "none"}, {"robots": 4, "awareness": "ring"}]
    assert (seed, tick, acts) == (None, 0, [[], []])


def test_failures_and_options_are_carried() -> None:
    text = "v=1&task=CMOMMT&policy=a-cmommt&policy.gain=2&awareness=ring&awareness.delta=3&failures=200&repair=50&policy_options.arrive=false"
    (settings,), _, _, _ = opened(text.replace("&policy_options.arrive=false", ""), {"events": Failures(1e6)})
    assert repr(settings.pop("events")) == repr(Failures(200, 50))
    assert settings == {"policy": ACmommt(gain=2.0), "awareness": RingAwareness(3)}
    # Without any, robots do not fail, whatever the page was started with.
    assert opened("v=1&task=CMOMMT&policy=centroid&policy_options.arrive=false", {"events": Failures(1e6)}).settings == [
        {"policy": "centroid", "policy_options": {"arrive": False}}
    ]


@pytest.fixture
def built() -> Iterator[Callable[..., tuple[Worlds, Any]]]:
    """Builds worlds, and closes them."""
    made: list[Worlds] = []

    def build(parameters: Any, beside: Any = None, model: Any = CMOMMT) -> tuple[Worlds, Any]:
        worlds, controls = worlds_of(model, dict(parameters), beside)
        worlds.replace(worlds.build(worlds.settings, worlds.seed), worlds.seed)
        made.append(worlds)
        return worlds, controls

    yield build
    for worlds in made:
        for track in worlds.tracks:
            track.world.close()


@pytest.mark.parametrize(
    ("parameters", "beside"),
    [
        ({}, None), ({"robots": 3, "policy": ACmommt(weights="shared", gain=0.5)}, {"policy": Centroid()}),
        ({"policy": ACmommt()}, {"policy": "a-cmommt"}), ({"awareness": RingAwareness(5), "cycle": 3}, {"awareness": "none", "cycle": 1}),
        ({"policy": "a-cmommt", "policy_options": {"gain": 2.0, "weights": "shared"}}, None),
        ({"target_policy_options": {"turn_probability": 0.25}}, {"target_policy": "evasive", "target_policy_options": {}}),
        ({"drive": "car", "contact": "slide", "robot_radius": 0.05, "uniform_target_speed": True}, {"radius": 4.25}),
        ({"robots": 2000, "radius": 70.5}, {"robots": 10}), ({"arena_shape": "torus"}, {"arena_shape": "disc"}),
    ],
)  # fmt: skip
def test_what_is_written_is_read_again(built: Any, parameters: Any, beside: Any) -> None:
    worlds, controls = built({**parameters, "seed": 2**60}, beside)
    text, said = links.written(worlds, controls, running=False)
    again = opened(text)
    assert again.seed == 2**60
    for one, other in zip(again.settings, worlds.settings, strict=True):
        for name in declared(CMOMMT):
            assert (value_of(CMOMMT, one, name) or None) == (value_of(CMOMMT, other, name) or None), name
    assert not said


def test_a_preset_is_written_and_read_where_none_was_given(built: Any) -> None:
    text, said = links.written(*built({"preset": "touzet2000"}), running=False)
    assert not said
    assert opened(text).settings == [{"preset": "touzet2000"}]
    with pytest.raises(ValueError, match="preset='/etc/passwd': unknown"):
        opened(text.replace("touzet2000", "/etc/passwd"))


def test_failures_are_written(built: Any) -> None:
    worlds, controls = built({"robots": 3}, {"events": Failures(200, 50)})
    text, said = links.written(worlds, controls, running=False)
    assert parse_qs(text)["right.failures"] == ["200.0"]
    assert [repr(one.get("events")) for one in opened(text).settings] == ["None", repr(Failures(200, 50))]
    assert not said


@pytest.mark.parametrize(
    "given",
    [{"events": Failures(Weibull(50.0, 2.0))}, {"events": Failures(0.5)}, {"sensor": Sensor(missed=0.25)}, {"awareness": RelayedAwareness(hops=2)},
     {"events": [Failures(9), Failures(8)]}, {"policy": lambda percept, rng: (0.0, 0.0)}],
)  # fmt: skip
def test_what_a_link_cannot_carry_is_said(built: Any, given: Any) -> None:
    worlds, controls = built({"robots": 3, **given})
    text, said = links.written(worlds, controls, running=False)
    (sentence,) = said
    assert sentence.startswith(f"{next(iter(given))}=")
    assert "known only to a page that was started with it" in sentence
    # A page that was started with it goes there.
    (settings,) = opened(text, given).settings
    assert settings == {"robots": 3, **given}


def acted(worlds: Worlds) -> None:
    worlds.run(3)
    for name, value in (("delta", 3), ("awareness", "ring"), ("policy", "centroid"), ("robot_speed", 0.3), ("robot_speed", 0.25)):
        worlds.change(worlds.tracks, name, value)
    worlds.run(2)
    world = worlds.tracks[0].world
    worlds.intervene("move", 0, {"body": int(world.groups[0].identity[1]), "x": 0.125, "y": -1e-7}, both=True)
    worlds.intervene("switch", 0, {"body": int(world.groups[1].identity[0]), "on": False}, both=True)
    worlds.intervene("add", 0, {"group": 1, "x": 0.5, "y": 2.0}, both=True)
    worlds.run(1)


def test_what_was_done_is_written_and_read(built: Any) -> None:
    worlds, controls = built({"robots": 3, "targets": 3}, {"radius": 4.0})
    acted(worlds)
    text, said = links.written(worlds, controls, running=False)
    assert not said
    settings, _, tick, acts = opened(text)
    # As it was built, before the settings were changed.
    assert settings == [{"robots": 3, "targets": 3}, {"robots": 3, "targets": 3, "radius": 4.0}]
    assert tick == 6
    expected = [
        (3, Act("set", {"name": "delta", "value": 3})), (3, Act("set", {"name": "awareness", "value": "ring"})),
        (3, Act("set", {"name": "policy", "value": "centroid"})), (3, Act("set", {"name": "robot_speed", "value": 0.25})),
        (5, Act("move", {"place": Place(0, 1), "x": 0.125, "y": -1e-7})), (5, Act("switch", {"place": Place(1, 0), "on": False})),
        (5, Act("add", {"number": 1, "x": 0.5, "y": 2.0})),
    ]  # fmt: skip
    assert acts == [expected, expected]
    # Both in one text; and what only one of them met, in another.
    assert text.count("did=") == 1
    worlds.intervene("remove", 1, {"body": int(worlds.tracks[1].world.groups[0].identity[0])}, both=False)
    left, right = opened(links.written(worlds, controls, running=False)[0]).acts
    assert (left, right) == (expected, [*expected, (6, Act("remove", {"place": Place(0, 0)}))])


def test_a_long_log_and_a_run_are_said(built: Any) -> None:
    worlds, controls = built({"robots": 3, "targets": 3})
    acted(worlds)
    for running, most, sentences in ((True, 2000, 2), (False, 100, 1)):
        text, said = links.written(worlds, controls, running=running, most=most)
        assert len(said) == sentences
        assert "What was done to the worlds is not in the link" in said[-1]
        fields = parse_qs(text)
        assert "did" not in fields
        # Then it has the present settings.
        assert fields["policy"] == ["centroid"]
        assert ("tick" in fields) != running


def test_links_of_other_models(built: Any) -> None:
    worlds, controls = built({"hives": 5, "shape": "other"}, model=live_models.hives)
    text, said = links.written(worlds, controls, running=False)
    assert (opened(text, model=live_models.hives).settings, said) == ([{"hives": 5, "shape": "other"}], [])
    model = TaskModel(task_of("cmommt"))
    worlds, controls = built({"treatment": "explore", "robots": 4, "events": Failures(30)}, model=model)
    (settings,) = opened(links.written(worlds, controls, running=False)[0], model=model).settings
    assert repr(settings) == repr({"treatment": "explore", "robots": 4, "events": Failures(30)})
    # Whose robots do not fail.
    with pytest.raises(ValueError, match="link='failures': unknown"):
        opened("v=1&task=hives&failures=30", model=live_models.hives)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "damaged"), ("v=1", "must have v and task"), ("%%%", "damaged"), ("v=1&task=CMOMMT&robots", "damaged"),
        ("v=2&task=CMOMMT", "of version '2', and this page reads 1"), ("v=1&task=CMOMMT&robots=3&robots=4", "each name once"),
        ("v=1&task=CMOMMT&robots=-1", "robots=-1"), ("v=1&task=CMOMMT&robots=1e9", "robots="), ("v=1&task=CMOMMT&robots=x", "robots='x'"),
        ("v=1&task=CMOMMT&tick=99999999", "tick=99999999: must be at most 1000000"), ("v=1&task=CMOMMT&tick=-1", "tick=-1"),
        ("v=1&task=CMOMMT&policy=os:system", "policy='os:system'"), ("v=1&task=CMOMMT&awareness=/etc/passwd", "awareness="),
        ("v=1&task=CMOMMT&events=1", "'events': unknown"), ("v=1&task=CMOMMT&__class__=1", "unknown"),
        ("v=1&task=CMOMMT&two=maybe", "two='maybe'"), ("v=1&task=CMOMMT&right.robots=3", "cannot be set by a link"), ("v=1&task=CMOMMT&seed=-4", "seed="),
        ("v=1&task=CMOMMT&policy.gain=3", "give policy by its name too"), ("v=1&task=CMOMMT&policy=a-cmommt&policy.gain=x", "policy.gain='x'"),
        ("v=1&task=CMOMMT&policy=a-cmommt&policy.__class__=3", "'__class__': unknown"), ("v=1&task=CMOMMT&policy=ppo&policy.file=/etc/passwd", "cannot be set by a link"),
        ("v=1&task=CMOMMT&policy=os:system&policy.gain=3", "give policy by its name too"), ("v=1&task=CMOMMT&policy=a-cmommt&policy.target_tracks=1000000", "at most 64"),
        ("v=1&task=CMOMMT&robots=3&robots.gain=3", "give robots by its name too"), ("v=1&task=CMOMMT&policy_options=x", "unknown"),
        ("v=1&task=CMOMMT&policy_options.gain=x", "policy.gain='x'"), ("v=1&task=CMOMMT&failures=1e-6", "failures=1e-06: must be a finite number, at least 1"),
        ("v=1&task=CMOMMT&repair=9", "failures=''"), ("v=1&task=CMOMMT&failures=9&repair=nan", "repair=nan"),
        ("v=1&task=CMOMMT&did=5+clear", "did=5: must be at most 0"),
        ("v=1&task=CMOMMT&tick=9&did=5+clear*4+clear", "did=4: must be at least 5"), ("v=1&task=CMOMMT&tick=9&did=x", "did='x'"),
        ("v=1&task=CMOMMT&tick=9&did=5", "did='': unknown"), ("v=1&task=CMOMMT&tick=9&did=5+_undoing", "unknown"),
        ("v=1&task=CMOMMT&tick=9&did=5+move+0+0+1", "is damaged"), ("v=1&task=CMOMMT&tick=9&did=5+move+0+0+1+1e300", "y=1e+300: must be a finite number"),
        ("v=1&task=CMOMMT&tick=9&did=5+move+-1+0+1+1", "group=-1"), ("v=1&task=CMOMMT&tick=9&did=5+switch+0+0+2", "on=2"),
        ("v=1&task=CMOMMT&tick=9&did=5+obstruct+circle+1+1+2", "is damaged"), ("v=1&task=CMOMMT&tick=9&did=5+obstruct+import+1+1+2+2", "shape='import'"),
        ("v=1&task=CMOMMT&tick=9&did=5+obstruct+polygon" + "+0" * 200, "2 to 64 points"), ("v=1&task=CMOMMT&tick=9&did=5+set", "is damaged"),
        ("v=1&task=CMOMMT&tick=9&did=5+set+robots+3", "cannot be set in a run"), ("v=1&task=CMOMMT&tick=9&did=5+set+seed+3", "cannot be set in a run"),
        ("v=1&task=CMOMMT&tick=9&did=5+set+policy+os:system", "policy='os:system'"), ("v=1&task=CMOMMT&tick=9&did=5+set+policy.gain+3", "give policy by its name too"),
        ("v=1&task=CMOMMT&tick=9&did=5+set+robot_speed+99", "robot_speed=99"), ("v=1&task=CMOMMT&tick=9&did=5+set+policy+ppo+policy.file+/etc/passwd", "cannot be set by a link"),
        ("v=1&task=CMOMMT&" + "&".join(f"a{k}=1" for k in range(300)), "damaged"),
    ],
)  # fmt: skip
def test_wrong_links_are_refused_with_a_reason(text: str, said: str) -> None:
    with pytest.raises((TypeError, ValueError)) as error:
        opened(text)
    assert said in str(error.value)


@drawn(st.text(alphabet="*+ .=&%0129-emovestpicy", max_size=60), st.sampled_from(["did", "policy.gain", "policy", "policy_options.gain", "failures", "right.did"]))
def test_nonsense_raises_nothing_else(text: str, name: str) -> None:
    worlds, controls = _CMOMMT
    try:
        link = links.read(urlencode({"v": 1, "task": "CMOMMT", "tick": 9, "two": "yes", "policy": "a-cmommt", name: text}))
        links.opened(link, CMOMMT, controls, worlds.settings[0])
    except (TypeError, ValueError) as error:
        assert "\n" not in str(error)


_CMOMMT = worlds_of(CMOMMT, {}, None)
