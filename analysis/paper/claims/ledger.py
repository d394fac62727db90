"""The ledger: every claim beside its verdict, for one or several settings, as Markdown, JSON and rows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from teamsight.analysis.paper.claims import awareness, formulas, learning, neighbours, performance
from teamsight.analysis.paper.claims.interface import Claim, Tables, Verdict

#: Every claim, in the order of the paper.
CLAIMS: tuple[Claim, ...] = (
    *formulas.SEARCH_SPACE,
    *neighbours.CLAIMS,
    *performance.CLAIMS,
    *awareness.CLAIMS[:3],
    *formulas.REPULSION,
    *awareness.CLAIMS[3:],
    *learning.CLAIMS,
)


def needed(claims: Iterable[Claim] = CLAIMS) -> set[str]:
    """Return the names of the experiments that the claims read."""
    return {name for claim in claims for name in claim.needs}


def judge(tables: Tables, claims: Iterable[Claim] = CLAIMS) -> dict[str, Verdict]:
    """Return the verdict on each claim by its name."""
    return {claim.name: claim.judge(tables) for claim in claims}


@dataclass(frozen=True)
class Ledger:
    """Verdicts on the claims, side by side for each setting.

    Parameters
    ----------
    verdicts : mapping of str to mapping
        For each setting, by its name, the verdict on each claim.
    conditions : mapping
        What the verdicts rest on: seed, runs, steps, grid, settings, version.
    """

    verdicts: Mapping[str, Mapping[str, Verdict]]
    conditions: Mapping[str, Any]

    @property
    def settings(self) -> list[str]:
        """The names of the settings."""
        return list(self.verdicts)

    def claims(self) -> list[Claim]:
        """Return the claims that were judged, in the order of the paper."""
        judged = next(iter(self.verdicts.values()))
        return [claim for claim in CLAIMS if claim.name in judged]

    def holding(self, setting: str) -> int:
        """Return how many claims hold under `setting`."""
        return sum(found.holds for found in self.verdicts[setting].values())

    def records(self) -> list[dict[str, Any]]:
        """Return one mapping a claim, fit for JSON."""
        return [
            {
                "claim": claim.name,
                "where": claim.where,
                "statement": claim.statement,
                "paper": claim.figure,
                "rule": claim.rule,
                "settings": {
                    setting: {"holds": found[claim.name].holds, "measured": found[claim.name].measured}
                    for setting, found in self.verdicts.items()
                },
            }
            for claim in self.claims()
        ]

    def to_json(self) -> dict[str, Any]:
        """Return the whole ledger, fit for JSON."""
        holding = {setting: self.holding(setting) for setting in self.settings}
        return {"conditions": dict(self.conditions), "holding": holding, "claims": self.records()}

    def to_markdown(self) -> str:
        """Return the ledger as a page of Markdown."""
        head = ["claim", "where", "the paper says", "its figure", *self.settings, "rule"]
        rows = [
            [
                claim.name,
                claim.where,
                claim.statement,
                claim.figure,
                *(_words(found[claim.name]) for found in self.verdicts.values()),
                claim.rule,
            ]
            for claim in self.claims()
        ]
        total = len(self.claims())
        counts = "; ".join(f"{setting}: {self.holding(setting)} of {total} hold" for setting in self.settings)
        told = "\n".join(f"- {name}: {value}" for name, value in self.conditions.items())
        return f"# The paper's claims\n\n{counts}.\n\n{_table(head, rows)}\n\n## Conditions\n\n{told}\n"


def _words(found: Verdict) -> str:
    return f"{'holds' if found.holds else '**differs**'}: {found.measured}"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)
