"""World.record: what is written when, and what is refused."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import mesa
import numpy as np
import pytest

from teamsight import CMOMMT, Box, Robot, Target, World
from teamsight.agents.reused_worlds import ReusedWorlds
from teamsight.view.page import MARK
from teamsight.view.replay import Replay


def world(**settings: Any) -> CMOMMT:
    return CMOMMT(**{"rng": 3, "robots": 4, "targets": 3, "radius": 2.0, **settings})


def times(replay: Replay) -> list[float]:
    return [frame.time for frame in replay.frames]


@pytest.fixture
def page(tmp_path: Path) -> Path:
    return tmp_path / "run.html"


@pytest.mark.short
def test_a_run_is_made_recorded_and_written(page: Path) -> None:
    model = world()
    replay = model.record(page, steps=20)
    assert model.tick == 20
    assert times(replay) == times(Replay.open(page)) == list(range(21))
    assert page.read_text("utf-8").startswith(MARK)
    assert not replay.is_recording
    assert "seed 3" in repr(replay)
    assert "21 frames" in repr(replay)


def test_a_block_writes_also_after_an_error_that_goes_on(page: Path) -> None:
    model = world()
    with pytest.raises(RuntimeError, match="of the user"), model.record(page) as replay:
        model.run(5)
        assert len(replay) == 6
        assert not page.exists()
        raise RuntimeError("of the user")
    assert times(Replay.open(page)) == list(range(6))
    model.run(3)
    assert len(replay) == 6


def test_an_error_of_the_file_does_not_hide_that_of_the_block(page: Path) -> None:
    model = world()
    with pytest.raises(RuntimeError, match="of the user") as caught, model.record(page):
        page.write_text("a letter")
        raise RuntimeError("of the user")
    assert "holds something else" in caught.value.__notes__[0]
    assert page.read_text() == "a letter"


def test_a_step_that_fails_leaves_what_was_before(page: Path) -> None:
    def fails(percept: Any, rng: Any) -> tuple[float, float]:
        if model.tick == 4:
            raise RuntimeError("of the policy")
        return 0.0, 0.1

    model = World(Box(4, 4), rng=1)
    model.add(Robot, 2, policy=fails)
    with pytest.warns(UserWarning, match="is Python"), pytest.raises(RuntimeError, match="of the policy"):
        model.record(page, steps=9)
    assert times(Replay.open(page)) == list(range(5))


def test_stop_and_close_write_once(page: Path, tmp_path: Path) -> None:
    model = world()
    replay = model.record(page)
    model.record(tmp_path / "other.html", every=4)
    model.run(6)
    assert replay.stop() is replay.stop()
    assert page.exists()
    model.run(3)
    model.close()
    assert times(Replay.open(page)) == list(range(7))
    assert times(Replay.open(tmp_path / "other.html")) == [0, 4, 8]


def test_what_is_discarded_is_not_written(page: Path) -> None:
    model = world()
    replay = model.record(page)
    model.run(3)
    replay.discard()
    replay.stop()
    model.close()
    assert not page.exists()
    assert times(replay) == [0, 1, 2, 3]


def test_groups_that_are_added_later_are_recorded() -> None:
    model = world()
    replay = model.record()
    model.run(2)
    others = model.add(Robot, 2, policy="stationary", name="others")
    model.senses(others, model.targets, as_="seen")
    model.run(2)
    assert [group.name for group in replay.scene.groups] == ["robots", "targets", "others"]
    assert [len(frame) for frame in replay.frames] == [7, 7, 9, 9, 9]
    assert [[len(frame.links) for frame in replay.frames]] == [[3] * 5]
    assert len(replay.frames[0].links[2]) == 0


def test_the_end_of_the_program_writes_what_is_left(page: Path) -> None:
    script = (
        "from teamsight import CMOMMT\n"
        "def run():\n"
        "    model = CMOMMT(rng=1, robots=3, targets=2)\n"
        f"    model.record({str(page)!r}, title='left')\n"
        "    model.run(7)\n"
        "run()\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True, cwd=page.parent, capture_output=True)
    replay = Replay.open(page)
    assert times(replay) == list(range(8))
    assert replay.title == "left"


def test_a_reset_begins_anew_and_a_state_drops_what_follows_it() -> None:
    model = world()
    model.run(3)
    replay = model.record(every=2)
    assert times(replay) == [3]
    model.run(4)
    state = model.state()
    model.run(5)
    assert times(replay) == [3, 4, 6, 8, 10, 12]
    model.restore(state)
    assert times(replay) == [3, 4, 6]
    model.run(2)
    assert times(replay) == [3, 4, 6, 8]
    model.reset()
    assert times(replay) == [0]
    model.run(2)
    model.reset(9)
    model.run(4)
    assert times(replay) == [0, 2, 4]
    assert replay.scene.seed == 9
    twin = world(rng=9)
    fresh = twin.record(steps=4)
    np.testing.assert_array_equal(fresh.frames[-1].x, replay.frames[-1].x)


def test_a_state_of_another_seed_begins_anew() -> None:
    model, other = world(), world(rng=8)
    other.run(5)
    replay = model.record()
    model.run(9)
    model.restore(other.state())
    assert times(replay) == [5]


def test_the_present_alone_is_a_recording(page: Path) -> None:
    model = world()
    model.record(page).stop()
    (frame,) = Replay.open(page).frames
    assert frame.time == 0
    # Agents that are moved before the first step are drawn where the run begins.
    replay = model.record()
    model.robots[0].position = (0.5, 0.25)
    low, high = model.arena.bounds
    model.run(1)
    place = replay.frames[0].positions(replay.scene.bounds)[0]
    np.testing.assert_allclose(place, (0.5, 0.25), atol=float(np.max(high - low)) / 65_535)


def test_slots_stay_while_agents_come_and_go() -> None:
    model = world()
    replay = model.record()
    model.run(2)
    gone = model.robots[0]
    gone.remove()
    (new,) = model.robots.add(1)
    model.run(2)
    scene, frames = replay.scene, replay.frames
    assert [slot.id for slot in scene.slots][-1] == new.unique_id
    assert [len(frame) for frame in frames] == [7, 7, 8, 8, 8]
    slot = [slot.id for slot in scene.slots].index(gone.unique_id)
    assert [bool(frame.flags[slot]) for frame in frames] == [True, True, False, False, False]


def test_the_scene_says_what_the_groups_are() -> None:
    model = world(awareness="ring", delta=8, policy="centroid", awareness_range=1.5)
    replay = model.record(title="seven")
    robots, targets = replay.scene.groups
    assert (robots.role, robots.policy, robots.team) == ("robot", "centroid", "robots")
    assert dict(robots.awareness or {}) == {"name": "ring", "delta": 8}
    assert (targets.role, targets.team, targets.awareness) == ("target", None, None)
    assert {slot.awareness_range for slot in replay.scene.slots[:4]} == {1.5}
    assert (replay.title, replay.scene.model, replay.scene.series[0]) == ("seven", "CMOMMT", "observed")
    assert [(one.name, one.counts) for one in replay.scene.links] == [("teammates", False), ("targets", True)]


def test_two_runs_stand_side_by_side(tmp_path: Path) -> None:
    both = world().record(steps=5).beside(world(policy="random-walk").record(steps=9))
    both.save(tmp_path / "both.html")
    again = Replay.open(tmp_path / "both.html")
    assert [len(track.frames) for track in again.tracks] == [6, 10]
    assert len(again) == 10
    assert again.title == "CMOMMT, a-cmommt, seed 3 · CMOMMT, random-walk, seed 3"
    with pytest.raises(ValueError, match="3 runs"):
        both.beside(world().record())


def test_a_notebook_shows_it_while_it_grows() -> None:
    model = world()
    replay = model.record()
    model.run(4)
    shown = replay._repr_html_()
    assert shown.startswith("<iframe title=")
    assert 'sandbox="allow-scripts' in shown
    assert shown.count("<") == 2
    assert "recording" in repr(replay)
    model.run(4)
    assert len(replay) == 9


def test_a_cell_that_is_run_again_writes_its_file_again(page: Path) -> None:
    for steps in (4, 6):
        model = world()
        replay = model.record(page)
        model.run(steps)
    replay.stop()
    assert times(Replay.open(page)) == list(range(7))


@pytest.mark.short
def test_a_file_of_the_user_is_not_replaced(page: Path) -> None:
    page.write_text("a letter")
    model = world()
    with pytest.raises(ValueError, match=r"run\.html: holds something else.*force=True"):
        model.record(page, steps=3)
    assert model.tick == 0
    model.record(page, steps=3, force=True)
    model.record(page, steps=2)
    assert len(Replay.open(page)) == 3


@pytest.mark.short
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"file": "run.htm"}, r"run\.htm: must end in \.html, \.gif, \.mp4, \.png"),
        ({"file": "run"}, "must end in"),
        ({"file": "run.txt"}, "must end in"),
        ({"file": 3}, "file=3: must be a path"),
        ({"file": "no/such/folder/run.html"}, "no folder"),
        ({"file": "~/run.html"}, "~ is not expanded"),
        ({"every": 0}, "every=0: must be at least 1"),
        ({"steps": -1}, "steps=-1: must be at least 0"),
        ({"steps": 2.5}, "steps=2.5"),
        ({"title": 3}, "title=3"),
        ({"force": 1}, "force=1"),
    ],
)


def test_bad_input_is_refused_before_anything_is_done(arguments: dict[str, Any], message: str) -> None:
    model = world()
    with pytest.raises((TypeError, ValueError), match=message) as caught:
        model.record(**arguments)
    assert "\n" not in str(caught.value)
    assert model._data.watchers == []
    assert model.tick == 0


def test_nothing_to_draw_is_refused() -> None:
    with pytest.raises(ValueError, match="no agents"):
        World(Box(4, 4), rng=1).record()
    with pytest.raises(TypeError, match=r"plain mesa model have none"):
        Replay([mesa.Model()])  # type: ignore[list-item]
    with pytest.raises(TypeError, match="must be a replay"):
        world().record().beside(3)  # type: ignore[arg-type]


@pytest.mark.parametrize(("content", "message"), [(b"a letter", "not a recording"), (b"\xff\xfe", "not UTF-8")])
def test_other_files_are_not_opened(page: Path, content: bytes, message: str) -> None:
    page.write_bytes(content)
    with pytest.raises(ValueError, match=rf"run\.html: .*{message}"):
        Replay.open(page)
    with pytest.raises(ValueError, match="cannot be read"):
        Replay.open(page.parent / "none.html")


def test_films_and_pictures_are_written_and_known_again(tmp_path: Path) -> None:
    replay = world().record(steps=3)
    for name, start in (("run.gif", b"GIF89a"), ("run.PNG", b"\x89PNG")):
        place = replay.save(tmp_path / name, width=200)
        assert place.read_bytes().startswith(start)
        replay.save(place, width=200)
    with pytest.raises(ValueError, match="frame=4: must be at most 3"):
        replay.save(tmp_path / "run.png", frame=4)
    with pytest.raises(ValueError, match=r"scale=5: must be at most 4"):
        replay.save(tmp_path / "run.png", scale=5)
    with pytest.raises(ValueError, match=r"fps=60.*at most 50"):
        replay.save(tmp_path / "run.gif", fps=60)


def test_an_mp4_is_written_or_its_package_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    replay = world().record(steps=2)
    place = tmp_path / "run.mp4"
    pytest.importorskip("imageio_ffmpeg")
    for _ in range(2):
        assert replay.save(place, width=200).read_bytes()[4:8] == b"ftyp"
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(ImportError, match=r"pip install 'teamsight\[video\]'"):
        world().record(tmp_path / "other.mp4")


def test_worlds_that_are_used_again_do_not_share_a_recording(tmp_path: Path) -> None:
    worlds = ReusedWorlds()
    for seed in range(3):
        model = worlds.begin(CMOMMT, {"robots": 3, "targets": 2, "radius": 2.0}, seed)
        model.record(tmp_path / f"{seed}.html")
        model.run(4)
    worlds.close()
    for seed in range(3):
        replay = Replay.open(tmp_path / f"{seed}.html")
        assert (replay.scene.seed, times(replay)) == (seed, list(range(5)))


def test_thirty_bodies_and_600_steps_take_less_than_three_megabytes(page: Path) -> None:
    world(robots=15, targets=15, radius=5.0).record(page, steps=600)
    assert page.stat().st_size < 400_000


def test_more_agents_than_slots_end_the_recording(monkeypatch: pytest.MonkeyPatch) -> None:
    from teamsight.agents.recording import frames as frame_recorder

    monkeypatch.setattr(frame_recorder, "MOST_SLOTS", 9)
    model = World(Box(4, 4), rng=1)
    robots = model.add(Robot, 5, policy="random-walk")
    model.senses(robots, model.add(Target, 3, policy="random-walk"))
    replay = model.record()
    model.run(2)
    robots.add(2)
    with pytest.warns(UserWarning, match="the recording ends at tick 2"):
        model.run(2)
    assert times(replay) == [0, 1, 2]


def test_half_a_character_in_a_title_loses_no_run(page: Path) -> None:
    world().record(page, steps=2, title="a \ud800 run")
    assert Replay.open(page).title == "a ? run"
    assert "<noscript>" in page.read_text("utf-8")
