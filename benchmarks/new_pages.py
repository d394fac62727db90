"""A new page of headless Chromium for each case of a benchmark."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, TypeVar

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

import browsing

T = TypeVar("T")


def with_new_pages(name: str, cases: Iterable[T]) -> Iterator[tuple[T, Any]]:
    """Yield each case with a page, which is closed before the next; none without a browser.

    Parameters
    ----------
    name : str
        What is measured, to say that it is left out.
    cases : iterable
        The cases.
    """
    if reason := browsing.missing():
        print(f"{name}: {reason}", file=sys.stderr)
        return
    with browsing.started() as (chromium, loop), browsing.driving(loop):
        for case in cases:
            pages = browsing.Pages(chromium, browsing.Problems())
            yield case, pages()
            pages.close()
