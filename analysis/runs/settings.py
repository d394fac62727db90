"""Settings of an analysis as JSON values, which its tables contain."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any


def as_json(settings: Any) -> dict[str, Any]:
    """Return the fields of a dataclass of settings by name, fit for JSON: tuples become lists."""
    return {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(settings).items()}
