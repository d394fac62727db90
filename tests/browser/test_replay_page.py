"""The page plays a recording, and shows what the model holds."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import browsing
import numpy as np
import pytest
from replaying import at_tick, drawn, opened, recorded, until, written

from teamsight import (
    CMOMMT,
    Box,
    Circle,
    Disc,
    Lidar,
    Polygon,
    Robot,
    Sensor,
    Target,
    Torus,
    World,
)
from teamsight.policies import ACmommt, RandomWalk
from teamsight.view.scene import BLOCKED

if TYPE_CHECKING:
    from playwright.sync_api import Page

STEPS = 40
MOST_PART = 65_535


def team(awareness: str = "ring", delta: int = 8, **more: Any) -> CMOMMT:
    return CMOMMT(
        robots=12, targets=12, radius=4.0, awareness=awareness, delta=delta, sensing_range=1.5, awareness_range=2.5, rng=11, **more
    )  # fmt: skip


def torus() -> World:
    world = World(Torus(6, 5).with_obstacles(Circle((0, 0), 0.5)), rng=4)
    robots = world.add(
        Robot, 8, policy=ACmommt(), awareness="shared", speed=0.1, sensing_range=1.2, awareness_range=1.6
    )
    world.senses(robots, world.add(Target, 10, policy=RandomWalk(0.05), speed=0.075))
    return world


def noisy() -> CMOMMT:
    return team("pairwise", sensor=Sensor(range_noise=0.2, bearing_noise=0.3, field_of_view=2.5))


@pytest.fixture
def replay(page: Page, tmp_path: Path) -> Page:
    """The page of a team, stopped at its first frame."""
    return opened(page, written(tmp_path, recorded(team(), STEPS)))


def position(page: Page) -> int:
    found: int = page.evaluate("teamsight.view.position")
    return found


def slots_of(page: Page) -> dict[int, int]:
    """Return the slots of bodies by identity."""
    found = page.evaluate("teamsight.view.tracks[0].scene.slots.map((slot, s) => [slot.id, s])")
    return dict(found)


@pytest.mark.parametrize("make", [team, torus, noisy])
def test_bodies_are_drawn_where_the_model_has_them(page: Page, tmp_path: Path, make: Callable[[], World]) -> None:
    opened(page, written(tmp_path, recorded(make(), STEPS)))
    twin = make()
    low, high = twin.arena.bounds
    limit = (high - low) / MOST_PART * 0.51
    for tick in (0, 7, STEPS):
        twin.run(tick - twin.clock.now)
        at_tick(page, tick)
        places = drawn(page)
        agents = [agent for group in twin.groups for agent in group]
        assert len(places) == len(agents)
        for agent in agents:
            assert np.all(np.abs(agent.position - places[agent.unique_id]) <= limit), agent


def crowd() -> World:
    world = World(Torus(6, 5), contact="slide", rng=4)
    radius = [1.0, 0.02, *[0.3] * 10]
    world.add(Robot, 12, policy="random-walk", radius=radius, speed=0.2, sensing_range=0.01, awareness_range=0.01)
    return world


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("size", [browsing.WIDE, browsing.PHONE])
def test_bodies_are_drawn_and_found_in_their_true_size(
    new_page: browsing.Pages, tmp_path: Path, shot: Callable[[Page, str], None], size: tuple[int, int], dark: bool
) -> None:
    replay = recorded(crowd(), STEPS)
    page = opened(new_page(size=size, dark=dark), written(tmp_path, replay))
    blocked = [int((frame.flags & BLOCKED).astype(bool).sum()) for frame in replay.frames]
    tick = int(np.argmax(blocked))
    at_tick(page, tick)
    shot(page, f"bodies-{size[0]}-{'dark' if dark else 'light'}")
    found = page.evaluate("""() => {
      const { arena } = teamsight.view.tracks[0], { at, px, py } = arena;
      const points = [[1.5, 0], [0.5, 0], [0, 0.5], [-0.5, 0]];
      return points.map(([x, y]) => arena.nearest(px[0] + x * at.scale, py[0] + y * at.scale, 1));
    }""")
    assert found[1:] == [0, 0, 0]
    assert found[0] != 0
    for slot, is_blocked in enumerate((replay.frames[tick].flags & BLOCKED).tolist()):
        page.evaluate("slot => teamsight.view.select(0, slot)", slot)
        page.evaluate("teamsight.view.draw()")
        text = page.locator(".ts-title").inner_text()
        assert ("blocked" in text) == bool(is_blocked), text
    page.evaluate("teamsight.view.select(0, 1)")
    page.evaluate("teamsight.view.draw()")
    assert "0.02" in page.locator(".ts-facts div", has_text="Radius").inner_text()


def test_blocked_bodies_stand_out_and_recordings_of_points_have_no_circles(page: Page, tmp_path: Path) -> None:
    counted = """() => {
      const { arena } = teamsight.view.tracks[0], { canvas, to } = arena, { blocked } = teamsight.view.palette;
      const { data } = to.getImageData(0, 0, canvas.width, canvas.height);
      const ring = [1, 3, 5].map((k) => parseInt(blocked.slice(k, k + 2), 16));
      let count = 0;
      for (let k = 0; k < data.length; k += 4) count += ring.every((value, c) => Math.abs(value - data[k + c]) < 8);
      return count;
    }"""
    replay = recorded(crowd(), STEPS)
    opened(page, written(tmp_path, replay))
    tick = int(np.argmax([int((frame.flags & BLOCKED).astype(bool).sum()) for frame in replay.frames]))
    counts = []
    for number in (0, tick):
        at_tick(page, number)
        counts.append(page.evaluate(counted))
    assert counts[0] == 0
    assert counts[1] > 50
    opened(page, written(tmp_path, recorded(team(), 2)))
    assert not page.evaluate("teamsight.view.tracks[0].layout.hasRadii")


@pytest.mark.parametrize("degree", ["none", "ring", "nearest", "pairwise", "shared"])
def test_the_inspector_shows_the_percept_of_the_model(page: Page, tmp_path: Path, degree: str) -> None:
    delta = 2 if degree == "nearest" else 8
    opened(page, written(tmp_path, recorded(team(degree, delta), STEPS)))
    twin = team(degree, delta)
    twin.run(STEPS)
    at_tick(page, STEPS)
    # Each of two positions is rounded by half a part.
    error = 2 * 8 / MOST_PART
    shown_at_all = 0
    for robot, found in inspected(page, twin):
        percept = robot.percept
        assert_same(sensed_in(found, "targets"), entries(percept.targets), error)
        if degree == "ring":
            shown_at_all += assert_same_ring(found["ring"], percept.teammates, robot, error)
        elif degree == "nearest":
            shown = [(one["dx"], one["dy"]) for one in found["nearest"]]
            assert np.allclose(shown, percept.teammates.offset.tolist(), rtol=0, atol=error)
            shown_at_all += len(shown)
        elif degree != "none":
            assert_same(found["teammates"], entries(percept.teammates), error)
            shown_at_all += len(found["teammates"])
        if degree == "shared":
            assert_same(found["relayed"], entries(percept.relayed), 2 * error)
        assert len(found["teammates"]) == len(robot.neighbours)
    assert shown_at_all > 5 or degree == "none"


def test_targets_are_shown_as_measured(page: Page, tmp_path: Path) -> None:
    opened(page, written(tmp_path, recorded(noisy(), STEPS)))
    twin = noisy()
    twin.run(STEPS)
    at_tick(page, STEPS)
    count = 0
    for robot, found in inspected(page, twin):
        assert_same(sensed_in(found, "targets"), entries(robot.percept.targets), 1e-3)
        count += len(robot.percept.targets.identity)
    assert count > 3


RAYS = [
    (Box(8, 6), Lidar(5, 3.0, math.radians(180)), 1e-3),
    (Torus(6, 5), Lidar(32, 2.4), 1e-3),
    # Round walls are drawn with corners.
    (Disc(3.0), Lidar(1, 2.0, 0.3), 0.02),
]


@pytest.mark.parametrize(("arena", "lidar", "error"), RAYS, ids=["box", "torus", "disc"])
def test_the_rays_of_the_selected_robot_end_where_it_measures(
    page: Page, tmp_path: Path, shot: Callable[[Page, str], None], arena: Any, lidar: Lidar, error: float
) -> None:
    def world() -> World:
        blocks = Circle((1, 0.5), 0.6), Polygon([(-2, -1), (-1, -1), (-1.5, 0)])
        world = World(arena.with_obstacles(*blocks), contact="slide", rng=3)
        world.add(Robot, 10, policy="random-walk", radius=0.2, lidar=lidar, name="robots")
        world.senses(world.groups[0], world.add(Target, 4, policy="random-walk", radius=[0.0, 0.0, 0.3, 0.3]))
        world.groups[0][3].active = False
        return world

    opened(page, written(tmp_path, recorded(world(), STEPS)))
    twin = world()
    twin.run(STEPS)
    at_tick(page, STEPS)
    slots, robots = slots_of(page), twin.groups[0]
    shown = page.evaluate(
        """slots => slots.map(slot => teamsight.raysOf(teamsight.view.tracks[0].arena.layout, teamsight.view.frameOf(0), slot))""",
        [slots[robot.unique_id] for robot in robots],
    )
    readings = robots.percept.lidar
    angles = np.arctan2(*robots.heading.T[::-1])
    wrong = 0
    for i, rays in enumerate(shown):
        if i == 3:
            assert rays == []
            continue
        turned = np.array([one["angle"] for one in rays]) - angles[i] - lidar.bearings
        assert np.abs(np.sin(turned / 2)).max() < 1e-3
        far = np.abs(np.array([one["distance"] for one in rays]) - readings[i])
        # One that touches an edge is a matter of rounding.
        wrong += int((far > error).sum())
        assert all(one["isMet"] == (one["distance"] < lidar.range) for one in rays)
    assert wrong <= 0.03 * readings.size
    assert 0.2 < (readings < lidar.range).mean() < 1
    page.evaluate("slot => teamsight.view.select(0, slot)", slots[robots[0].unique_id])
    page.evaluate("teamsight.view.draw()")
    shot(page, f"lidar-{lidar.rays}")
    assert f"{lidar.rays} rays" in page.locator(".ts-facts div", has_text="Lidar").inner_text()


def inspected(page: Page, twin: CMOMMT) -> list[tuple[Robot, dict[str, Any]]]:
    """Return the robots of a model with what the page says of them; identities in place of slots."""
    slots = slots_of(page)
    script = """slots => slots.map(slot => {
        const {scene} = teamsight.view.tracks[0], found = teamsight.view.inspect(0, slot);
        const named = list => list && list.map(one => ({...one, id: scene.slots[one.slot].id}));
        return {...found, teammates: named(found.teammates), relayed: named(found.relayed),
            channels: found.channels.map(channel => ({...channel, sensed: named(channel.sensed)}))};
    })"""
    found = page.evaluate(script, [slots[robot.unique_id] for robot in twin.robots])
    return list(zip(twin.robots, found, strict=True))


def sensed_in(found: dict[str, Any], name: str) -> list[dict[str, Any]]:
    (channel,) = (one for one in found["channels"] if one["channel"] == name)
    sensed: list[dict[str, Any]] = channel["sensed"]
    return sensed


def entries(seen: Any) -> list[tuple[int, float, float]]:
    return [(int(identity), *offset) for identity, offset in zip(seen.identity, seen.offset.tolist(), strict=True)]


def assert_same(shown: list[dict[str, Any]], held: list[tuple[int, float, float]], error: float) -> None:
    assert sorted(one["id"] for one in shown) == sorted(identity for identity, _, _ in held)
    one_by_one = sorted(shown, key=lambda one: (one["id"], round(one["dx"], 2)))
    for one, (_, x, y) in zip(one_by_one, sorted(held, key=lambda one: (one[0], round(one[1], 2))), strict=True):
        assert math.hypot(one["dx"] - x, one["dy"] - y) <= error


def assert_same_ring(ring: list[dict[str, Any]], seen: Any, robot: Robot, error: float) -> int:
    """Compare occupied sectors and the nearest in them; return how many there are."""
    delta, heading = 8, math.atan2(robot.heading[1], robot.heading[0])
    bearings = np.arctan2(seen.offset[:, 1], seen.offset[:, 0]) - heading
    sectors = np.rint(bearings * delta / (2 * math.pi)).astype(int) % delta
    assert [one["sector"] for one in ring] == sorted(sectors.tolist())
    for sector, distance in zip(sectors.tolist(), seen.distance.tolist(), strict=True):
        (shown,) = (one for one in ring if one["sector"] == sector)
        assert shown["range"] == pytest.approx(distance, abs=error)
    return len(ring)


def test_charts_show_the_history_of_the_model(page: Page, tmp_path: Path) -> None:
    tracks = recorded(team(), STEPS, "with awareness"), recorded(team("none"), STEPS, "without")
    opened(page, written(tmp_path, *tracks))
    twins = team(), team("none")
    for tick in (0, 9, STEPS):
        for twin in twins:
            twin.run(tick - twin.clock.now)
        at_tick(page, tick)
        observed = [np.mean([target.is_observed for target in twin.targets]) for twin in twins]
        numbers = [[len(robot.neighbours) for robot in twin.robots] for twin in twins]
        points = round(100 * (observed[1] - observed[0]))
        charts = page.locator(".ts-chart")
        assert charts.nth(0).locator(".ts-value").all_inner_texts() == [f"{100 * share:.0f} %" for share in observed]
        assert charts.nth(2).locator(".ts-value").all_inner_texts() == [f"{np.mean(one):.2f}" for one in numbers]
        assert charts.nth(3).locator(".ts-value").all_inner_texts() == [str(max(one)) for one in numbers]
        sign = "+" if points > 0 else "−" if points < 0 else "±"
        assert charts.nth(1).locator(".ts-value").inner_text() == f"{sign}{abs(points)} points"
        assert charts.nth(1).locator("figcaption span").first.inner_text() == "Right − left"


def test_two_worlds_have_their_number_beside_their_name(page: Page, tmp_path: Path) -> None:
    opened(page, written(tmp_path, recorded(team(), STEPS, "aware"), recorded(team("none"), STEPS, "blind")))
    twins = team(), team("none")
    for tick in (0, STEPS):
        for twin in twins:
            twin.run(tick - twin.clock.now)
        at_tick(page, tick)
        shares = [100 * np.mean([target.is_observed for target in twin.targets]) for twin in twins]
        assert page.locator(".ts-observed").all_inner_texts() == [f"{share:.0f} % observed" for share in shares]
        assert page.locator(".ts-caption").all_inner_texts() == ["aware", "blind"]


def test_bodies_at_one_place_are_counted(page: Page, tmp_path: Path) -> None:
    world = World(Box(10, 10), rng=1)
    robots = world.add(Robot, 6, policy="stationary", awareness_range=1.0)
    for robot, place in zip(robots, [(1, 1)] * 4 + [(-3, 2), (4, 4)], strict=True):
        robot.position = place
    # Of other groups, those that are there too count apart; those that do nothing do not count.
    for target in world.add(Target, 2, policy="stationary"):
        target.position = (1, 1)
    robots[3].active = False
    opened(page, written(tmp_path, recorded(world, 1)))
    at_tick(page, 1)
    found = page.evaluate("""() => {
      const { arena } = teamsight.view.tracks[0];
      return arena.counts.map(({ x, y, count }) => [...arena.toArena(x, y, arena.at).map(Math.round), count]);
    }""")
    assert found == [[1, 1, 3], [1, 1, 2]]
    # Seen from near, the same places are apart.
    robots[3].active = True
    robots[0].position = (1.1, 1)
    opened(page, written(tmp_path, recorded(world, 1)))
    counts = "teamsight.view.tracks[0].arena.counts.map(({ count }) => count)"
    at_tick(page, 1)
    assert page.evaluate(counts) == [4, 2]
    page.evaluate("teamsight.view.zoom(15, 0.6, 0.6); teamsight.view.draw()")
    assert page.evaluate(counts) == [3, 2]


def test_charts_have_gaps_where_nothing_is_known(page: Page, tmp_path: Path) -> None:
    world = World(Disc(3.0), rng=1)
    robots, targets = world.add(Robot, 3, policy=RandomWalk(0.05)), world.add(Target, 2, policy=RandomWalk(0.05))
    world.senses(robots, targets)
    replay = world.record()
    world.run(3)
    for target in list(targets):
        target.remove()
    world.run(4)
    targets.add(2)
    world.run(3)
    opened(page, written(tmp_path, replay.stop(), recorded(team(), 6)))
    # How far apart the ends of each stroke are [ticks].
    widths = page.evaluate("""() => {
        const chart = teamsight.view.charts[0], found = []; let at = 0;
        const keep = (x, y) => { at = x; };
        chart.to.moveTo = keep;
        chart.to.lineTo = (x, y) => { found.push((x - at) / (chart.px(1) - chart.px(0))); keep(x, y); };
        chart.drawnTo = [];
        chart.drawLines(chart.lines.slice(0, 1));
        delete chart.to.moveTo;
        delete chart.to.lineTo;
        return found; }""")
    assert widths == pytest.approx([1] * 5)
    # The other run is over: nothing is compared with its last frame.
    difference = page.locator(".ts-chart").nth(1).locator(".ts-value")
    for tick, is_known in ((1, True), (6, False), (8, False)):
        at_tick(page, tick)
        assert difference.inner_text().endswith("points") == is_known
    assert page.evaluate("teamsight.view.shared.map((time, k) => Number.isFinite(teamsight.view.charts[1].lines[0].at(k)))") == [
        tick < 3 for tick in range(7)
    ]


def test_it_plays_and_pauses(page: Page, tmp_path: Path) -> None:
    opened(page, written(tmp_path, recorded(team(), STEPS)), playing=True)
    until(page, "teamsight.view.position > 2")
    page.keyboard.press("Space")
    assert page.evaluate("teamsight.view.playing") is False
    stopped = position(page)
    page.wait_for_timeout(150)
    assert position(page) == stopped
    page.get_by_role("button", name="Play", exact=True).click()
    until(page, f"teamsight.view.position === {STEPS} && !teamsight.view.playing")


def test_it_loops_and_skips(replay: Page) -> None:
    replay.keyboard.press("o")
    replay.select_option("select[aria-label=Speed]", "16")
    replay.select_option("select[aria-label='Frames to show']", "5")
    replay.evaluate("""() => { const { view } = teamsight, draw = view.draw.bind(view); window.seen = [];
        view.draw = now => { if (view.playing) seen.push(view.position); draw(now); }; view.play(); }""")
    until(replay, "seen.some((at, k) => k && at < seen[k - 1])")
    assert all(at % 5 == 0 for at in replay.evaluate("seen"))


@pytest.mark.parametrize(
    ("keys", "at"),
    [
        (["ArrowRight"] * 3, 3), (["End"], STEPS), (["End", "ArrowLeft"], STEPS - 1), (["PageDown", "PageUp", "ArrowLeft"], 0),
        (["PageDown", "PageDown", "Home", "ArrowRight"], 1),
    ],
)  # fmt: skip
def test_keys_move_in_time(replay: Page, keys: list[str], at: int) -> None:
    for key in keys:
        replay.keyboard.press(key)
    assert position(replay) == at


def test_the_slider_and_a_chart_move_in_time(replay: Page) -> None:
    slider = replay.get_by_role("slider", name="Tick")
    slider.fill("17")
    assert position(replay) == 17
    until(replay, "document.querySelector('.ts-scrub').getAttribute('aria-valuetext') === 'tick 17'")
    slider.press("ArrowRight")
    assert position(replay) == 18
    box = replay.locator(".ts-plot").first.bounding_box()
    assert box
    replay.mouse.move(box["x"] + box["width"] - 8, box["y"] + 30)
    replay.mouse.down()
    assert position(replay) == STEPS
    replay.mouse.move(box["x"] + 40 + (box["width"] - 48) / 2, box["y"] + 30)
    replay.mouse.up()
    assert position(replay) == pytest.approx(STEPS / 2, abs=1)


def test_two_runs_with_frames_at_other_ticks_show_the_same_time(page: Page, tmp_path: Path) -> None:
    seldom, often = team().record(steps=STEPS, every=10), team().record(steps=STEPS, every=4)
    opened(page, written(tmp_path, seldom, often))
    ticks = sorted({*range(0, STEPS + 1, 10), *range(0, STEPS + 1, 4)})
    assert page.evaluate("teamsight.view.times") == ticks
    times = "[teamsight.view.shownTime, ...[0, 1].map(t => teamsight.view.frameOf(t).time)]"
    slider = page.get_by_role("slider", name="Tick")
    # The slider is time: of a tick without a frame the nearest is shown, and each run shows its latest frame until then.
    for wanted, shown in ((3, [4, 0, 4]), (19, [20, 20, 20]), (28, [28, 20, 28]), (31, [30, 30, 28]), (STEPS, [40, 40, 40])):
        slider.fill(str(wanted))
        assert page.evaluate(times) == shown
        page.evaluate("teamsight.view.draw()")
        assert float(slider.input_value()) == shown[0]
    for key, shown in (("Home", [0, 0, 0]), ("ArrowRight", [4, 0, 4]), ("PageUp", [36, 30, 36]), ("ArrowLeft", [32, 30, 32]), ("End", [40, 40, 40])):
        slider.press(key)
        assert page.evaluate(times) == shown
    # The same model twice: they are compared only where both have a frame, and there nothing differs.
    shared = "teamsight.view.shared.map((time, k) => [time, teamsight.view.charts[1].lines[0].at(k)])"
    assert page.evaluate(shared) == [[tick, 0] for tick in range(0, STEPS + 1, 20)]


def test_bodies_are_drawn_between_the_frames_of_their_own_run(page: Page, tmp_path: Path) -> None:
    seldom, often = team().record(steps=STEPS, every=4), team().record(steps=STEPS)
    opened(page, written(tmp_path, seldom, often))
    # Half a tick after tick 6: run 0 is between its frames of ticks 4 and 8, run 1 between those of ticks 6 and 7.
    assert page.evaluate("teamsight.view.at = 6.5, [0, 1].map(t => teamsight.view.shareOf(t))") == [2.5 / 4, 0.5]


def test_keys_of_buttons_and_fields_are_theirs(replay: Page) -> None:
    replay.locator("select[aria-label=Speed]").focus()
    replay.keyboard.press("f")
    replay.keyboard.press("End")
    assert position(replay) == 0
    replay.get_by_role("button", name="Loop").focus()
    replay.keyboard.press("Space")
    assert replay.evaluate("[teamsight.view.playing, teamsight.view.loop]") == [False, True]


def test_zoom_and_pan_keep_places(replay: Page) -> None:
    before = drawn(replay)
    canvas = replay.locator(".ts-canvas canvas")
    box = canvas.bounding_box()
    assert box
    x, y = round(box["x"] + 0.4 * box["width"]), round(box["y"] + 0.3 * box["height"])
    under = "([x, y]) => { const { arena, canvas } = teamsight.view.tracks[0], at = canvas.getBoundingClientRect();" \
            "return arena.toArena((x - at.left) * arena.ratio, (y - at.top) * arena.ratio); }"  # fmt: skip
    there = replay.evaluate(under, [x, y])
    replay.mouse.move(x, y)
    replay.mouse.wheel(0, -400)
    until(replay, "teamsight.view.camera.zoom > 1.5")
    assert replay.evaluate(under, [x, y]) == pytest.approx(there, abs=1e-9)
    replay.mouse.down()
    replay.mouse.move(x + 90, y + 40, steps=4)
    replay.mouse.up()
    assert replay.evaluate(under, [x + 90, y + 40]) == pytest.approx(there, abs=1e-9)
    replay.evaluate("teamsight.view.draw()")
    after = drawn(replay)
    assert all(after[one] == pytest.approx(before[one], abs=1e-9) for one in before)
    assert replay.evaluate("teamsight.view.selected.slot") is None
    replay.keyboard.press("f")
    assert replay.evaluate("teamsight.view.camera.zoom") == 1


def test_a_click_selects_the_body_there_until_escape(replay: Page) -> None:
    robot = team().robots[5]
    click_on(replay, slots_of(replay)[robot.unique_id])
    inspector = replay.get_by_label("Inspector")
    assert f"robots · {robot.unique_id}" in inspector.inner_text()
    replay.keyboard.press("End")
    until(replay, f"teamsight.view.position === {STEPS}")
    assert f"robots · {robot.unique_id}" in inspector.inner_text()
    replay.keyboard.press("Escape")
    replay.mouse.move(2, 2)
    until(replay, "document.querySelector('.ts-inspector').innerText.includes('Hover or tap')")


def click_on(page: Page, slot: int) -> None:
    x, y = page.evaluate(
        """slot => { const { arena, canvas } = teamsight.view.tracks[0], at = canvas.getBoundingClientRect();
        teamsight.view.draw(); return [at.left + arena.px[slot] / arena.ratio, at.top + arena.py[slot] / arena.ratio]; }""",
        slot,
    )
    if page.evaluate("navigator.maxTouchPoints > 0"):
        page.touchscreen.tap(x, y)
    else:
        page.mouse.click(x, y)
    until(page, f"teamsight.view.selected.slot === {slot}")
    page.evaluate("teamsight.view.draw()")


def test_hovering_inspects(replay: Page) -> None:
    place = replay.evaluate("""() => { const { arena, canvas } = teamsight.view.tracks[0], at = canvas.getBoundingClientRect();
        teamsight.view.draw(); return [at.left + arena.px[20] / arena.ratio, at.top + arena.py[20] / arena.ratio]; }""")
    replay.mouse.move(*place)
    until(replay, "!document.querySelector('.ts-tip').hidden")
    assert replay.locator(".ts-tip").inner_text().startswith("targets 21, ")
    until(replay, "document.querySelector('.ts-inspector').innerText.includes('targets · 21')")


def test_toggles_change_the_picture(replay: Page) -> None:
    pixels = "teamsight.view.draw(), teamsight.view.tracks[0].canvas.toDataURL()"
    seen = {replay.evaluate(pixels)}
    for key in "ralkt":
        replay.keyboard.press(key)
        seen.add(replay.evaluate(pixels))
    # At the first frame there is no trail yet.
    assert len(seen) == 5
    replay.keyboard.press("End")
    with_trails = replay.evaluate(pixels)
    replay.keyboard.press("t")
    assert replay.evaluate(pixels) != with_trails
    assert replay.get_by_role("button", name="Links to teammates").get_attribute("aria-pressed") == "false"


def test_help_and_picture(replay: Page, tmp_path: Path) -> None:
    replay.keyboard.press("?")
    replay.get_by_role("dialog").get_by_role("button", name="Close").click()
    replay.keyboard.press("End")
    with replay.expect_download() as download:
        replay.keyboard.press("s")
    assert download.value.suggested_filename == f"cmommt-a-cmommt-seed-11-{STEPS}.png"
    assert Path(download.value.path()).read_bytes().startswith(b"\x89PNG")


def test_who_prefers_reduced_motion_starts_it(new_page: browsing.Pages, tmp_path: Path) -> None:
    page = opened(new_page(reduced_motion=True), written(tmp_path, recorded(team(), STEPS)), playing=True)
    page.wait_for_timeout(200)
    assert (position(page), page.evaluate("teamsight.view.playing")) == (0, False)
    assert "Tick 0." in page.get_by_role("status").inner_text()


@pytest.mark.parametrize(
    ("size", "dark"), [(browsing.WIDE, True), (browsing.PHONE, False), (browsing.PHONE, True), ((900, 560), False)]
)
def test_every_screen_fits_and_can_be_read(
    new_page: browsing.Pages, tmp_path: Path, shot: Callable[[Page, str], None], size: tuple[int, int], dark: bool
) -> None:
    tracks = recorded(team(), STEPS, "with awareness"), recorded(team("none"), STEPS, "without")
    page = opened(new_page(size=size, dark=dark), written(tmp_path, *tracks))
    at_tick(page, STEPS)
    click_on(page, 4)
    assert page.evaluate("document.documentElement.scrollWidth") <= size[0]
    assert page.evaluate(_FAINT) == []
    assert page.evaluate("[...document.querySelectorAll('button, select, input')].filter(one => one.offsetParent && "
                         "(one.getBoundingClientRect().right > innerWidth || one.getBoundingClientRect().left < 0)).length") == 0  # fmt: skip
    shot(page, f"replay-{size[0]}-{'dark' if dark else 'light'}")


# The texts whose contrast to their background is below 4.5, as WCAG 2 measures it.
_FAINT = """() => {
  const parse = text => text.match(/[\\d.]+/g).map(Number);
  const light = ([r, g, b]) => [r, g, b].map(v => v / 255).map(v => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
    .reduce((sum, v, k) => sum + v * [0.2126, 0.7152, 0.0722][k], 0);
  const ground = one => { for (; one; one = one.parentElement) {
    const colour = parse(getComputedStyle(one).backgroundColor); if (colour.length < 4 || colour[3] > 0) return colour; } return [255, 255, 255]; };
  return [...document.querySelectorAll('body *')].filter(one => one.offsetParent &&
      [...one.childNodes].some(node => node.nodeType === 3 && node.textContent.trim())).map(one => {
    const [a, b] = [light(parse(getComputedStyle(one).color)), light(ground(one))].sort((x, y) => x - y);
    return [(b + 0.05) / (a + 0.05), one.textContent]; }).filter(([ratio]) => ratio < 4.5);
}"""


def test_a_phone_selects_by_touch(new_page: browsing.Pages, tmp_path: Path) -> None:
    page = opened(new_page(size=browsing.PHONE), written(tmp_path, recorded(team(), STEPS)))
    click_on(page, 3)
    assert "robots · 4" in page.get_by_label("Inspector").inner_text()


def test_two_fingers_zoom_where_they_are(new_page: browsing.Pages, tmp_path: Path) -> None:
    page = opened(new_page(size=browsing.PHONE), written(tmp_path, recorded(team(), STEPS)))
    fingers = page.context.new_cdp_session(page)

    def touch(kind: str, *places: float) -> None:
        points = [{"x": x, "y": 250, "id": number} for number, x in enumerate(places)]
        fingers.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    touch("touchStart", 160, 200)
    for apart in range(5, 45, 5):
        touch("touchMove", 160 - apart, 200 + apart)
    touch("touchEnd")
    until(page, "Math.abs(teamsight.view.camera.zoom - 3) < 0.01")
    assert page.evaluate("teamsight.view.selected.slot") is None


def test_the_page_follows_the_colours_of_the_system(replay: Page) -> None:
    corner = """() => { teamsight.view.draw();
        return [...teamsight.view.tracks[0].canvas.getContext("2d").getImageData(2, 2, 1, 1).data].slice(0, 3); }"""
    assert min(replay.evaluate(corner)) > 200
    replay.emulate_media(color_scheme="dark")
    until(replay, "teamsight.view.palette.page === '#14171b'")
    assert max(replay.evaluate(corner)) < 50


def test_links_cross_the_seam_of_a_torus(page: Page, tmp_path: Path) -> None:
    opened(page, written(tmp_path, recorded(torus(), STEPS)))
    longest, crossing = (
        page.evaluate("""() => { const { layout, frames } = teamsight.view.tracks[0]; let longest = 0, crossing = 0;
        for (const frame of frames) for (let s = 0; s < 8; s++) for (const one of teamsight.percept(layout, frame, s).teammates) {
          longest = Math.max(longest, one.range);
          crossing += Math.abs(frame.x[one.slot] - frame.x[s]) > 32768 || Math.abs(frame.y[one.slot] - frame.y[s]) > 32768;
        } return [longest, crossing]; }""")
    )
    assert longest <= 1.6 + 1e-3
    assert crossing > 0


def test_a_frame_of_another_page_may_hold_it(page: Page, tmp_path: Path) -> None:
    inner = written(tmp_path, recorded(team(), STEPS)).read_text("utf-8")
    page.set_content('<iframe width="900" height="560" sandbox="allow-scripts" title="A recording"></iframe>')
    page.evaluate("text => { document.querySelector('iframe').srcdoc = text; }", inner)
    page.frame_locator("iframe").locator("#teamsight[data-state=ready]").wait_for()


@pytest.mark.parametrize("width", [660, 748, 860])
def test_the_charts_of_two_runs_in_a_frame_have_room_for_their_names(page: Page, tmp_path: Path, width: int) -> None:
    inner = written(tmp_path, recorded(team(), STEPS), recorded(team("none"), STEPS)).read_text("utf-8")
    page.set_content(f'<iframe width="{width}" height="560" sandbox="allow-scripts" title="A recording"></iframe>')
    page.evaluate("text => { document.querySelector('iframe').srcdoc = text; }", inner)
    page.frame_locator("iframe").locator("#teamsight[data-state=ready]").wait_for()
    page.evaluate("frames[0].postMessage({ teamsight: { scheme: 'light' } }, '*')")
    until(page.frames[1], "document.documentElement.classList.contains('ts-framed')")
    names = "[...document.querySelectorAll('.ts-chart figcaption > :first-child')]"
    assert page.frames[1].evaluate(f"{names}.length") == 4
    assert page.frames[1].evaluate(f"{names}.filter(one => one.scrollWidth > one.clientWidth).map(one => one.textContent)") == []


@pytest.mark.parametrize(("size", "width"), [(browsing.WIDE, "660px"), (browsing.WIDE, "1100px"), (browsing.PHONE, "100%")])
def test_a_frame_of_the_site_has_its_height_and_its_colours(
    new_page: browsing.Pages, tmp_path: Path, shot: Callable[[Page, str], None], size: tuple[int, int], width: str
) -> None:
    (tmp_path / "gallery").mkdir()
    written(tmp_path / "gallery", recorded(team(), STEPS))
    script = (Path(__file__).resolve().parents[2] / "docs" / "assets" / "gallery.js").read_text("utf-8")
    outer = tmp_path / "outer.html"
    outer.write_text(
        "<!doctype html><meta name=viewport content='width=device-width'><title>A site</title><style>body { margin: 0 } "
        f"iframe {{ width: {width}; border: 1px solid; box-sizing: border-box }}</style><body data-md-color-scheme=slate>"
        f"<iframe src='gallery/recording.html' title='A recording' height=300></iframe><p>After it</p><script>{script}</script>", "utf-8",
    )  # fmt: skip
    page = new_page(size=size)
    page.goto(outer.as_uri())
    page.frame_locator("iframe").locator("#teamsight[data-state=ready]").wait_for()
    inner = page.frames[1]
    until(inner, "document.documentElement.scrollHeight <= innerHeight && innerHeight > 500")
    # What was said is what is needed: without empty room below, and it stays so.
    high = inner.evaluate("innerHeight")
    assert inner.evaluate("document.getElementById('teamsight').getBoundingClientRect().height") > high - 2
    # The system is light, and the site dark.
    until(inner, "teamsight.view.palette.page === '#14171b'")
    assert inner.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(20, 23, 27)"
    shot(page, f"framed-{size[0]}-{width.rstrip('%')}")
    page.evaluate("document.body.setAttribute('data-md-color-scheme', 'default')")
    until(inner, "teamsight.view.palette.page === '#f6f7f9'")
    assert inner.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(246, 247, 249)"
    inner.evaluate("teamsight.view.select(0, 2)")
    until(inner, "document.querySelector('.ts-inspector').innerText.includes('robots · 3')")
    until(inner, "document.documentElement.scrollHeight <= innerHeight")
    taller = inner.evaluate("innerHeight")
    assert high <= taller < high + 800
    inner.evaluate("teamsight.view.select(0, null)")
    until(inner, "document.querySelector('.ts-inspector').innerText.includes('Hover')")
    page.wait_for_timeout(200)
    assert inner.evaluate("innerHeight") == taller


def test_on_a_phone_two_worlds_in_a_text_are_beside_each_other(new_page: browsing.Pages, tmp_path: Path) -> None:
    page = opened(new_page(size=browsing.PHONE), written(tmp_path, recorded(team(), 3, "one"), recorded(team(), 3, "two")))
    left = "[...document.querySelectorAll('.ts-canvas')].map((one) => one.getBoundingClientRect().left)"
    assert len(set(page.evaluate(left))) == 1
    page.evaluate("document.documentElement.classList.add('ts-framed')")
    assert len(set(page.evaluate(left))) == 2
    title = page.locator(".ts-difference figcaption span").first
    assert title.inner_text() == "Right − left"
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"frames":"', '"frames":"AAAA', "The recording cannot be shown"),
        ('"tracks":[', '"tracks":[[', "The recording cannot be shown"),
    ],
)
def test_broken_data_are_said_in_the_page(page: Page, tmp_path: Path, old: str, new: str, message: str) -> None:
    file = written(tmp_path, recorded(team(), 3))
    file.write_text(file.read_text("utf-8").replace(old, new), "utf-8")
    opened(page, file, state="error")
    assert message in page.get_by_role("alert").inner_text()


def test_a_browser_that_cannot_unpack_says_so(page: Page, tmp_path: Path) -> None:
    page.add_init_script("delete window.DecompressionStream")
    opened(page, written(tmp_path, recorded(team(), 3)), state="error")
    assert "Chrome 93" in page.get_by_role("alert").inner_text()


def test_one_frame_is_a_recording(page: Page, tmp_path: Path) -> None:
    world = World(Disc(3), rng=1)
    world.add(Robot, 1, policy=RandomWalk(0.1), speed=0.1)
    opened(page, written(tmp_path, recorded(world, 0)))
    for key in ["Space", "ArrowRight", "End", "l", "]", "+"]:
        page.keyboard.press(key)
    assert position(page) == 0
    assert len(drawn(page)) == 1
