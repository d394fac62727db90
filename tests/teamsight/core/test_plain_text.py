"""Tables for terminals: no cell is lost or cut, numbers are whole, and lines fit where that is possible."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from teamsight.core.plain_text import broken_lines, cell_width, text_table

WORDS = st.text("abc é日", min_size=0, max_size=40).map(lambda text: " ".join(text.split()))
NUMBERS = st.floats(-1e6, 1e6).map(lambda value: f"{value:.1f} ({value:.3g})")


@given(
    rows=st.lists(st.tuples(WORDS, NUMBERS, NUMBERS, WORDS), min_size=1, max_size=6),
    headings=st.sampled_from([(), ("team", "observed [%]", "more than the others", "what it is")]),
    width=st.integers(5, 120),
)
def test_nothing_is_lost_and_numbers_stay_whole(rows: list[tuple[str, ...]], headings: tuple[str, ...], width: int) -> None:
    table = text_table(rows, headings, left=(0, 3), width=width)
    lines = [*table.head, *table.body]
    joined = "".join("".join(lines).split())
    for row in rows:
        assert all(any(number in line for line in table.body) for number in row[1:3])
        assert all(character in joined for word in (row[0], row[3]) for character in word.replace(" ", ""))
    assert sum(map(len, joined)) == sum(len("".join(cell.split())) for row in (headings, *rows) for cell in row)
    assert all(line == line.rstrip() for line in lines)
    assert table.left_out == []


@given(rows=st.lists(st.tuples(st.text("abc ", min_size=1, max_size=60), NUMBERS), min_size=1, max_size=4), width=st.integers(45, 100))
def test_texts_are_broken_until_the_lines_fit(rows: list[tuple[str, str]], width: int) -> None:
    table = text_table(rows, ("team", "observed"), width=width)
    assert max(map(cell_width, (*table.head, *table.body))) <= width


def test_headings_are_broken_first_then_columns_are_left_out_then_texts_are_broken() -> None:
    rows = [("a team of robots", "1.5", "22.5 (21.0 to 24.0)", "x"), ("another", "12.5", "3.5 (2.0 to 5.0)", "")]
    titles = ("team", "robots in the arena", "observed", "spare")
    wide, narrow, less, least = (text_table(rows, titles, spare=(3, 1), width=width) for width in (80, 60, 45, 34))
    assert wide.head == ["team              robots in the arena             observed  spare"]
    assert wide.body[0] == "a team of robots                  1.5  22.5 (21.0 to 24.0)      x"
    assert narrow.head == ["                   robots in the", "team                       arena             observed  spare"]
    assert less.left_out == ["spare"]
    assert least.left_out == ["spare", "robots in the arena"]
    assert least.body == ["a team of      22.5 (21.0 to 24.0)", "robots", "another           3.5 (2.0 to 5.0)"]


def test_a_row_that_says_nothing_without_what_is_left_out_is_left_out() -> None:
    rows = [("one", "1.0", "100 %"), ("two", "", "50 %")]
    assert text_table(rows, ("team", "observed", "way"), spare=(2,), width=15).body == ["one        1.0"]
    assert len(text_table(rows, ("team", "observed", "way"), spare=(2,)).body) == 2


@pytest.mark.parametrize(
    ("line", "broken"),
    [
        ("a line that is broken between words", "a line that is\nbroken between words"),
        ("next: teamsight plot results --out figure.png", "next:\nteamsight plot results --out figure.png"),
        ("it needs it: pip install 'teamsight[live]'", "it needs it:\npip install 'teamsight[live]'"),
        ("of teamsight 0.1 and others of it", "of teamsight 0.1 and\nothers of it"),
        ("/a/path/that/is/longer/than/the/line is there", "/a/path/that/is/longer/than/the/line\nis there"),
    ],
)  # fmt: skip
def test_lines_are_broken_between_words_but_not_within_what_is_copied(line: str, broken: str) -> None:
    assert broken_lines(line, 20) == broken


@pytest.mark.parametrize(("text", "width"), [("δ = 4", 5), ("日本", 4), ("e\u0301", 1), ("", 0)])
def test_the_width_is_that_on_a_terminal(text: str, width: int) -> None:
    assert cell_width(text) == width
