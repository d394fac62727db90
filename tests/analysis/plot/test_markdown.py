"""Pages have short lines and mean what their parts mean."""

from __future__ import annotations

import re

from hypothesis import given
from hypothesis import strategies as st

from teamsight.analysis.plot.markdown import WIDTH, page, table, wrapped

WORDS = st.lists(
    st.sampled_from(["word", "-", "+", "*", "#", "7.", "12.", "more", "a-b", "|", "δ", "`code`", "x" * 130]), min_size=1
)


@given(WORDS, st.sampled_from(["", "- ", "3. ", "  - "]))
def test_wrapping_changes_line_breaks_only(words: list[str], mark: str) -> None:
    text = mark + " ".join(["begin", *words])
    lines = wrapped(text).split("\n")
    assert " ".join(" ".join(lines).split()) == " ".join(text.split())
    if not {*words} & {*"-+*#", "7.", "12.", "x" * 130}:
        assert max(map(len, lines)) <= WIDTH
    # No later line begins a list or a heading, and those of an item are indented.
    for line in lines[1:]:
        assert not re.match(r"\s*([-+*#]|\d+\.) ", line)
        assert line.startswith(" " * len(mark))


def test_tables_headings_and_code_keep_their_lines() -> None:
    long = "word " * 60
    for text in (f"# {long}", table(["a", "b"], [[long, "1"]]), f"```\n{long}\n```", f"<!-- {long} -->"):
        assert wrapped(text) == text


def test_a_table_is_rectangular_and_escapes_its_separator() -> None:
    text = table(["x", "y|z"], [["1", "2"], ["3|4", ""]], align="r")
    assert text.split("\n") == ["| x | y\\|z |", "| ---: | --- |", "| 1 | 2 |", "| 3\\|4 |  |"]


def test_parts_of_a_page_are_separated_by_empty_lines() -> None:
    assert page("# Title", "", "text", "- one\n- two") == "# Title\n\ntext\n\n- one\n- two\n"
