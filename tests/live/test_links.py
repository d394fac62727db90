"""Links: what a page's address says is restored, or refused with a reason."""

from __future__ import annotations

from typing import Any
from urllib.parse import urlencode

import pytest

from teamsight import CMOMMT, Failures
from teamsight.live import links
from teamsight.live.live_page import worlds_of

_GIVEN = {"robots": 30, "policy": "centroid", "events": Failures(50)}


def opened(text: str, given: Any = None) -> tuple[list[dict[str, Any]], int | None, int]:
    worlds, controls = worlds_of(CMOMMT, dict(given or {}), None)
    return links.settings_of(links.read(text), controls, worlds.settings[0])


def test_what_a_link_names_is_set_and_all_else_has_its_default() -> None:
    link = {"v": 1, "task": "CMOMMT", "seed": 2**62 + 1, "tick": 120, "robots": 12, "uniform_target_speed": "true", "robot_speed": 0.25}
    settings, seed, tick = opened(urlencode(link), _GIVEN)
    # Failures can be set by no page, so they stay.
    assert settings == [{"events": _GIVEN["events"], "robots": 12, "uniform_target_speed": True, "robot_speed": 0.25}]
    assert (seed, tick) == (2**62 + 1, 120)


def test_a_link_of_two_worlds() -> None:
    settings, seed, tick = opened("v=1&task=CMOMMT&two=yes&robots=4&awareness=none&right.awareness=ring")
    assert settings == [{"robots": 4, "awareness": "none"}, {"robots": 4, "awareness": "ring"}]
    assert (seed, tick) == (None, 0)


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
        ("v=1&task=CMOMMT&" + "&".join(f"a{k}=1" for k in range(300)), "damaged"),
    ],
)  # fmt: skip
def test_wrong_links_are_refused_with_a_reason(text: str, said: str) -> None:
    with pytest.raises((TypeError, ValueError)) as error:
        opened(text)
    assert said in str(error.value)
