"""Public names that are imported on first use."""

from __future__ import annotations

# No other module is imported, since `import teamsight` must be fast: see `teamsight.__main__`.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any


def lazy_names(package: str, homes: dict[str, str], names: dict[str, Any]) -> Callable[[str], Any]:
    """Return the ``__getattr__`` of a package that imports its public names on first use, and set its ``__dir__``.

    Parameters
    ----------
    package : str
        The package's ``__name__``.
    homes : dict of str to str
        For each public name, the module that defines it.
    names : dict
        The package's ``globals()``.
    """

    def __getattr__(name: str) -> Any:  # noqa: N807
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}; it has {', '.join(sorted(homes))}")
        import importlib

        names[name] = getattr(importlib.import_module(homes[name]), name)
        return names[name]

    names["__dir__"] = lambda: sorted(names.get("__all__", homes))
    return __getattr__
