"""A page to which frames are added one by one, as in a live run."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from replaying import drawn, recorded, until

from teamsight import CMOMMT
from teamsight.view import Replay
from teamsight.view.packing import raw
from teamsight.view.page import asset

if TYPE_CHECKING:
    from playwright.sync_api import Page

STEPS = 60

_SCRIPT = """
const view = teamsight.view = new teamsight.View(document.getElementById("teamsight"), { live: true, title: "live" });
const blocks = BLOCKS.map(text => Uint8Array.from(atob(text), one => one.charCodeAt(0)));
const scene = SCENE;
for (const track of [0, 1]) view.setScene(track, scene);
function add(from, count) {
  for (let k = from; k < from + count; k++) for (const track of [0, 1]) {
    const frame = teamsight.decodeFrame(blocks[k % blocks.length].slice(), scene);
    frame.time = k;
    view.append(track, frame);
  }
}
"""


def run() -> Replay:
    return recorded(CMOMMT(robots=8, targets=8, rng=3, awareness="ring", delta=8), STEPS)


@pytest.fixture
def track() -> Replay:
    return run()


@pytest.fixture
def growing(page: Page, tmp_path: Path, track: Replay) -> Page:
    """A live page without a frame; ``add(from, count)`` adds frames."""
    blocks = [base64.b64encode(raw(frame, track.scene)).decode() for frame in track.frames]
    script = _SCRIPT.replace("BLOCKS", json.dumps(blocks)).replace("SCENE", json.dumps(track.scene.as_json()))
    file = tmp_path / "live.html"
    file.write_text(
        f"<!doctype html><meta charset=utf-8><title>live</title><style>{asset('view.css')}</style>"
        f"<main id=teamsight></main><script>{asset('view.js')}</script><script>{script}</script>", "utf-8",
    )  # fmt: skip
    page.goto(file.as_uri())
    return page


def shown(page: Page) -> float:
    page.evaluate("view.draw()")
    found: float = page.evaluate("view.shownTime")
    return found


def test_the_newest_frame_is_shown_until_one_looks_back(growing: Page, track: Replay) -> None:
    growing.evaluate("add(0, 30)")
    assert shown(growing) == 29
    growing.keyboard.press("ArrowLeft")
    assert growing.evaluate("[view.following, view.position]") == [False, 28]
    growing.evaluate("add(30, 10)")
    assert shown(growing) == 28
    growing.keyboard.press("End")
    growing.evaluate("add(40, 5)")
    assert (shown(growing), growing.evaluate("view.following")) == (44, True)
    bounds, frame = track.scene.bounds, track.frames[44]
    places = drawn(growing)
    for slot, place in zip(track.scene.slots, frame.positions(bounds).tolist(), strict=True):
        assert places[slot.id] == pytest.approx(place, abs=1e-6)


def test_it_plays_on_to_the_newest_frame(growing: Page) -> None:
    growing.evaluate("add(0, 30); view.show(20); view.play()")
    until(growing, "view.following && view.position === 29")


def test_frames_read_as_they_were_written(growing: Page, track: Replay) -> None:
    growing.evaluate("add(0, 61)")
    for number in (0, 33, STEPS):
        frame = track.frames[number]
        found = growing.evaluate(
            """k => { const one = view.tracks[0].frames[k], plain = list => [...list]; return [one.time, plain(one.series),
            ...[one.x, one.y, one.heading, one.flags].map(plain), one.links.map(list => [list.source, list.target].map(plain))]; }""",
            number,
        )
        held = [frame.time, frame.series, frame.x, frame.y, frame.heading, frame.flags]
        assert found[:6] == [value if isinstance(value, float) else value.tolist() for value in held]
        assert found[6] == [[one.source.tolist(), one.target.tolist()] for one in frame.links]


@pytest.mark.parametrize("spoil", ["blocks[0].slice(0, -1)", "new Uint8Array([...blocks[0], 0])", "new Uint8Array(3)"])
def test_broken_blocks_are_refused(growing: Page, spoil: str) -> None:
    message = growing.evaluate(
        f"() => {{ try {{ teamsight.decodeFrame({spoil}, scene); }} catch (error) {{ return error.message; }} }}"
    )
    assert "bytes" in message


def test_memory_is_bounded(growing: Page) -> None:
    growing.evaluate("view.keep = 500; add(0, 1000); view.draw(); gc();")
    before = growing.evaluate("performance.memory.usedJSHeapSize")
    growing.evaluate("add(1000, 2000); view.draw(); gc();")
    assert growing.evaluate("view.tracks[0].frames.length") <= 500
    assert shown(growing) == 2999
    assert growing.evaluate("performance.memory.usedJSHeapSize") < before + 1e6
    growing.evaluate("view.keep = 1e9; view.keepBytes = 20000; add(3000, 200)")
    assert growing.evaluate("view.tracks[0].bytes") <= 20000


def test_looking_back_stays_at_its_frame_while_old_ones_are_dropped(growing: Page) -> None:
    growing.evaluate("view.keep = 100; add(0, 100); view.show(60); add(100, 30)")
    assert shown(growing) == 60


def test_a_restart_begins_anew(growing: Page) -> None:
    growing.evaluate("add(0, 50); view.draw(); view.select(1, 3); add(0, 3)")
    assert shown(growing) == 2
    assert growing.evaluate("[view.tracks[0].frames.length, view.tracks[1].frames.length]") == [3, 3]
    fewer = "({...scene, slots: scene.slots.slice(0, 2), bounds: [0, 0, 1, 1]})"
    growing.evaluate(f"view.setScene(1, {fewer}); view.draw()")
    assert growing.evaluate("[view.tracks[1].frames.length, view.selected.slot]") == [0, None]


def test_a_tick_that_comes_again_replaces_the_frame(growing: Page) -> None:
    growing.evaluate("add(0, 10); add(9, 1)")
    assert growing.evaluate("view.tracks[0].frames.length") == 10


def test_a_live_page_may_run_the_model_instead(growing: Page) -> None:
    growing.evaluate("""add(0, 5); window.asked = []; view.transport = { running: false,
        play() { asked.push("play"); this.running = true; view.showState(); return true; },
        pause() { asked.push("pause"); this.running = false; view.showState(); return true; },
        step(count) { asked.push(count); return count > 0; } }""")
    growing.keyboard.press("Space")
    growing.get_by_role("button", name="Pause").click()
    growing.keyboard.press("ArrowRight")
    growing.keyboard.press("ArrowLeft")
    assert growing.evaluate("asked") == ["play", "pause", 1, -1]
    assert growing.evaluate("view.position") == 3


def test_selecting_is_announced(growing: Page) -> None:
    growing.evaluate("add(0, 5); window.chosen = []; view.onselect = one => chosen.push(one.slot); 0")
    growing.keyboard.press("]")
    growing.keyboard.press("]")
    growing.keyboard.press("Escape")
    assert growing.evaluate("chosen") == [0, 1, None]
    assert growing.evaluate("document.getElementById('ts-status').textContent").startswith("robots 2. Senses ")


def test_the_inspector_shows_the_last_frame_that_came(growing: Page, track: Replay) -> None:
    growing.evaluate("add(0, 5); view.select(0, 0); view.draw(); add(5, 50)")
    x, y = track.frames[54].positions(track.scene.bounds)[0]
    until(growing, f"document.querySelector('.ts-inspector').innerText.includes('({x:.3f}, {y:.3f})')")


_OFF_ZERO = """() => {
  const { view } = teamsight, chart = view.charts.find(({ difference }) => difference), { left, right, low } = chart.box;
  const width = right - left, { data } = chart.to.getImageData(left, 0, width, low), zero = chart.py(0), rows = new Set();
  // All else in the plot is grey.
  for (let k = 0; k < data.length; k += 4) if (data[k + 2] - data[k + 1] > 20) rows.add(Math.floor(k / 4 / width));
  return [rows.size, [...rows].filter((row) => Math.abs(row + 0.5 - zero) > 1.5 * chart.ratio)];
}"""


def test_two_equal_worlds_differ_by_nothing_at_any_time(growing: Page, shot) -> None:
    """A picture may be drawn while the frame of the world on the right is on its way."""
    said = growing.evaluate("""steps => {
      const said = new Set(), put = (track, k, time) => {
        const frame = teamsight.decodeFrame(blocks[k].slice(), scene);
        frame.time = time;
        view.append(track, frame);
      };
      const draw = () => {
        view.draw();
        said.add(document.querySelector(".ts-difference .ts-values").textContent);
      };
      for (let k = 0; k <= steps; k++) for (const track of [0, 1]) { put(track, k, k); draw(); }
      // Other frames of the last time, after a change of both worlds between two steps.
      for (const k of [0, steps]) { for (const track of [0, 1]) put(track, k, steps); draw(); }
      return [...said];
    }""", STEPS)
    assert said == ["–", "±0 points"]
    drawn, off = growing.evaluate(_OFF_ZERO)
    assert drawn > 0
    assert off == []
    shot(growing, "two-equal-worlds")
