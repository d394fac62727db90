"""An extension of griffe: the comment `#:` before a constant is its docstring in the reference."""

from __future__ import annotations

from typing import Any

import griffe


class Constants(griffe.Extension):
    """Reads the comments of constants."""

    def on_attribute_instance(self, *, attr: griffe.Attribute, **_: Any) -> None:
        """Give an attribute without a docstring the comment that ends on the line before it."""
        if attr.docstring or attr.lineno is None or attr.is_alias:
            return
        lines = attr.lines_collection[attr.filepath]
        first = attr.lineno - 1
        while first and lines[first - 1].lstrip().startswith("#:"):
            first -= 1
        text = " ".join(line.lstrip().removeprefix("#:").strip() for line in lines[first : attr.lineno - 1])
        if text:
            attr.docstring = griffe.Docstring(text, lineno=first + 1, parent=attr)
