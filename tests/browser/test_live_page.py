"""The live page in a real browser: what it shows is what the model holds, and what is set there acts."""

from __future__ import annotations

import re
import threading
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import browsing
import live_models
import numpy as np
import pytest
from live_pages import PATIENCE, press, settled, shown, until, world_of

from teamsight import CMOMMT, Failures
from teamsight.core.kernel.report import REPORT
from teamsight.live import LivePage, session
from teamsight.live.protocol import Message
from teamsight.live.worlds import LiveTrack
from teamsight.world.contact import Slide

if TYPE_CHECKING:
    from playwright.sync_api import Page

_DRAWN = "() => teamsight.view.drawn({}).map(({{ slot, x, y }}) => [teamsight.view.tracks[{}].scene.slots[slot].id, x, y])"


def assert_same_places(page: Page, world: Any, track: int = 0) -> None:
    """Compare the positions that were drawn with the model's."""
    drawn = {int(one): (x, y) for one, x, y in page.evaluate(_DRAWN.format(track, track))}
    places = {agent.unique_id: tuple(agent.position) for group in world.groups for agent in group}
    assert drawn.keys() == places.keys()
    found = np.array([drawn[one] for one in places])
    # Half a part of the box, and the rounding of the way to pixels and back.
    np.testing.assert_allclose(found, np.array(list(places.values())), atol=0.51 * 2 * world.arena.size[0] / 65535 + 1e-6)


def test_plays_and_shows_what_the_model_holds(page: Page, live: Callable[..., LivePage]) -> None:
    server = live(parameters={"robots": 12, "targets": 9}, running=True)
    page.goto(server.url)
    page.wait_for_function("() => teamsight.view?.tracks[0]?.frames.length > 10")
    page.get_by_role("button", name="Pause the run").click()
    until(lambda: not server.session.is_running)
    settled(page, server)
    world = world_of(server)
    assert world.tick >= 10
    assert_same_places(page, world)
    state = page.evaluate("() => teamsight.live.state.tracks[0]")
    assert state["observed"] == pytest.approx(world.observed)
    assert state["most"] == world.max_neighbours
    # The graph says what the neighbour lists hold.
    links = len(world.neighbours.identity)
    page.get_by_text(f"12 robots, {links} links").wait_for()


def test_no_two_buttons_have_one_name(page: Page, live: Callable[..., LivePage]) -> None:
    server = live(beside={"awareness": "none"})
    shown(page, server)
    page.evaluate("() => { for (const one of document.querySelectorAll('details')) one.open = true; }")
    called = (
        "() => [...document.querySelectorAll('button, summary')].filter((one) => one.checkVisibility())"
        ".map((one) => one.ariaLabel || one.textContent.trim())"
    )
    standing = page.evaluate(called)
    assert "Run" in standing
    assert len(set(standing)) == len(standing), sorted(standing)
    page.get_by_role("button", name="Run", exact=True).click()
    page.get_by_role("button", name="Pause", exact=True).wait_for()
    running = page.evaluate(called)
    assert "Pause the run" in running
    assert len(set(running)) == len(running), sorted(running)


def test_run_pause_step_reset(page: Page, live: Callable[..., LivePage]) -> None:
    server = live()
    shown(page, server)
    page.get_by_role("button", name="Step", exact=True).click()
    until(lambda: world_of(server).tick == 1)
    settled(page, server)
    assert_same_places(page, world_of(server))
    press(page, "ArrowRight")
    until(lambda: world_of(server).tick == 2)
    press(page, "Space")
    until(lambda: world_of(server).tick > 8)
    page.wait_for_function("() => teamsight.live.transport.running")
    press(page, "Space")
    until(lambda: not server.session.is_running)
    settled(page, server)
    # A slow page skips frames, and never shows one twice or out of order.
    times = page.evaluate("() => teamsight.view.tracks[0].frames.map(({ time }) => time)")
    assert times[:3] == [0, 1, 2]
    assert times == sorted(set(times))
    page.get_by_role("button", name="Reset").click()
    until(lambda: world_of(server).tick == 0)
    settled(page, server)
    assert page.evaluate("() => teamsight.view.tracks[0].frames.length") == 1
    assert_same_places(page, CMOMMT(seed=5))


def test_settings_act_on_the_running_world(page: Page, live: Callable[..., LivePage]) -> None:
    server = live(parameters={"awareness": "ring", "delta": 8})
    shown(page, server)
    page.get_by_role("button", name="Step", exact=True).click()
    until(lambda: world_of(server).tick == 1)
    world = world_of(server)
    delta = page.get_by_role("slider", name="δ")
    delta.focus()
    delta.press("ArrowRight")
    until(lambda: world.robots.awareness.delta == 9)
    page.get_by_label("policy").first.select_option("centroid")
    until(lambda: type(world.robots.policy).__name__ == "Centroid")
    page.locator("#tl-awareness_range").fill("2.5")
    page.locator("#tl-awareness_range").press("Enter")
    until(lambda: (world.robots.awareness_range == 2.5).all())
    page.get_by_label("awareness", exact=True).select_option("pairwise")
    until(lambda: world.robots.awareness.name == "pairwise")
    # δ matters to the ring only.
    page.wait_for_function("() => document.querySelector('#tl-delta').disabled")
    # All of that without starting again, and the page describes it.
    assert world_of(server) is world
    assert world.tick == 1
    group = page.evaluate("() => teamsight.view.tracks[0].scene.groups[0]")
    assert group["policy"] == "centroid"
    assert page.evaluate("() => teamsight.view.tracks[0].scene.slots[0].awareness_range") == 2.5


def test_what_needs_a_new_world_starts_again(page: Page, live: Callable[..., LivePage]) -> None:
    server = live()
    shown(page, server)
    page.get_by_role("button", name="Step", exact=True).click()
    until(lambda: world_of(server).tick == 1)
    page.get_by_label("policy").first.select_option("centroid")
    page.locator("#tl-robots").fill("25")
    page.locator("#tl-robots").press("Enter")
    until(lambda: len(world_of(server).robots) == 25)
    page.wait_for_function("() => document.querySelector('.tl-note').textContent.includes('Started again with robots 25')")
    settled(page, server)
    # With the same seed, and what was set before.
    assert_same_places(page, CMOMMT(robots=25, policy="centroid", seed=5))
    page.locator("#tl-seed").fill("77")
    page.locator("#tl-seed").press("Enter")
    until(lambda: world_of(server).seed_used == 77)
    # The frames of the world before have the same tick; they go before the note comes.
    page.get_by_text("Started again with seed 77").wait_for()
    settled(page, server)
    assert_same_places(page, CMOMMT(robots=25, policy="centroid", seed=77))


def test_bodies_get_a_radius_and_contacts(page: Page, live: Callable[..., LivePage], shot: Any) -> None:
    server = live()
    shown(page, server)
    assert page.evaluate("teamsight.view.tracks[0].layout.hasRadii") is False
    page.get_by_label("contact").select_option("slide")
    until(lambda: world_of(server).contact == Slide())
    # A slider moves by its step, of which the keys make use.
    page.get_by_role("slider", name="body radius").first.focus()
    for _ in range(3):
        page.keyboard.press("ArrowRight")
    until(lambda: world_of(server).robots.radius.tolist() == [0.03] * 10)
    settled(page, server)
    page.locator("#tl-robot_radius").fill("0.4")
    page.locator("#tl-robot_radius").press("Enter")
    page.get_by_text("Started again with body radius 0.4").wait_for()
    settled(page, server)
    shot(page, "live-bodies")
    assert page.evaluate("[...teamsight.view.tracks[0].layout.radius]") == [0.4] * 10 + [0.0] * 15
    page.locator("#tl-robot_radius").fill("4")
    page.locator("#tl-robot_radius").press("Enter")
    page.get_by_role("alert").get_by_text("fit").wait_for()
    assert world_of(server).robots.radius.tolist() == [0.4] * 10


def test_seeds_are_those_that_were_typed_and_sliders_say_what_they_mean(page: Page, live: Callable[..., LivePage]) -> None:
    server, seed = live(), 2**62 + 1
    shown(page, server)
    page.locator("#tl-seed").fill(str(seed))
    page.locator("#tl-seed").press("Enter")
    until(lambda: world_of(server).seed_used == seed)
    page.get_by_text(f"Started again with seed {seed}").wait_for()
    assert page.locator("#tl-seed").input_value() == str(seed)
    page.locator("#tl-seed").fill(str(2**63))
    page.locator("#tl-seed").press("Enter")
    page.get_by_role("alert").get_by_text(f"seed {2**63}: must be at most {2**63 - 1}").wait_for()
    assert page.locator("#tl-rate").get_attribute("aria-valuetext") == "30 steps per second"
    page.locator("#tl-robots").fill("150")
    page.locator("#tl-robots").press("Enter")
    # The slider ends at 100.
    until(lambda: page.get_by_role("slider", name="robots").get_attribute("aria-valuetext") == "150")


_CONTRASTS = """() => {
  const light = (text) => {
    const parts = text.match(/[\\d.]+/g).slice(0, 3).map((one) => one / 255);
    const [r, g, b] = parts.map((one) => (one <= 0.04045 ? one / 12.92 : ((one + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const behind = (one) => (/, 0\\)$/.test(getComputedStyle(one).backgroundColor) ? behind(one.parentElement) : getComputedStyle(one).backgroundColor);
  return [...document.querySelectorAll("button")].filter((one) => one.offsetParent).map((one) => {
    const [a, b] = [light(getComputedStyle(one).color), light(behind(one))].sort((x, y) => y - x);
    return [one.ariaLabel || one.textContent, (a + 0.05) / (b + 0.05)];
  });
}"""


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_buttons_contrast_with_what_is_behind_them(
    new_page: browsing.Pages, live: Callable[..., LivePage], dark: bool, shot: Any
) -> None:
    server, page = live(), new_page(dark=dark)
    shown(page, server)
    shot(page, f"live-{'dark' if dark else 'light'}")
    contrasts = page.evaluate(_CONTRASTS)
    assert {"Play", "Run"} <= {name for name, _ in contrasts}
    # WCAG 2.2, 1.4.3 for texts; icons need 3.
    assert {name: contrast for name, contrast in contrasts if contrast < 4.5} == {}


def test_what_is_refused_is_said_and_changes_nothing(page: Page, live: Callable[..., LivePage]) -> None:
    server = live(live_models.hives)
    shown(page, server)
    world = world_of(server)
    alert = page.get_by_role("alert")
    page.locator("#tl-hives").fill("21")
    page.locator("#tl-hives").press("Enter")
    alert.get_by_text("hives 21: must be at most 20; give fewer").wait_for()
    assert world_of(server) is world
    assert page.locator("#tl-hives").input_value() == "3"
    page.get_by_role("button", name="Dismiss").click()
    # What is no control cannot be set, and no name leads to code.
    for name, value in (("__class__", 1), ("shape", "os:system"), ("hives", "os:system")):
        page.evaluate("([name, value]) => teamsight.live.link.send('set', { name, value, track: null })", [name, value])
        alert.get_by_text(f"{name} " if name in ("shape", "hives") else "name ").wait_for()
    assert world_of(server) is world
    page.locator("#tl-fast").check()
    until(lambda: world_of(server).groups[0].speed[0] == 0.2)
    assert not page.locator(".tl-alert").is_visible()
    page.locator("#tl-hives").fill("")
    page.locator("#tl-hives").press("Enter")
    alert.get_by_text("hives: must be a whole number from 0 to").wait_for()


@pytest.mark.parametrize("size", [browsing.WIDE, browsing.PHONE])
def test_what_is_refused_is_said_in_view(new_page: browsing.Pages, live: Callable[..., LivePage], size: Any) -> None:
    server, page = live(), new_page(size=size)
    shown(page, server)
    page.locator(".tl-tools input[value=remove]").check()
    # The panel at its end on a wide screen, the arena above it on a phone.
    page.evaluate("() => { document.querySelector('.ts-controls').scrollTop = 9999; scrollTo(0, 0); }")
    page.evaluate("() => teamsight.live.link.send('task', { name: 'nothing' })")
    page.get_by_text("task 'nothing': unknown").wait_for()
    assert page.evaluate("""() => {
      const { left, top } = document.querySelector(".tl-alert").getBoundingClientRect();
      return Boolean(document.elementFromPoint(left + 20, top + 12)?.closest(".tl-alert"));
    }""")
    page.get_by_role("button", name="Dismiss").click()
    assert page.get_by_role("alert").is_hidden()


def test_the_graph_counts_robots_that_work(page: Page, live: Callable[..., LivePage]) -> None:
    server = live(live_models.hives, {"hives": 9})
    shown(page, server)
    neighbours = max(len(robot.neighbours) for robot in world_of(server).groups[0])
    page.get_by_text(f"at most {neighbours} now, {neighbours} so far.").wait_for()
    robots = world_of(server).groups[0]
    while robots.active.all():
        tick = world_of(server).tick
        page.get_by_role("button", name="Step", exact=True).click()
        until(lambda tick=tick: world_of(server).tick > tick)
        settled(page, server)
    numbers = [len(robot.neighbours) for robot in robots if robot.active]
    assert len(numbers) < 9
    assert np.mean(numbers) == pytest.approx(world_of(server).mean_degree)
    page.get_by_text(f"{len(numbers)} robots, {sum(numbers)} links; neighbours: mean {np.mean(numbers):.1f}").wait_for()


def test_events_are_listed(page: Page, live: Callable[..., LivePage]) -> None:
    server = live(live_models.hives, {"hives": 8}, rate=None, running=True)
    page.goto(server.url)
    page.locator(".ts-log tbody tr").nth(5).wait_for()
    assert "failed" in page.locator(".ts-log tbody").inner_text()


def test_contacts_are_listed_by_tick(page: Page, live: Callable[..., LivePage], shot: Any) -> None:
    server = live(live_models.meeting)
    shown(page, server)
    for tick in range(1, 5):
        page.get_by_role("button", name="Step", exact=True).click()
        until(lambda tick=tick: world_of(server).tick == tick)
    settled(page, server)
    table = world_of(server).contacts
    page.get_by_text(f"Events ({len(table) + 1})").wait_for()
    log = page.locator(".ts-log tbody")
    first = table[(table.tick == 0) & (table.channel == "teammates")]
    log.get_by_role("cell", name=f"{len(first)} contacts begun", exact=True).wait_for()
    assert "painted" in log.inner_text()
    page.locator(".ts-log").scroll_into_view_if_needed()
    shot(page, "live-contacts")


def test_two_worlds_on_the_same_noise(page: Page, live: Callable[..., LivePage], shot: Any) -> None:
    server = live(parameters={"robots": 8, "targets": 9})
    shown(page, server)
    page.get_by_label("two worlds, same noise").check()
    page.wait_for_function("() => teamsight.view.tracks.length === 2")
    page.get_by_text("two worlds on the same noise: blind (awareness none), and aware (pairwise)").wait_for()
    assert [world_of(server, track).awareness.name for track in (0, 1)] == ["none", "pairwise"]
    page.get_by_role("radio", name="right").check()
    page.get_by_label("policy").first.select_option("stationary")
    until(lambda: type(world_of(server, 1).robots.policy).__name__ == "Stationary")
    assert type(world_of(server, 0).robots.policy).__name__ == "ACmommt"
    press(page, "Space")
    until(lambda: world_of(server).tick > 20)
    page.wait_for_function("() => teamsight.live.transport.running")
    press(page, "Space")
    until(lambda: not server.session.is_running)
    settled(page, server)
    left, right = world_of(server, 0), world_of(server, 1)
    assert left.tick == right.tick
    assert_same_places(page, left, 0)
    assert_same_places(page, right, 1)
    # Targets do not see robots, so they move alike.
    np.testing.assert_array_equal(left.targets.position, right.targets.position)
    assert (left.robots.position != right.robots.position).any()
    assert page.locator(".ts-chart").count() == 4
    captions = page.locator(".ts-caption").all_inner_texts()
    assert captions == [
        "CMOMMT, awareness none, policy a-cmommt, seed 5", "CMOMMT, awareness pairwise, policy stationary, seed 5"
    ]  # fmt: skip
    shot(page, "live-two-worlds")
    said: list[str] = []
    page.on("console", lambda message: said.append(message.text))
    page.get_by_label("two worlds, same noise").uncheck()
    page.wait_for_function("() => teamsight.view.tracks.length === 1")
    until(lambda: len(server.session.worlds.tracks) == 1)
    settled(page, server)
    assert_same_places(page, world_of(server))
    # The settings of the world on the right are no longer asked for, and the team is no longer blind.
    assert not said
    assert world_of(server).awareness.name == "pairwise"


def held_compilation(monkeypatch: pytest.MonkeyPatch) -> threading.Event:
    """Let worlds wait for a kernel that is being compiled until the event is set."""
    go, compiled = threading.Event(), LiveTrack.compile
    # A thread of a test before may have begun one.
    monkeypatch.setattr(REPORT, "_number", 0)

    def slowly(track: LiveTrack) -> None:
        REPORT.begin("rule")
        assert go.wait(PATIENCE)
        REPORT.end(is_done=True)
        compiled(track)

    monkeypatch.setattr(LiveTrack, "compile", slowly)
    return go


def test_the_page_is_there_while_its_first_world_is_compiled(
    page: Page, live: Callable[..., LivePage], monkeypatch: pytest.MonkeyPatch, shot: Any
) -> None:
    go = held_compilation(monkeypatch)
    server = live(running=True)
    page.goto(server.url)
    page.get_by_text(re.compile(r"Compiling kernels, once on this machine \(1( of \d+)?\)$")).wait_for()
    assert server.session.said in page.locator(".tl-waiting").inner_text()
    # The bodies where they will start.
    page.wait_for_function("() => teamsight.view.tracks[0]?.frames.length === 1")
    shot(page, "live-compiling")
    go.set()
    page.wait_for_function("() => teamsight.view.tracks[0]?.frames.length > 3")
    page.get_by_text("Compiling").first.wait_for(state="hidden")


def test_what_is_chosen_holds_once_it_is_compiled(
    page: Page, live: Callable[..., LivePage], monkeypatch: pytest.MonkeyPatch, shot: Any
) -> None:
    server = live(running=True, rate=100.0)
    page.goto(server.url)
    page.wait_for_function("() => teamsight.view?.tracks[0]?.frames.length > 3")
    world, go = world_of(server), held_compilation(monkeypatch)
    page.get_by_label("policy").first.select_option("centroid")
    page.get_by_text("Compiling kernels, once on this machine (1").wait_for()
    # Longer than the page keeps a choice by itself.
    page.wait_for_timeout(700)
    assert page.locator("#tl-policy").input_value() == "centroid"
    assert type(world.robots.policy).__name__ == "ACmommt"
    shot(page, "live-compiling-a-choice")
    # What is asked meanwhile comes after it.
    page.locator("#tl-robots").fill("7")
    page.locator("#tl-robots").press("Enter")
    go.set()
    until(lambda: len(world_of(server).robots) == 7)
    assert type(world.robots.policy).__name__ == type(world_of(server).robots.policy).__name__ == "Centroid"
    page.get_by_text("Compiling").wait_for(state="hidden")


def test_what_cannot_be_compiled_is_said_and_the_menu_goes_back(
    page: Page, live: Callable[..., LivePage], monkeypatch: pytest.MonkeyPatch
) -> None:
    server = live()
    shown(page, server)

    def fail(track: LiveTrack) -> None:
        raise TypeError("my_policy.py, line 3: no kernel")

    monkeypatch.setattr(LiveTrack, "compile", fail)
    page.get_by_label("policy").first.select_option("centroid")
    page.get_by_role("alert").get_by_text("my_policy.py, line 3: no kernel").wait_for()
    assert page.locator("#tl-policy").input_value() == "a-cmommt"
    assert type(world_of(server).robots.policy).__name__ == "ACmommt"
    with pytest.raises(TypeError, match="no kernel"):
        live()


def test_the_world_stands_still_while_no_page_is_open(new_page: browsing.Pages, live: Callable[..., LivePage]) -> None:
    server = live(running=True, rate=None)
    # The thread of the worlds waits for messages as long as it takes.
    assert server.session.is_running
    assert server.session._patience() is None
    assert world_of(server).tick == 0
    page = new_page()
    page.goto(server.url)
    until(lambda: world_of(server).tick > 3)
    page.close()
    until(lambda: server.session._patience() is None)
    assert server.session.is_running


def test_a_model_that_fails_is_said_and_starts_again(page: Page, live: Callable[..., LivePage]) -> None:
    server = live(live_models.Failing, running=True, rate=200.0)
    page.goto(server.url)
    page.get_by_text("The model failed at tick 5: RuntimeError: the battery is on fire").first.wait_for()
    assert not server.session.is_running
    assert page.locator(".tl-ticks").text_content() == "tick 5, failed"
    # Said once, also where it fails again at once: in the alert, and below the buttons when that is dismissed.
    page.get_by_role("button", name="Run", exact=True).click()
    until(lambda: not server.session.busy())
    page.get_by_role("alert").get_by_text("The model failed at tick 5").wait_for()
    page.wait_for_function("() => document.querySelector('.tl-note').textContent === ''")
    page.get_by_role("button", name="Dismiss").click()
    page.wait_for_function("() => document.querySelector('.tl-note').textContent.startsWith('The model failed at tick 5')")
    page.get_by_role("button", name="Run", exact=True).click()
    until(lambda: not server.session.busy())
    # Whoever starts again, what was said of the run before is past.
    server.session.ask(Message("reset", {}))
    page.wait_for_function("() => document.querySelector('.tl-ticks').textContent === 'tick 0, paused'")
    assert page.get_by_role("alert").is_hidden()
    page.locator("#tl-breaks_at").fill("1000")
    page.locator("#tl-breaks_at").press("Enter")
    page.get_by_role("button", name="Run", exact=True).click()
    until(lambda: world_of(server).tick > 10)


def test_reconnects_after_a_restart(page: Page, live: Callable[..., LivePage], problems: browsing.Problems) -> None:
    problems.expect("ERR_CONNECTION_REFUSED")
    server = live(running=True)
    page.goto(server.url)
    page.wait_for_function("() => teamsight.view?.tracks[0]?.frames.length > 3")
    port = int(server.url.rsplit(":", 1)[1].strip("/"))
    server.close()
    page.get_by_text("Reconnecting").wait_for()
    again = live(parameters={"seed": 6, "robots": 3}, port=port)
    page.get_by_text("Reconnecting").wait_for(state="hidden")
    settled(page, again)
    assert page.evaluate("() => teamsight.view.tracks[0].frames.length") == 1
    assert_same_places(page, world_of(again))


def test_a_thousand_frames_need_no_more_memory(
    new_page: browsing.Pages, live: Callable[..., LivePage], monkeypatch: pytest.MonkeyPatch
) -> None:
    # A small picture, and more frames than can be drawn, acknowledged as they come, so that the test is short.
    monkeypatch.setattr(session, "FRAMES_A_SECOND", 1000.0)
    server, page = live(parameters={"robots": 15, "targets": 15}, rate=1000.0), new_page(size=(400, 300))
    shown(page, server)
    page.evaluate("""() => {
      const { link } = teamsight.live, receive = link.receiveFrame.bind(link);
      link.receiveFrame = (data) => { receive(data); link.acknowledge(); };
      teamsight.view.keep = 100;
    }""")
    press(page, "Space")
    before = after_frames(page, 200)
    grown = after_frames(page, 1000) - before
    assert page.evaluate("() => teamsight.view.tracks[0].frames.length") <= 111
    assert grown < 1.5e6, f"{grown / 1e6:.1f} MB more"


def after_frames(page: Page, count: int) -> float:
    """Return the size of the page's heap after more frames [bytes]."""
    received = page.evaluate("() => teamsight.live.link.received")
    page.wait_for_function("n => teamsight.live.link.received >= n", arg=received + count)
    return float(page.evaluate("() => { gc(); gc(); return performance.memory.usedJSHeapSize; }"))


def test_a_page_that_does_not_answer_holds_nothing_up(page: Page, live: Callable[..., LivePage]) -> None:
    server = live(running=True, rate=500.0)
    page.goto(server.url)
    page.wait_for_function("() => teamsight.view?.tracks[0]?.frames.length > 3")
    page.evaluate("() => { teamsight.live.link.acknowledge = () => {}; }")
    page.wait_for_timeout(200)
    received, tick = page.evaluate("() => teamsight.live.link.received"), world_of(server).tick
    until(lambda: world_of(server).tick > tick + 200)
    assert page.evaluate("() => teamsight.live.link.received") <= received + 2
    # Controls go on, and so do frames once it answers.
    page.evaluate("() => { delete teamsight.live.link.acknowledge; teamsight.live.link.acknowledge(); }")
    page.wait_for_function("n => teamsight.live.link.received > n + 5", arg=received)


def test_two_pages_show_one_run(new_page: browsing.Pages, live: Callable[..., LivePage]) -> None:
    server = live()
    one, other = new_page(), new_page()
    shown(one, server)
    shown(other, server)
    one.get_by_role("button", name="Step", exact=True).click()
    until(lambda: world_of(server).tick == 1)
    for page in (one, other):
        settled(page, server)
        assert_same_places(page, world_of(server))


def test_saved_recording_plays_from_a_file(
    page: Page, new_page: browsing.Pages, live: Callable[..., LivePage], tmp_path: Path
) -> None:
    server = live(beside={"policy": "centroid"}, running=True)
    page.goto(server.url)
    page.wait_for_function("() => teamsight.view?.tracks[1]?.frames.length > 10")
    with page.expect_download() as saving:
        page.get_by_role("button", name="Save recording").click()
    place = tmp_path / saving.value.suggested_filename
    assert place.suffix == ".html"
    saving.value.save_as(place)
    replay = new_page()
    replay.goto(place.as_uri())
    replay.wait_for_function("() => teamsight.view?.tracks[1]?.frames.length > 10")


def test_keeps_to_a_phone(new_page: browsing.Pages, live: Callable[..., LivePage], shot: Any) -> None:
    server = live(beside={"awareness": "none", "policy": "random-walk"})
    page = new_page(size=browsing.PHONE)
    shown(page, server)
    assert page.evaluate("() => document.documentElement.scrollWidth") <= browsing.PHONE[0]
    page.get_by_role("button", name="Step", exact=True).tap()
    until(lambda: world_of(server).tick == 1)
    small = page.evaluate(
        "() => [...document.querySelectorAll('.ts-controls button, .ts-controls select')]"
        ".filter(one => one.offsetParent && one.offsetHeight < 36).map(one => one.textContent)"
    )
    assert small == []
    shot(page, "live-phone")


def test_everything_can_be_reached_by_keyboard(page: Page, live: Callable[..., LivePage]) -> None:
    server = live()
    shown(page, server)
    names = page.evaluate(
        "() => [...document.querySelectorAll('.ts-controls :is(input, select, button)')]"
        ".filter(one => one.offsetParent && !one.labels?.length && !one.ariaLabel && !one.textContent.trim()).length"
    )
    assert names == 0
    page.get_by_role("button", name="Pause").or_(page.get_by_role("button", name="Run", exact=True)).first.focus()
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    until(lambda: world_of(server).tick == 1)
    # A space in a field is none of the view's.
    page.locator("#tl-seed").focus()
    page.keyboard.press("Space")
    assert not server.session.is_running


def test_a_page_that_comes_later_shows_what_was_before(page: Page, live: Callable[..., LivePage]) -> None:
    server = live(beside={"policy": "centroid"}, rate=500.0, running=True)
    server.session.watched_by(1)
    until(lambda: world_of(server).tick > 200)
    server.session.ask(Message("pause", {}))
    until(lambda: not server.session.is_running)
    shown(page, server)
    for track in (0, 1):
        times = page.evaluate("i => teamsight.view.tracks[i].frames.map(({ time }) => time)", track)
        assert times[0] == 0
        assert times[-1] == world_of(server).tick
        assert times == sorted(set(times))
        assert len(times) == server.session.worlds.tracks[track].state()["kept"]
        assert_same_places(page, world_of(server, track), track)
    # The past can be looked at while the worlds go on.
    page.get_by_role("button", name="Run", exact=True).click()
    page.locator(".ts-scrub").focus()
    page.keyboard.press("Home")
    tick = world_of(server).tick
    until(lambda: world_of(server).tick > tick + 20)
    assert page.evaluate("() => teamsight.view.shownTime") == 0


def test_too_many_links_are_said_and_controls_go_on(page: Page, live: Callable[..., LivePage], shot: Any) -> None:
    server = live(parameters={"robots": 400, "targets": 20, "radius": 5.0, "policy": "stationary"})
    shown(page, server)
    assert not page.locator(".ts-omitted").is_visible()
    page.locator("#tl-awareness_range").fill("100")
    page.locator("#tl-awareness_range").press("Enter")
    page.get_by_text("Teammates: 159,600 links, more than 100,000: not shown").wait_for()
    page.get_by_text("400 robots, 159,600 links, too many to show; neighbours: mean 399.0, at most 399 now, 399 so far.").wait_for()
    page.evaluate("() => teamsight.view.select(0, 0)")
    page.get_by_label("Inspector").get_by_text("159,600 links, more than 100,000: not shown.").wait_for()
    shot(page, "live-too-many-links")
    page.get_by_role("button", name="Step", exact=True).click()
    until(lambda: world_of(server).tick == 1)
    page.locator("#tl-awareness_range").fill("0.5")
    page.locator("#tl-awareness_range").press("Enter")
    page.locator(".ts-omitted").wait_for(state="hidden")
    settled(page, server)


def test_reduced_motion_holds_only_its_own_page(new_page: browsing.Pages, live: Callable[..., LivePage], shot: Any) -> None:
    server = live(running=True)
    other, page = new_page(), new_page(reduced_motion=True)
    other.goto(server.url)
    page.goto(server.url)
    page.get_by_text("Your system asks for reduced motion").wait_for()
    still = page.evaluate("() => teamsight.view.shownTime")
    tick = world_of(server).tick
    until(lambda: world_of(server).tick > tick + 30)
    other.wait_for_function("tick => teamsight.view.shownTime > tick + 20", arg=tick)
    assert page.evaluate("() => teamsight.view.shownTime") == still
    assert server.session.is_running
    shot(page, "live-reduced-motion")
    # Who asks for motion gets it.
    page.get_by_role("button", name="Follow the run").click()
    page.wait_for_function("time => teamsight.view.shownTime > time + 20", arg=still)
    assert not page.get_by_text("Your system asks for reduced motion").is_visible()
    page.get_by_role("button", name="Pause the run").click()
    until(lambda: not server.session.is_running)
    settled(page, server)
    page.get_by_role("button", name="Run", exact=True).click()
    tick = world_of(server).tick
    page.wait_for_function("tick => teamsight.view.shownTime > tick + 10", arg=tick)


def test_reduced_motion_rests_when_another_page_runs_the_model(new_page: browsing.Pages, live: Callable[..., LivePage]) -> None:
    server = live()
    other, page = new_page(), new_page(reduced_motion=True)
    shown(other, server)
    shown(page, server)
    press(other, "Space")
    page.get_by_text("Your system asks for reduced motion").wait_for()
    still = page.evaluate("() => teamsight.view.shownTime")
    until(lambda: world_of(server).tick > still + 20)
    assert page.evaluate("() => teamsight.view.shownTime") == still
    # At rest, all pages show the same moment again.
    press(other, "Space")
    until(lambda: not server.session.is_running)
    settled(page, server)
    page.get_by_role("button", name="Step", exact=True).click()
    settled(page, server)


class _Weighed(CMOMMT):
    """A world with a measure of its own."""

    @property
    def load(self) -> float:
        return 10.0 * self.tick

    @property
    def broken(self) -> float:
        raise RuntimeError("no scale is there")


def test_any_measure_is_a_chart_with_a_running_mean_and_a_csv(page: Page, live: Callable[..., LivePage]) -> None:
    server = live(_Weighed, {"robots": 6, "targets": 5})
    shown(page, server)

    def step(count: int) -> None:
        for _ in range(count):
            tick = world_of(server).tick
            page.evaluate("() => teamsight.live.step()")
            until(lambda tick=tick: world_of(server).tick == tick + 1)
            settled(page, server)

    step(3)
    page.get_by_text("Charts", exact=True).click()
    page.get_by_label("Load", exact=True).check()
    page.get_by_role("checkbox", name="Robots active").check()
    page.wait_for_function("() => teamsight.view.charts.some(({ name }) => name === 'load')")
    # Frames of before are kept, without it.
    assert page.evaluate("() => teamsight.view.tracks[0].frames.length") == 4
    step(2)
    page.get_by_label("Running mean of Load").click()
    values = "() => teamsight.view.charts.find(({ name }) => name === 'load').lines.map((line) => [3, 4, 5].map((k) => line.at(k)))"
    assert page.evaluate(values) == [[30, 35, 40]]
    with page.expect_download() as saved:
        page.get_by_role("button", name="Save CSV").click()
    rows = [line.split(",") for line in saved.value.path().read_text().splitlines()]
    assert rows[0] == ["time", "observed", "mean_neighbours", "max_neighbours", "load", "robots active"]
    assert [row[0] for row in rows[1:]] == list("012345")
    assert [row[4] for row in rows[1:]] == ["", "", "", "30", "40", "50"]
    assert float(rows[-1][1]) == pytest.approx(world_of(server).observed, abs=1e-7)
    # 24 bits are no reason for nine digits: a share of 0.2 is not 0.200000003.
    digits = page.evaluate("""() => {
      const { view } = teamsight, track = view.tracks[0], { frames } = track;
      track.frames = [0.2, 85.3, 1 / 3, 16777217, NaN].map((value, time) => ({ time, value: () => Math.fround(value) }));
      const text = view.csv();
      track.frames = frames;
      return text.trim().split("\\r\\n").slice(1).map((line) => line.split(",")[1]);
    }""")
    assert digits[:5] == ["0.2", "85.3", "0.33333334", "16777216", ""]
    # A page that is opened later has it too, from where it was chosen.
    other = page.context.new_page()
    shown(other, server)
    assert other.evaluate(values.replace("[3, 4, 5]", "[0, 3, 4, 5]").replace("line.at(k)", "line.at(k) || 0")) == [[0, 30, 40, 50]]
    other.close()
    # One that is no longer wanted has no chart; a new start keeps what is wanted.
    page.get_by_role("checkbox", name="Robots active").uncheck()
    page.wait_for_function("() => !teamsight.view.charts.some(({ name }) => name === 'robots active')")
    page.get_by_role("button", name="Reset").click()
    until(lambda: world_of(server).tick == 0)
    settled(page, server)
    assert page.evaluate("() => teamsight.view.tracks[0].scene.series")[3:] == ["load"]
    page.get_by_role("checkbox", name="Broken").click()
    page.get_by_text("broken: cannot be charted, RuntimeError: no scale is there").wait_for()
    assert not page.get_by_role("checkbox", name="Broken").is_checked()


def test_many_robots_have_a_neighbour_graph_in_space(page: Page, live: Callable[..., LivePage]) -> None:
    server = live(parameters={"robots": 61, "targets": 5, "radius": 5.0})
    shown(page, server)
    page.get_by_text("61 robots at their places").wait_for()
    # Dots lie as the robots do: the mirror image of y, at one scale.
    nodes = page.evaluate("() => teamsight.live.graph.nodes.map(({ x, y }) => [x, y])")
    places, dots = world_of(server).robots.position, np.array(nodes)
    scale = (dots[:, 0] - dots[:, 0].mean()) @ (places[:, 0] - places[:, 0].mean()) / np.var(places[:, 0]) / 61
    np.testing.assert_allclose(dots - dots.mean(axis=0), (places - places.mean(axis=0)) * [scale, -scale], atol=0.1)


def test_lines_that_are_left_out_of_the_graph_are_said(page: Page, live: Callable[..., LivePage]) -> None:
    server = live(parameters={"robots": 120, "targets": 2, "radius": 4.0, "awareness_range": 3.0})
    shown(page, server)
    page.get_by_text(re.compile(r"120 robots at their places, [\d,]+ links, too many to draw; neighbours")).wait_for()


def test_a_chart_of_events_can_be_taken_off_and_put_back_before_they_come_again(page: Page, live: Callable[..., LivePage]) -> None:
    server = live(parameters={"robots": 20, "targets": 2, "events": Failures(5.0, 5.0)}, running=True, rate=200.0)
    page.goto(server.url)
    page.get_by_text("Charts", exact=True).click()
    page.get_by_role("checkbox", name="Events failed").check()
    page.wait_for_function("() => teamsight.view.charts.some(({ name }) => name === 'events failed')")
    page.get_by_role("button", name="Pause the run").first.click()
    page.get_by_role("button", name="Reset").click()
    until(lambda: world_of(server).tick == 0)
    settled(page, server)
    page.get_by_role("checkbox", name="Events failed").uncheck()
    page.wait_for_function("() => !teamsight.view.charts.some(({ name }) => name === 'events failed')")
    page.wait_for_function("() => !teamsight.live.state.charted.length")
    # Its box stays where it was, with the focus of who uses the keyboard.
    assert page.evaluate("() => document.activeElement.dataset.name") == "events failed"
    page.keyboard.press("Space")
    page.wait_for_function("() => teamsight.view.charts.some(({ name }) => name === 'events failed')")


def test_a_band_of_other_seeds_lies_behind_what_is_observed(page: Page, live: Callable[..., LivePage]) -> None:
    server = live(parameters={"robots": 6, "targets": 5}, beside={"awareness": "none"})
    shown(page, server)
    page.get_by_text("Charts", exact=True).click()
    page.get_by_role("button", name="Run for a band").click()
    page.get_by_text("ticks 0: nothing has been run yet").wait_for()
    page.get_by_label("runs", exact=True).fill("9")
    page.get_by_label("ticks", exact=True).fill("60")
    page.get_by_role("button", name="Run for a band").click()
    page.get_by_text("9 runs of 60 ticks, seeds 6 to 14").wait_for()
    page.get_by_text("band: 90 % of 9 other seeds (percentiles 5 to 95); dots: mean").wait_for()
    bands = page.evaluate("() => teamsight.view.band.bands")
    for one, awareness in zip(bands, ("pairwise", "none"), strict=True):
        worlds = [CMOMMT(6, 5, seed=seed, awareness=awareness) for seed in range(6, 15)]
        for world in worlds:
            world.run(60, progress=False)
        assert one["mean"][-1] == pytest.approx(np.mean([world.observed for world in worlds]), rel=1e-12)
    # Both have their colour inside: the chart is drawn to the end of the band, whatever the tick.
    # Not on a line of the axes.
    middles = [
        next([k, middle] for k in range(50, 0, -1) if 0.1 < (middle := (one["low"][k] + one["high"][k]) / 2) < 0.4)
        for one in bands
    ]
    opacity = """([tick, value]) => { const chart = teamsight.view.charts[0];
      return chart.to.getImageData(Math.round(chart.px(tick)), Math.round(chart.py(value)), 1, 1).data[3]; }"""
    page.wait_for_function("() => !teamsight.view.isDirty")
    assert all(page.evaluate(opacity, middle) > 0 for middle in middles)
    # It is gone with the button, and with another setting.
    page.get_by_role("button", name="Remove band").click()
    page.wait_for_function("() => teamsight.view.band === null")
    assert page.evaluate("() => teamsight.view.charts[0].bandText.hidden")
    page.wait_for_function("() => !teamsight.view.isDirty")
    assert not any(page.evaluate(opacity, middle) for middle in middles)
    page.get_by_role("button", name="Run for a band").click()
    page.wait_for_function("() => teamsight.view.band")
    page.get_by_role("button", name="Reset").click()
    page.wait_for_function("() => teamsight.view.band === null")


def test_a_band_says_of_how_many_runs_it_is_and_that_they_are_undisturbed(
    page: Page, live: Callable[..., LivePage], shot: Any
) -> None:
    server = live(live_models.stopping)
    shown(page, server)
    for tick in range(1, 3):
        page.evaluate("() => teamsight.live.step()")
        until(lambda tick=tick: world_of(server).tick == tick)
    settled(page, server)
    page.get_by_text("Charts", exact=True).click()
    page.get_by_label("runs", exact=True).fill("10")
    page.get_by_label("ticks", exact=True).fill("12")
    page.get_by_role("button", name="Run for a band").click()
    # Those of the seeds 6 to 15 stop after as many ticks.
    said = page.locator(".ts-banded .ts-band-text").last
    said.get_by_text("paler from tick 7, where n < 10 runs have a value, none where n < 8").wait_for()
    values = page.locator(".ts-banded .ts-band-values")
    assert re.fullmatch(r"mean \d+ %, \d+ to \d+ %, n = 10", values.text_content())
    assert "Undisturbed" not in said.text_content()
    page.evaluate("() => teamsight.view.show(0)")
    for tick, text in ((8, "n = 8 of 10"), (9, "no band, n = 7 of 10"), (12, "no band, n = 4 of 10"), (13, "no band after tick 12")):
        found = page.evaluate(
            """tick => { const { view } = teamsight, [chart] = view.charts;
            return chart.bandValue.call({ view: { shownTime: tick, band: view.band } }, view.band.bands[0], 0); }""",
            tick,
        )
        assert found.endswith(text), found
    page.evaluate("() => teamsight.live.laboratory.add(0, { x: 0.5, y: 0.5 })")
    said.get_by_text("Undisturbed: they have the present settings from tick 0").wait_for()
    shot(page, "band-stopping")


def test_a_band_can_be_cancelled_from_the_page(page: Page, live: Callable[..., LivePage]) -> None:
    go_on = threading.Event()

    def slow(robots: int = 4, seed: int = 0) -> CMOMMT:
        if seed == 8:
            assert go_on.wait(PATIENCE)
        return CMOMMT(robots, 5, seed=seed)

    server = live(slow)
    shown(page, server)
    page.get_by_text("Charts", exact=True).click()
    page.get_by_label("ticks", exact=True).fill("60")
    page.get_by_role("button", name="Run for a band").click()
    page.get_by_text("2 of 16 runs").wait_for()
    # Meanwhile the worlds of the page go on.
    page.evaluate("() => teamsight.live.step()")
    until(lambda: world_of(server).tick == 1)
    page.get_by_role("button", name="Cancel").click()
    page.wait_for_function("() => teamsight.live.controls.bandStop.hidden")
    # Whoever works by keyboard is not left nowhere.
    assert page.evaluate("() => document.activeElement === teamsight.live.controls.bandButton")
    go_on.set()
    assert page.evaluate("() => teamsight.view.band") is None


def no_video() -> None:
    raise ImportError


def test_a_film_of_chosen_ticks_is_saved(
    new_page: browsing.Pages, live: Callable[..., LivePage], monkeypatch: pytest.MonkeyPatch, shot: Any
) -> None:
    image = pytest.importorskip("PIL.Image")
    monkeypatch.setattr(session, "check_video", no_video)
    server, page = live(parameters={"robots": 6, "targets": 5}), new_page()
    shown(page, server)
    for tick in range(1, 6):
        page.evaluate("() => teamsight.live.step()")
        until(lambda tick=tick: world_of(server).tick == tick)
        settled(page, server)
    page.get_by_role("button", name="Save film").click()
    page.get_by_text("6 frames: GIF, 480 pixels wide, 0.3 s long, about 0.0 MB. Ticks 0 to 5 are kept.").wait_for()
    assert (page.get_by_label("from tick").input_value(), page.get_by_label("to tick").input_value()) == ("0", "5")
    page.get_by_label("from tick").fill("2")
    page.get_by_label("to tick").fill("4")
    page.get_by_text("3 frames: GIF").wait_for()
    many = {**server.session.reel(server.session._run), "bytes": 25_000_000}
    page.evaluate("reel => teamsight.live.on_reel(reel)", many)
    page.get_by_text("about 25.0 MB, large for a mail or a page: choose fewer ticks. Ticks").wait_for()
    shot(page, "live-film")
    # What a field does not allow, and what the server refuses, are sentences.
    page.get_by_label("to tick").fill("9")
    page.get_by_role("button", name="Make the film").click()
    page.get_by_role("dialog").get_by_text("to tick 9: must be a whole number from 0 to 5").wait_for()
    page.get_by_label("to tick").fill("1")
    page.get_by_role("dialog").get_by_text("ticks 2 to 1: frames are kept of ticks 0 to 5").wait_for()
    page.get_by_label("to tick").fill("4")
    with page.expect_download() as saved:
        page.get_by_role("button", name="Make the film").press("Enter")
    assert saved.value.suggested_filename == "teamsight-cmommt-a-cmommt-seed-5.gif"
    with image.open(saved.value.path()) as film:
        assert film.n_frames == 3
    page.get_by_text("Saved: 0.0 MB.").wait_for()
    # Whoever works by keyboard goes on where the film was asked for.
    page.wait_for_function("() => document.activeElement === teamsight.live.controls.film.maker")
    page.keyboard.press("Escape")
    assert page.get_by_role("button", name="Save film").is_enabled()


def test_a_film_shows_its_progress_and_is_cancelled(
    new_page: browsing.Pages, live: Callable[..., LivePage], monkeypatch: pytest.MonkeyPatch, shot: Any
) -> None:
    page, go_on = new_page(size=browsing.PHONE, dark=True), threading.Event()
    server = live(parameters={"robots": 6, "targets": 5})

    def film(progress: Callable[[int, int], object], **ticks: Any) -> tuple[str, bytes]:
        progress(30, 120)
        assert go_on.wait(PATIENCE)
        # It ends when it is cancelled, however late the server hears of it.
        until(lambda: progress(31, 120))
        return "film.gif", b""

    monkeypatch.setattr(server.session, "film", film)
    shown(page, server)
    page.get_by_role("button", name="Save film").click()
    page.get_by_text("Ticks 0 to 0 are kept.").wait_for()
    page.get_by_role("button", name="Make the film").click()
    page.wait_for_function("() => document.querySelector('.tl-film progress').value === 30")
    shot(page, "live-film-phone-dark")
    assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")
    # It goes on while the page is used; another one does not begin.
    page.get_by_role("button", name="Close the film").click()
    page.evaluate("() => teamsight.live.step()")
    until(lambda: world_of(server).tick == 1)
    page.get_by_role("button", name="Frame 30 of 120").click()
    assert page.get_by_role("button", name="Make the film").is_disabled()
    page.get_by_role("button", name="Cancel the film").click()
    go_on.set()
    page.get_by_text("Cancelled.").wait_for()
    assert page.get_by_role("button", name="Make the film").is_enabled()
    assert page.locator(".tl-film progress").is_hidden()
    # Worlds that are built anew have other frames.
    page.evaluate("() => teamsight.live.link.send('reset')")
    page.get_by_text("Ticks 0 to 0 are kept.").wait_for()


def test_tab_reaches_each_control_and_leaves_the_page(page: Page, live: Callable[..., LivePage]) -> None:
    shown(page, live(parameters={"robots": 4, "targets": 3}))
    page.evaluate("() => document.querySelectorAll('details').forEach((one) => { one.open = true; })")
    assert page.locator("button:visible").count() > 15
    assert browsing.unreached(page) == []
