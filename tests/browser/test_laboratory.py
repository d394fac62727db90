"""The laboratory of the live page: interventions by mouse and keyboard, and copies as text."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import browsing
import numpy as np
import pytest
from live_pages import press, settled, shown, until, world_of

from teamsight import CMOMMT
from teamsight.agents.sensing.sensor import Sensor
from teamsight.live import LivePage
from teamsight.policies import ACmommt
from teamsight.tasks.registry import TASKS
from teamsight.world import Torus

if TYPE_CHECKING:
    from playwright.sync_api import Page

_PLACE = """([x, y, track]) => {
  const { arena, canvas } = teamsight.view.tracks[track], { layout } = arena, at = arena.transform(), box = canvas.getBoundingClientRect();
  return [box.left + (at.left + (x - at.x) * at.scale) / arena.ratio, box.top + (at.top - (y - at.y) * at.scale) / arena.ratio];
}"""


def pixel(page: Page, place: Any, track: int = 0) -> list[float]:
    """Return where a place of the arena is on the screen."""
    found: list[float] = page.evaluate(_PLACE, [float(place[0]), float(place[1]), track])
    return found


def choose(page: Page, tool: str) -> None:
    page.locator(f".tl-tools input[value={tool}]").check()


def drag(page: Page, *places: Any) -> None:
    page.mouse.move(*pixel(page, places[0]))
    page.mouse.down()
    for place in places[1:]:
        page.mouse.move(*pixel(page, place))
    page.mouse.up()


def click(page: Page, place: Any, track: int = 0) -> None:
    page.mouse.move(*pixel(page, place, track))
    page.mouse.down()
    page.mouse.up()


def test_what_a_visitor_does_is_repeated_by_the_copied_python(page: Page, live: Callable[..., LivePage], shot: Any) -> None:
    server = live(parameters={"robots": 3, "targets": 3, "awareness": "pairwise"})
    shown(page, server)
    world = world_of(server)
    for tick in range(1, 4):
        page.get_by_role("button", name="Step", exact=True).click()
        until(lambda tick=tick: world.tick == tick)
    settled(page, server)
    robot, target = world.robots[0], world.targets[1]
    choose(page, "move")
    drag(page, robot.position, (2.0, 2.0), (3.0, 2.5))
    until(lambda: np.abs(robot.position - (3.0, 2.5)).max() < 0.03)
    settled(page, server)
    choose(page, "switch")
    click(page, robot.position)
    until(lambda: not robot.active)
    settled(page, server)
    page.wait_for_function("() => teamsight.view.tracks[0].frames.at(-1).flags[0] === 1")
    click(page, robot.position)
    until(lambda: robot.active)
    choose(page, "add")
    page.locator("#tl-group").select_option("1")
    click(page, (-3.0, 3.0))
    until(lambda: len(world.targets) == 4)
    settled(page, server)
    choose(page, "remove")
    page.wait_for_function("() => teamsight.view.tracks[0].scene.slots.length === 7")
    click(page, target.position)
    until(lambda: len(world.targets) == 3)
    settled(page, server)
    places = np.concatenate([world.robots.position, world.targets.position])
    free = [(x, y) for x in np.linspace(-3, 3, 13) for y in np.linspace(-3, 3, 13)]
    free.sort(key=lambda one: -np.hypot(*(places - one).T).min())
    x, y = free[0]
    choose(page, "circle")
    drag(page, (x, y), (x + 0.2, y), (x + 0.3, y))
    until(lambda: "Circle" in repr(world.arena))
    page.wait_for_function("() => teamsight.view.tracks[0].scene.obstacles.length === 1")
    page.get_by_role("button", name="Step", exact=True).click()
    until(lambda: world.tick == 4)
    settled(page, server)
    shot(page, "live-laboratory")
    logged = page.locator(".ts-log tbody").inner_text()
    for what in ("moved", "inactive", "active", "joined", "left", "obstacle added"):
        assert what in logged
    page.get_by_role("button", name="Copy as Python").click()
    page.wait_for_function("() => document.querySelector('.tl-copied').open")
    shot(page, "live-copied")
    names: dict[str, Any] = {}
    exec(page.locator(".tl-copied textarea").input_value(), names)
    again = names["model"]
    assert again.tick == 4
    for one, other in zip(again.groups, world.groups, strict=True):
        assert one.position.tobytes() == other.position.tobytes()
    assert again.events.equals(world.events)
    page.get_by_role("button", name="Close the copy").click()
    page.get_by_role("button", name="Copy as command").click()
    page.wait_for_function("() => document.querySelector('.tl-copied textarea').value.startsWith('teamsight watch --robots 3')")
    page.get_by_text("What was done to the world is not in the command").wait_for()


def test_rectangles_and_free_lines_become_polygons_and_can_be_removed(page: Page, live: Callable[..., LivePage]) -> None:
    server = live(parameters={"robots": 1, "targets": 1})
    shown(page, server)
    world = world_of(server)
    robot = world.robots[0]
    choose(page, "move")
    for agent, place in ((robot, (-3, -3)), (world.targets[0], (-3, -2))):
        drag(page, agent.position, place)
        until(lambda agent=agent, place=place: np.abs(agent.position - place).max() < 0.03)
        settled(page, server)
    choose(page, "rectangle")
    drag(page, (0, 0), (1, 1), (2, 1))
    until(lambda: len(getattr(world.arena, "obstacles", ())) == 1)
    assert np.abs(world.arena.obstacles[0].vertices - [[0, 0], [2, 0], [2, 1], [0, 1]]).max() < 0.03
    choose(page, "polygon")
    angles = np.linspace(0, 2 * np.pi, 60)
    drag(page, *np.stack([0.8 * np.cos(angles) - 1, 0.8 * np.sin(angles) + 2.5], axis=1))
    until(lambda: len(world.arena.obstacles) == 2)
    assert 6 <= len(world.arena.obstacles[1].vertices) <= 40
    # Over a body: a sentence, and nothing changes.
    choose(page, "circle")
    drag(page, (-3, -3), (-2.7, -3), (-2.6, -3))
    page.get_by_role("alert").get_by_text("would be in an obstacle; move it first").wait_for()
    assert len(world.arena.obstacles) == 2
    page.get_by_role("button", name="Remove drawn obstacles").click()
    until(lambda: not hasattr(world.arena, "obstacles"))
    page.wait_for_function("() => teamsight.view.tracks[0].scene.obstacles.length === 0")
    # Esc ends, and a click selects again.
    press(page, "Escape")
    settled(page, server)
    click(page, robot.position)
    page.wait_for_function("() => teamsight.view.selected.slot === 0")


def test_all_of_it_by_keyboard(page: Page, live: Callable[..., LivePage]) -> None:
    server = live(parameters={"robots": 2, "targets": 2})
    shown(page, server)
    world = world_of(server)
    press(page, "]")
    page.locator(".tl-exact summary").focus()
    page.keyboard.press("Enter")
    for name, value in (("x", "1.5"), ("y", "-2"), ("size", "0.25")):
        page.locator(f"#tl-{name}").fill(value)
    page.get_by_role("button", name="Move the selected body there").press("Enter")
    until(lambda: world.robots[0].position.tolist() == [1.5, -2.0])
    page.get_by_role("button", name="Fail or repair the selected body").press("Enter")
    until(lambda: not world.robots[0].active)
    page.get_by_role("button", name="Add a circle there").press("Enter")
    page.get_by_role("alert").get_by_text("would be in an obstacle").wait_for()
    page.get_by_role("button", name="Remove the selected body").press("Enter")
    until(lambda: len(world.robots) == 1)
    page.get_by_role("button", name="Add a circle there").press("Enter")
    until(lambda: "Circle((1.5, -2.0), 0.25)" in repr(world.arena) or hasattr(world.arena, "obstacles"))


def test_numbers_that_are_none_are_said(page: Page, live: Callable[..., LivePage]) -> None:
    server = live(parameters={"robots": 2, "targets": 2})
    shown(page, server)
    page.locator(".tl-exact summary").click()
    alert = page.get_by_role("alert")
    page.locator("#tl-size").fill("-1")
    page.get_by_role("button", name="Add a circle there").click()
    alert.get_by_text("radius: must be a number above 0").wait_for()
    page.locator("#tl-x").fill("")
    for name in ("Add a body there", "Add a circle there"):
        page.get_by_role("button", name=name).click()
        alert.get_by_text("x and y: must be numbers").wait_for()
    page.locator("#tl-every").fill("0")
    page.locator("#tl-every").press("Enter")
    alert.get_by_text("draw every 0 steps: must be a whole number from 1 to 10,000").wait_for()
    assert page.locator("#tl-every").input_value() == "1"
    until(lambda: not server.session.busy())
    assert len(world_of(server).robots) == 2
    assert not len(world_of(server).events)


def test_two_worlds_meet_the_same_interventions(page: Page, live: Callable[..., LivePage]) -> None:
    server = live(parameters={"robots": 3, "targets": 2}, beside={"awareness": "none"})
    shown(page, server)
    choose(page, "move")
    drag(page, world_of(server).robots[0].position, (0, 1), (0, 2))
    for track in (0, 1):
        until(lambda track=track: np.abs(world_of(server, track).robots[0].position - (0, 2)).max() < 0.06)
    settled(page, server)
    page.get_by_role("radio", name="right").check()
    choose(page, "switch")
    click(page, world_of(server, 1).robots[0].position, track=1)
    until(lambda: not world_of(server, 1).robots[0].active)
    assert world_of(server).robots[0].active
    # A click in the other world turns to it, and so do its settings and the selection.
    settled(page, server)
    click(page, world_of(server).robots[0].position)
    until(lambda: not world_of(server).robots[0].active)
    assert page.get_by_role("radio", name="left").is_checked()
    assert page.locator("#tl-awareness").input_value() == "pairwise"
    choose(page, "look")
    click(page, world_of(server, 1).robots[1].position, track=1)
    page.wait_for_function("() => teamsight.view.selected.track === 1 && teamsight.view.selected.slot === 1")
    assert page.get_by_role("radio", name="right").is_checked()
    assert page.locator("#tl-awareness").input_value() == "none"
    page.get_by_role("radio", name="left").check()
    page.wait_for_function("() => teamsight.view.selected.track === 0 && teamsight.view.selected.slot === 1")


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_no_two_buttons_have_one_name(new_page: browsing.Pages, live: Callable[..., LivePage], dark: bool, shot: Any) -> None:
    server, page = live(), new_page(size=browsing.PHONE, dark=dark)
    shown(page, server)
    page.locator(".tl-exact summary").click()
    shot(page, f"live-laboratory-phone-{'dark' if dark else 'light'}")
    names = page.evaluate(
        "() => [...document.querySelectorAll('button')].filter((one) => one.checkVisibility()).map((one) => one.ariaLabel || one.textContent.trim())"
    )
    assert sorted({name for name in names if names.count(name) > 1}) == []
    assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")


def test_the_address_is_a_link_to_what_is_shown(new_page: browsing.Pages, live: Callable[..., LivePage]) -> None:
    server, page = live(parameters={"robots": 6}, token="a-word-of-my-own"), new_page()
    shown(page, server)
    page.wait_for_function("() => location.hash.includes('robots=6')")
    page.get_by_label("policy").first.select_option("centroid")
    page.locator("#tl-seed").fill("77")
    page.locator("#tl-seed").press("Enter")
    until(lambda: world_of(server).seed_used == 77)
    for tick in range(1, 4):
        page.get_by_role("button", name="Step", exact=True).click()
        until(lambda tick=tick: world_of(server).tick == tick)
    page.wait_for_function("() => location.hash.includes('tick=3') && location.hash.includes('policy=centroid')")
    address = page.evaluate("() => location.href")
    assert "?token=a-word-of-my-own#v=1&task=CMOMMT&seed=77" in address
    expected = world_of(server).robots.position.tobytes()
    # Elsewhere, and by somebody else.
    page.get_by_role("button", name="Reset").click()
    until(lambda: world_of(server).tick == 0)
    page.locator("#tl-robots").fill("9")
    page.locator("#tl-robots").press("Enter")
    until(lambda: len(world_of(server).robots) == 9)
    other = new_page()
    other.goto(address)
    until(lambda: world_of(server).tick == 3 and len(world_of(server).robots) == 6)
    assert world_of(server).robots.position.tobytes() == expected
    settled(other, server)
    # Loaded again, it shows what runs.
    other.get_by_role("button", name="Step", exact=True).click()
    until(lambda: world_of(server).tick == 4)
    settled(other, server)
    other.reload()
    settled(other, server)
    assert world_of(server).tick == 4


@pytest.mark.parametrize("link", ["v=7&task=CMOMMT&robots=3", "%%&&==", "v=1&task=CMOMMT&policy=os:system", "v=1&task=hives"])
def test_a_damaged_link_is_a_sentence_and_the_page_goes_on(page: Page, live: Callable[..., LivePage], link: str) -> None:
    server = live(parameters={"robots": 4})
    shown(page, server, f"#{link}")
    page.get_by_role("alert").get_by_text("This link cannot be opened").wait_for()
    assert len(world_of(server).robots) == 4
    page.get_by_role("button", name="Step", exact=True).click()
    until(lambda: world_of(server).tick == 1)
    page.wait_for_function("() => location.hash.startsWith('#v=1&task=CMOMMT&seed=5&tick=1&robots=4')")


@pytest.mark.parametrize(
    ("link", "said"),
    [
        ("v=1&task=CMOMMT&tick=3&did=2+move+0+99+0+0", "cannot be followed beyond tick 2: body 99 of robots"),
        ("v=1&task=CMOMMT&tick=3&did=2+eval+0", "cannot be opened: did 'eval': unknown"),
        ("v=1&task=CMOMMT&policy=a-cmommt&policy.gain=<b>", "cannot be opened: policy.gain '<b>'"),
        ("v=1&task=CMOMMT&did=" + 5000 * "x", "cannot be opened: it has 5,020 characters, at most 4,000"),
    ],
)  # fmt: skip
def test_a_hostile_link_is_a_sentence_and_the_page_goes_on(page: Page, live: Callable[..., LivePage], link: str, said: str) -> None:
    server = live(parameters={"robots": 4})
    page.goto(server.url + f"#{link}")
    page.get_by_role("alert").get_by_text(said).wait_for()
    settled(page, server)
    assert (len(world_of(server).robots), world_of(server).tick) == (4, 0)
    page.get_by_role("button", name="Step", exact=True).click()
    until(lambda: world_of(server).tick == 1)


def test_a_copied_link_leads_to_what_was_done(new_page: browsing.Pages, live: Callable[..., LivePage], shot: Any) -> None:
    server, page = live(parameters={"robots": 3, "targets": 3, "policy": ACmommt(gain=2.0)}, token="a-word-of-my-own"), new_page()
    shown(page, server)
    world = world_of(server)
    page.get_by_role("button", name="Step", exact=True).click()
    until(lambda: world.tick == 1)
    settled(page, server)
    choose(page, "move")
    drag(page, world.robots[0].position, (2.0, 2.0), (3.0, 2.5))
    until(lambda: np.abs(world.robots[0].position - (3.0, 2.5)).max() < 0.03)
    page.get_by_role("button", name="Step", exact=True).click()
    until(lambda: world.tick == 2)
    page.wait_for_function("() => location.hash.includes('tick=2') && location.hash.includes('did=1+move')")
    page.get_by_role("button", name="Copy as link").click()
    page.wait_for_function("() => document.querySelector('.tl-copied').open")
    page.get_by_text("It has the token of this page").wait_for()
    shot(page, "live-link")
    link = page.locator(".tl-copied textarea").input_value()
    assert link == page.evaluate("() => location.href")
    other_server, other = live(), new_page(size=browsing.PHONE, dark=True)
    shown(other, other_server)
    other.evaluate("hash => { location.hash = hash; }", "#" + link.partition("#")[2])
    until(lambda: world_of(other_server).tick == 2 and len(world_of(other_server).robots) == 3)
    settled(other, other_server)
    again = world_of(other_server)
    for one, one_again in zip(world.groups, again.groups, strict=True):
        assert one.position.tobytes() == one_again.position.tobytes()
    assert again.events.equals(world.events)
    # The option that the link has brought is a control.
    assert other.locator("[id='tl-policy.gain']").input_value() == "2"
    assert "moved" in other.locator(".ts-log tbody").inner_text()
    shot(other, "live-link-phone-dark")
    # What another page could not know is said.
    mine = live(parameters={"robots": 3, "sensor": Sensor(missed=0.25)})
    shown(page, mine)
    page.get_by_role("button", name="Copy as link").click()
    page.get_by_text("sensor=Sensor(missed=0.25) is known only to a page that was started with it.").wait_for()
    shot(page, "live-link-said")


def test_a_link_to_a_late_tick_shows_its_progress(page: Page, live: Callable[..., LivePage]) -> None:
    server = live(parameters={"robots": 4})
    page.goto(server.url + "#v=1&task=CMOMMT&seed=5&robots=4&tick=1000000")
    page.get_by_text("Running to tick 1,000,000").wait_for()
    page.get_by_role("button", name="Reset").click()
    until(lambda: world_of(server).tick == 0)


def test_all_tasks_can_be_chosen_without_a_restart(page: Page, live: Callable[..., LivePage], shot: Any) -> None:
    server = live(parameters={"robots": 4})
    shown(page, server)
    names = page.locator("#tl-task option").all_inner_texts()
    # CMOMMT is one of them, by the name of its class.
    assert names == ["CMOMMT", *[name for name in TASKS if name != "cmommt"]]
    for name in names[1:]:
        page.locator("#tl-task").select_option(name)
        until(lambda name=name: server.session.worlds.model.__name__ == name)
        until(lambda: not server.session.busy())
        page.wait_for_function("name => document.title === `teamsight: ${name}`", arg=name)
        settled(page, server)
        tick = world_of(server).tick
        page.get_by_role("button", name="Step", exact=True).click()
        until(lambda tick=tick: world_of(server).tick == tick + 1)
    # The address follows the world with a delay.
    page.wait_for_function("name => location.hash.includes(`task=${name}`) && location.hash.includes('tick=1')", arg=name)
    shot(page, "live-task")
    address = page.evaluate("() => location.href")
    page.locator("#tl-task").select_option("CMOMMT")
    until(lambda: server.session.worlds.model is CMOMMT)
    # As it was given.
    assert len(world_of(server).robots) == 4
    settled(page, server)
    page.wait_for_function("() => location.hash.includes('task=CMOMMT')")
    page.evaluate("address => { location.hash = new URL(address).hash; }", address)
    until(lambda: server.session.worlds.model is not CMOMMT)
    until(lambda: world_of(server).tick == 1)


def test_the_arena_is_chosen_without_a_restart(new_page: browsing.Pages, live: Callable[..., LivePage], shot: Any) -> None:
    server, page = live(parameters={"robots": 6}), new_page()
    shown(page, server)
    page.get_by_label("arena shape").select_option("torus")
    until(lambda: type(world_of(server).arena) is Torus)
    page.wait_for_function("() => location.hash.includes('arena_shape=torus')")
    page.get_by_role("button", name="Step", exact=True).click()
    until(lambda: world_of(server).tick == 1)
    settled(page, server)
    shot(page, "live-torus")
    for form, said in (("Python", "arena_shape='torus'"), ("command", "--arena-shape torus"), ("link", "arena_shape=torus&tick=1")):
        page.get_by_role("button", name=f"Copy as {form}").click()
        page.wait_for_function(
            "words => { const { value } = document.querySelector('.tl-copied textarea'); return words.every((word) => value.includes(word)); }",
            arg=said.split("&"),
        )
        page.get_by_role("button", name="Close the copy").click()
    # A range that reaches around it is refused, and the torus stays.
    page.locator("#tl-radius").fill("0.9")
    page.locator("#tl-radius").press("Enter")
    page.get_by_role("alert").get_by_text("on a torus a range must be at most half of the shorter side").wait_for()
    assert world_of(server).radius == 5.0


def test_presets_show_two_worlds(page: Page, live: Callable[..., LivePage], shot: Any) -> None:
    server = live(parameters={"robots": 6})
    shown(page, server)

    def degrees() -> list[Any]:
        return [(track.world.awareness.name, getattr(track.world.awareness, "delta", None)) for track in server.session.worlds.tracks]

    page.get_by_role("button", name="Blind and aware").click()
    until(lambda: degrees() == [("none", None), ("pairwise", None)] and server.session.is_running)
    page.get_by_role("button", name="δ = 2").click()
    until(lambda: degrees() == [("ring", 2), ("pairwise", None)])
    page.get_by_role("button", name="Failures").click()
    until(lambda: [len(track.world.sources) for track in server.session.worlds.tracks] == [0, 1])
    assert [len(track.world.robots) for track in server.session.worlds.tracks] == [6, 6]
    page.wait_for_function("() => teamsight.view.tracks.length === 2 && teamsight.view.shownTime > 50")
    shot(page, "live-presets")


def test_a_run_of_a_study_is_shown_by_its_id(page: Page, live: Callable[..., LivePage]) -> None:
    def row(run: str) -> Any:
        if run != "0123456789abcdef-7":
            raise ValueError(f"run={run!r}: is no run id; copy one from the table")
        return CMOMMT, {"robots": 3, "rng": 99}

    server = live(row=row)
    shown(page, server)
    page.get_by_label("run of the study").fill("../../etc/passwd")
    page.get_by_role("button", name="Show this run").click()
    page.get_by_role("alert").get_by_text("is no run id").wait_for()
    # To be corrected, not typed again.
    assert page.get_by_label("run of the study").input_value() == "../../etc/passwd"
    page.get_by_label("run of the study").fill("0123456789abcdef-7")
    page.get_by_label("run of the study").press("Enter")
    until(lambda: world_of(server).seed_used == 99 and len(world_of(server).robots) == 3)
    settled(page, server)
    # Without a study there is none to open.
    other = live()
    shown(page, other)
    assert page.get_by_label("run of the study").count() == 0
    page.evaluate("() => teamsight.live.link.send('row', { run: '0123456789abcdef-7' })")
    page.get_by_role("alert").get_by_text("there is no study").wait_for()
