"""An extension of griffe: the comment `#:` before a constant is its docstring in the reference.

Parameters that share an entry of a docstring are shown with the default of each, where griffe shows that of the first.
Defaults that are private constants are shown by their values.
"""

from __future__ import annotations

import re
from typing import Any

import griffe

ENTRY = re.compile(r"^(\w+(?:, \w+)+)( : .*\n)((?:[ \t]+.*\n?)*)", re.MULTILINE)


def separated(text: str, parameters: griffe.Parameters) -> str:
    """Return a docstring in which each parameter has an entry of its own, if those of an entry have other defaults."""

    def entries(found: re.Match[str]) -> str:
        names = found[1].split(", ")
        defaults = {str(parameters[name].default) for name in names if name in parameters}
        if len(defaults) < 2:
            return found[0]
        rest = found[2] + found[3].rstrip("\n")
        return "\n".join(name + rest for name in names) + "\n" * (len(found[3]) - len(found[3].rstrip("\n")))

    return ENTRY.sub(entries, text)


def shown(default: griffe.Expr | str | None, module: griffe.Module) -> griffe.Expr | str | None:
    """Return a default as the reference shows it: the value of a private constant, others as they are written."""
    if isinstance(default, griffe.ExprName) and default.name.startswith("_"):
        return constant(module, default.name) or default
    # CMOMMT wraps the values of DEFAULTS, to know what was given.
    if isinstance(default, griffe.ExprSubscript) and str(default.left) == "_DEFAULT":
        table = constant(module, "DEFAULTS")
        if isinstance(table, griffe.ExprDict):
            return dict(zip(map(str, table.keys), table.values, strict=True)).get(str(default.slice), default)
    return default


def constant(module: griffe.Module, name: str) -> griffe.Expr | str | None:
    """Return the value of a constant of a module; None if it has none of this name."""
    found = module.members.get(name)
    return found.value if isinstance(found, griffe.Attribute) else None


class Constants(griffe.Extension):
    """Reads the comments of constants."""

    def on_attribute_instance(self, *, attr: griffe.Attribute, **_: Any) -> None:
        """Show the default of a field, and give an attribute the comment that ends on the line before it."""
        if not attr.is_alias:
            attr.value = shown(attr.value, attr.module)
        if attr.docstring or attr.lineno is None or attr.is_alias:
            return
        lines = attr.lines_collection[attr.filepath]
        first = attr.lineno - 1
        while first and lines[first - 1].lstrip().startswith("#:"):
            first -= 1
        text = " ".join(line.lstrip().removeprefix("#:").strip() for line in lines[first : attr.lineno - 1])
        if text:
            attr.docstring = griffe.Docstring(text, lineno=first + 1, parent=attr)

    def on_function_instance(self, *, func: griffe.Function, **_: Any) -> None:
        """Show defaults by their values, and separate the parameters of a function that have other defaults."""
        for parameter in func.parameters:
            parameter.default = shown(parameter.default, func.module)
        if func.docstring:
            func.docstring.value = separated(func.docstring.value, func.parameters)

    def on_class_members(self, *, cls: griffe.Class, **_: Any) -> None:
        """Separate the parameters of a class that have other defaults."""
        if cls.docstring and not cls.is_alias and "__init__" in cls.members:
            cls.docstring.value = separated(cls.docstring.value, cls.members["__init__"].parameters)
