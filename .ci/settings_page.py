"""Write docs/settings.md: every setting of worlds and their components, from their declarations.

Run it with the Python of the checkout: `.venv/bin/python .ci/settings_page.py`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import MISSING
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

from teamsight.agents.awareness.registry import AWARENESS
from teamsight.analysis.plot import markdown
from teamsight.core.component import Declared, declared
from teamsight.policies.registry import POLICIES

#: What the page lists beside the policies and degrees that have a name, by heading.
_LISTED = {
    "CMOMMT": "teamsight.agents.cmommt:CMOMMT",
    "Sensor": "teamsight.agents.sensing.sensor:Sensor",
    "Lidar": "teamsight.agents.sensing.lidar:Lidar",
    "Cycle": "teamsight.agents.decisions:Cycle",
    "Failures": "teamsight.agents.components.failures:Failures",
    "Batteries": "teamsight.agents.components.batteries:Batteries",
    "UnreliableAwareness": "teamsight.agents.components.unreliable_awareness:UnreliableAwareness",
    "Study": "teamsight.analysis.studies.study:Study",
}


def main() -> None:
    """Write the page."""
    place = Path(__file__).resolve().parents[1] / "docs" / "settings.md"
    place.write_text(page(), encoding="utf-8")


def page() -> str:
    """Return the page."""
    parts = [
        "# Settings",
        "Each setting is declared once, as a field of a component; [Extending](extending.md#settings-of-your-own) says "
        "how. From the declaration follow the option of a command (`--policy.gain 0.5`), the control of the live page, "
        "the key of a study file (`\"policy.gain\" = [0.5, 1]`), the parameter of an environment, and the error. This "
        "page is made by `python .ci/settings_page.py`.",
    ]
    for title, owner in owners():
        if known := declared(owner):
            rows = [(f"`{name}`", _default(one), _limits(one), one.meaning) for name, one in known.items()]
            parts += [f"## {title}", markdown.table(("setting", "default", "limits", "meaning"), rows)]
    return markdown.page(*parts)


def owners() -> Iterator[tuple[str, Any]]:
    """Yield what the page lists, with its heading."""
    for title, reference in _LISTED.items():
        yield title, resolve_name(reference)
    for name, degree in AWARENESS.items():
        yield f'Degree "{name}"', degree
    for name, policy in POLICIES.items():
        yield f'Policy "{name}"', policy


def _default(one: Declared) -> str:
    if one.default is MISSING:
        return "required"
    return "" if one.default is None or one.kind == "mapping" else f"`{one.default}`"


def _limits(one: Declared) -> str:
    """Return the limits of a setting, its unit, and whether it may change in a run."""
    allowed = one.allowed
    limits = {"above": allowed.above, "at least": allowed.least, "at most": allowed.most}
    parts = [f"{words} {limit:g}" for words, limit in limits.items() if limit is not None]
    if one.kind == "choice":
        parts.append(", ".join(one.choices))
    parts += [f"[{allowed.unit}]"] * bool(allowed.unit) + ["may change in a run"] * bool(allowed.live)
    return "; ".join(parts)


if __name__ == "__main__":
    main()
