"""The ledger: every claim beside its verdicts under one or more settings, as Markdown and as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from teamsight.analysis.paper.claims.interface import Claim, Verdict
from teamsight.analysis.paper.claims.registry import CLAIMS
from teamsight.analysis.plot import markdown


@dataclass(frozen=True)
class Ledger:
    """Verdicts on the claims under one or more settings.

    Parameters
    ----------
    verdicts : mapping of str to mapping
        The verdicts by name of the claim, by name of the setting.
    conditions : mapping
        Seed, runs, steps, grid, settings and version behind the verdicts, fit for JSON.
    """

    verdicts: Mapping[str, Mapping[str, Verdict]]
    conditions: Mapping[str, Any]

    @property
    def settings(self) -> list[str]:
        """The names of the settings."""
        return list(self.verdicts)

    def claims(self) -> dict[str, Claim]:
        """Return the claims that were judged by name, in the order of the paper."""
        judged = next(iter(self.verdicts.values()))
        return {name: claim for name, claim in CLAIMS.items() if name in judged}

    def holding(self, setting: str) -> int:
        """Return how many claims hold under `setting`."""
        return sum(found.holds for found in self.verdicts[setting].values())

    def to_json(self) -> dict[str, Any]:
        """Return the whole ledger, fit for JSON."""
        records = [
            {
                "claim": name,
                "where": claim.where,
                "statement": claim.statement,
                "paper": claim.figure,
                "rule": claim.rule,
                "settings": {
                    setting: {"holds": found[name].holds, "measured": found[name].measured}
                    for setting, found in self.verdicts.items()
                },
            }
            for name, claim in self.claims().items()
        ]
        holding = {setting: self.holding(setting) for setting in self.settings}
        return {"conditions": dict(self.conditions), "holding": holding, "claims": records}

    def to_markdown(self) -> str:
        """Return the ledger as a page of Markdown."""
        total = len(self.claims())
        rows = (
            [name, claim.where, claim.statement, claim.figure]
            + [_in_words(verdicts[name]) for verdicts in self.verdicts.values()]
            + [claim.rule]
            for name, claim in self.claims().items()
        )
        return markdown.page(
            "# The paper's claims",
            "; ".join(f"{setting}: {self.holding(setting)} of {total} hold" for setting in self.settings) + ".",
            markdown.table(["claim", "where", "the paper says", "its figure", *self.settings, "rule"], rows),
            "## Conditions",
            "\n".join(f"- {name}: {value}" for name, value in self.conditions.items()),
        )


def _in_words(verdict: Verdict) -> str:
    return f"{'holds' if verdict.holds else '**differs**'}: {verdict.measured}"
