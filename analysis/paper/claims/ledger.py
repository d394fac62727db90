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
    scenarios : mapping of str to str
        Worlds, runs and steps of each claim, in words, by its name.
    options : mapping of str to mapping
        Values in force in the experiments of each claim, in words, by its name, by name of the setting.
    """

    verdicts: Mapping[str, Mapping[str, Verdict]]
    conditions: Mapping[str, Any]
    scenarios: Mapping[str, str]
    options: Mapping[str, Mapping[str, str]]

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
                "scenario": self.scenarios[name],
                "settings": {
                    setting: {
                        "holds": found[name].holds,
                        "measured": found[name].measured,
                        "beside": list(found[name].beside),
                        "options": self.options[setting][name],
                    }
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
            + [claim.rule, self._conditions_of(name)]
            for name, claim in self.claims().items()
        )
        return markdown.page(
            "# The paper's claims",
            "; ".join(f"{setting}: {self.holding(setting)} of {total} hold" for setting in self.settings) + ".",
            markdown.table(
                ["claim", "where", "the paper says", "its figure", *self.settings, "rule", "conditions"], rows
            ),
            "## Conditions",
            "\n".join(f"- {name}: {value}" for name, value in self.conditions.items()),
        )

    def _conditions_of(self, name: str) -> str:
        values = (f"{setting}: {self.options[setting][name]}" for setting in self.settings)
        return "; ".join((self.scenarios[name], *values)) if self.claims()[name].needs else self.scenarios[name]


def _in_words(verdict: Verdict) -> str:
    return "; ".join((f"{'holds' if verdict.holds else '**differs**'}: {verdict.measured}", *verdict.beside))
