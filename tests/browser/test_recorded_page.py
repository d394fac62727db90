"""The page of recorded robots in a real browser: a file is dropped, played, and answered; bad ones change nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import browsing
import numpy as np
import pandas as pd
import pytest

from teamsight.live import LivePage, watch, watch_trajectories
from teamsight.live.recorded import Choice, read_recorded

if TYPE_CHECKING:
    from playwright.sync_api import Page

_DROP = """([name, text]) => {
  const files = new DataTransfer();
  files.items.add(new File([text], name));
  dispatchEvent(new DragEvent("dragenter", { dataTransfer: files }));
  dispatchEvent(new DragEvent("drop", { dataTransfer: files, cancelable: true }));
}"""


def csv_of(robots: int = 6, frames: int = 300) -> str:
    """Return robots that walk at random, with names."""
    rng = np.random.default_rng(3)
    # Folded into a square with a side of 3.
    place = 3 - np.abs(np.cumsum(rng.normal(0, 0.3, (frames, robots, 2)), axis=0) % 6 - 3)
    table = pd.DataFrame({
        "time": np.repeat(0.1 * np.arange(frames), robots).round(3), "robot": np.tile([*"abcdefghij"[:robots]], frames),
        "x": place[..., 0].ravel().round(4), "y": place[..., 1].ravel().round(4),
    })  # fmt: skip
    return table.to_csv(index=False)


@pytest.fixture
def served(problems: browsing.Problems, tmp_path: Path) -> Iterator[Callable[..., LivePage]]:
    """Serves pages on free ports, and closes them."""
    made: list[LivePage] = []

    def serve(text: str | None = None, *, world: bool = False, **how: Any) -> LivePage:
        how = {"port": 0, "browser": False, "wait": False} | how
        if world:
            made.append(watch(parameters={"robots": 2, "targets": 2, "seed": 1}, running=False, **how))
        else:
            place = tmp_path / "team.csv"
            place.write_text(text or "")
            made.append(watch_trajectories(None if text is None else place, **how))
        return made[-1]

    yield serve
    problems.expect("ERR_CONNECTION_REFUSED")
    for one in made:
        one.close()


def ready(page: Page, name: str) -> None:
    page.wait_for_function(
        "name => teamsight.recorded?.view.heading.textContent === name && !teamsight.recorded.isNew"
        " && !teamsight.recorded.isWaiting && teamsight.view.drawings > 0",
        arg=name,
    )


def test_it_plays_the_file_and_says_what_it_understood(
    page: Page, served: Callable[..., LivePage], shot: Any
) -> None:
    page.goto(served(csv_of(frames=2000), awareness_range=1.0).url)
    ready(page, "team.csv")
    for text in ("6: a, b, c, d, e, f", "12,000", "none longer than 0.5", "robots start together"):
        page.get_by_text(text, exact=True).wait_for()
    team = read_recorded("team.csv", content=csv_of(frames=2000).encode())
    found = team.answer(Choice(awareness_range=1.0))
    assert found["delta"] is not None
    assert page.locator(".tr-delta-text").text_content() == f"δ = {found['delta']}"
    assert page.locator(".tr-cautions li").all_text_contents() == found["cautions"]
    # It plays, and its clock is that of the record.
    page.wait_for_function("() => teamsight.view.position > 3")
    page.keyboard.press("End")
    page.get_by_text("time 199.9", exact=True).wait_for()
    page.evaluate("() => teamsight.view.select(0, 1)")
    page.get_by_role("heading", name="robots · b").wait_for()
    shot(page, "recorded")


def test_range_and_risk_redraw_the_answer(page: Page, served: Callable[..., LivePage]) -> None:
    page.goto(served(csv_of(), awareness_range=0.2).url)
    ready(page, "team.csv")
    links = "() => teamsight.view.tracks[0].frames[0].links[0].source.length"
    few = page.evaluate(links)
    page.get_by_label("Awareness range", exact=True).fill("2.5")
    page.wait_for_function(f"few => ({links})() > few", arg=few)
    # Half a number is no error; one that is left so is.
    page.get_by_label("Risk", exact=True).fill("")
    assert page.get_by_role("alert").is_hidden()
    page.get_by_label("Risk", exact=True).press("Tab")
    page.get_by_role("alert").get_by_text("must be a number above 0").wait_for()
    assert page.get_by_label("Risk", exact=True).input_value() == "0.01"
    slider = page.get_by_role("slider", name="Risk, slider")
    slider.focus()
    slider.press("End")
    page.wait_for_function("() => teamsight.recorded.choice.risk === 0.5")
    page.get_by_text("risk 50 %").wait_for()


def test_bad_files_leave_the_page_as_it_was(page: Page, served: Callable[..., LivePage]) -> None:
    page.goto(served(csv_of(), awareness_range=1.0).url)
    ready(page, "team.csv")
    answer = page.locator(".tr-panel").text_content()
    for name, text, reason in [
        ("nonsense.csv", "hello\nworld", "separated by commas"),
        ("empty.csv", "", "the file is empty"),
        ("photo.png", "x", "drop a .csv"),
        ("one.csv", "time,robot,x,y\n0,a,1,1\n1,a,1,1\n", "at least 2 robots"),
    ]:
        page.evaluate(_DROP, [name, text])
        page.get_by_role("alert").get_by_text(reason).wait_for()
        ready(page, "team.csv")
        assert page.locator(".tr-panel").text_content() == answer
    page.get_by_role("button", name="Dismiss").click()
    page.evaluate(_DROP, ["other.csv", csv_of(robots=3)])
    ready(page, "other.csv")
    page.get_by_text("is a guess").wait_for()
    # The address names it, as long as the server keeps it.
    page.reload()
    ready(page, "other.csv")
    assert page.evaluate("() => teamsight.view.tracks[0].scene.slots.length") == 3


def test_two_files_that_are_dropped_at_once_are_no_error(page: Page, served: Callable[..., LivePage]) -> None:
    page.goto(served(csv_of(), awareness_range=1.0).url)
    ready(page, "team.csv")
    page.evaluate("() => { const { recorded } = teamsight; recorded.said = []; recorded.fail = (text) => recorded.said.push(text); }")
    first, second = ["one.csv", csv_of(robots=4)], ["two.csv", csv_of(robots=5)]
    page.evaluate(f"([one, two]) => {{ for (const each of [one, two]) ({_DROP})(each); }}", [first, second])
    ready(page, "two.csv")
    # What the server has answered is read in order.
    page.get_by_label("Risk", exact=True).fill("0.2")
    page.wait_for_function("() => teamsight.recorded.choice.risk === 0.2 && !teamsight.recorded.isWaiting")
    assert page.evaluate("() => teamsight.recorded.said") == []
    assert page.evaluate("() => teamsight.view.tracks[0].scene.slots.length") == 5


def test_a_page_without_a_file_invites_one(page: Page, served: Callable[..., LivePage], tmp_path: Path) -> None:
    page.goto(served().url)
    page.get_by_role("heading", name="Your robots, your δ").wait_for()
    assert page.get_by_role("group", name="Playing").is_hidden()
    (tmp_path / "chosen.csv").write_text(csv_of())
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Open CSV …").click()
    chooser.value.set_files(tmp_path / "chosen.csv")
    ready(page, "chosen.csv")


def test_the_page_of_a_world_opens_a_file_that_is_dropped(
    page: Page, served: Callable[..., LivePage], problems: browsing.Problems
) -> None:
    server = served(world=True)
    page.goto(server.url)
    page.wait_for_function("() => teamsight.live.state && teamsight.view.drawings > 0")
    page.evaluate(_DROP, ["bad.csv", "a,b\n1,2\n"])
    page.get_by_role("alert").get_by_text("separated by commas").wait_for()
    assert page.url == server.url
    page.evaluate(_DROP, ["team.csv", csv_of()])
    ready(page, "team.csv")
    page.get_by_role("link", name="Back to the world").click()
    page.wait_for_function("() => teamsight.live?.state && teamsight.view.drawings > 0")


def test_a_saved_page_plays_without_a_server(page: Page, served: Callable[..., LivePage], tmp_path: Path) -> None:
    page.goto(served(csv_of(), awareness_range=1.0).url)
    ready(page, "team.csv")
    answer = page.locator(".tr-delta-text").text_content()
    with page.expect_download() as download:
        page.get_by_role("button", name="Save HTML").click()
    saved = tmp_path / "saved.html"
    download.value.save_as(saved)
    page.goto(saved.as_uri())
    page.get_by_text("6: a, b, c, d, e, f", exact=True).wait_for()
    assert page.locator(".tr-delta-text").text_content() == answer
    assert page.evaluate("() => teamsight.view.frameCount") == 300


@pytest.mark.parametrize("dark", [False, True])
def test_a_phone_has_the_answer_first_and_no_overflow(
    new_page: browsing.Pages, served: Callable[..., LivePage], shot: Any, dark: bool
) -> None:
    page = new_page(size=browsing.PHONE, dark=dark)
    page.goto(served(csv_of(), awareness_range=1.0).url)
    ready(page, "team.csv")
    assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")
    above = "() => document.querySelector('.tr-panel').getBoundingClientRect().top < document.querySelector('canvas').getBoundingClientRect().top"
    assert page.evaluate(above)
    shot(page, f"recorded-phone-{'dark' if dark else 'light'}")


def test_a_record_of_one_observation_shows_what_was_seen(served: Callable[..., LivePage], page: Page) -> None:
    text = csv_of(frames=60)
    team = read_recorded("team.csv", content=text.encode())
    answer = team.answer(Choice(awareness_range=1.0))
    assert answer["delta"] is None
    page.goto(served(text, awareness_range=1.0).url)
    page.wait_for_selector(".tr-delta-text")
    assert page.inner_text(".tr-delta-text") == f"{answer['largest']} seen, δ = ?"
    assert answer["seen"] in page.inner_text(".tr-panel")
