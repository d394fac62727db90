"""The ledger: every claim beside its verdicts under one or more settings, as lines, Markdown, HTML and JSON."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from html import escape
from typing import Any

from teamsight.analysis.paper.claims.interface import Claim, Verdict
from teamsight.analysis.paper.claims.registry import CLAIMS
from teamsight.analysis.plot import markdown

#: Further root seeds under which claims near their limit are judged; they follow that of the ledger.
SEEDS = 20
# Longest line in a terminal.
_WIDEST = 80
_WORDS = {True: "holds", False: "differs", None: "undecidable"}
# What it says that a claim holds. Each claim counts under the first reason that applies.
_BY_CONSTRUCTION, _TRIVIAL = "by construction", "for a random walk too"
_TUNED, _TELLING = "by a constant chosen so that they do", "that say something"
_STYLE = (
    "body{font:16px/1.5 sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#222;background:#fff}"
    "section{border-top:1px solid #bbb;padding:.5rem 0}h2{font-size:1.1rem;margin:.5rem 0}"
    "dl{display:grid;grid-template-columns:9rem 1fr;gap:.2rem 1rem;margin:0}dt{color:#555}"
    "dd{margin:0;overflow-wrap:anywhere}.holds{color:#060}.differs{color:#a00}@media(max-width:40rem){dl{display:block}}"
)


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
        return sum(found.holds is True for found in self.verdicts[setting].values())

    def worth(self, setting: str) -> dict[str, list[str]]:
        """Return the claims that hold under `setting`, by what that says; the reasons are properties of the claims."""
        chosen = set(self.conditions.get("settings", {}).get(setting, {}).get("policy_options", {}))
        reasons: dict[str, list[str]] = {_BY_CONSTRUCTION: [], _TRIVIAL: [], _TUNED: [], _TELLING: []}
        for name, claim in self.claims().items():
            verdict = self.verdicts[setting][name]
            if verdict.holds:
                reason = (
                    _BY_CONSTRUCTION if claim.by_construction
                    else _TRIVIAL if verdict.is_trivial
                    else _TUNED if chosen & set(claim.tuned)
                    else _TELLING
                )  # fmt: skip
                reasons[reason].append(name)
        return reasons

    def summaries(self) -> list[str]:
        """Return for each setting how many claims hold, and how many of these for which reason."""
        decidable = sum(bool(claim.rule) for claim in self.claims().values())
        open_ = len(self.claims()) - decidable
        further = f" ({open_} more undecidable)" if open_ else ""
        return [
            f"{setting}: {self.holding(setting)} of {decidable} claims hold{further}: "
            + ", ".join(f"{len(names)} {reason}" for reason, names in self.worth(setting).items())
            for setting in self.settings
        ]

    def lines(self) -> Iterator[str]:
        """Yield one line of at most 80 columns for each claim: its verdicts, its name, and the key number."""
        widths = [max(len(setting), *map(len, _WORDS.values())) for setting in self.settings]
        longest = max(map(len, self.claims()))

        def line(verdicts: list[str], name: str, key: str) -> str:
            cells = [f"{word:<{width}}" for word, width in zip(verdicts, widths, strict=True)]
            text = "  ".join((*cells, f"{name:<{longest}}", key)).rstrip()
            return text if len(text) <= _WIDEST else text[: _WIDEST - 1] + "…"

        first = self.settings[0]
        yield line(self.settings, "claim", f"under {first}")
        for name in self.claims():
            yield line(
                [_WORDS[self.verdicts[setting][name].holds] for setting in self.settings],
                name,
                self.verdicts[first][name].key,
            )

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
                        "random_walk_holds": found[name].is_trivial,
                        "share_of_seeds": found[name].share,
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
        rows = (
            [name, claim.where, claim.statement, claim.figure]
            + [_in_words(verdicts[name]) for verdicts in self.verdicts.values()]
            + [claim.rule or "none: nothing could contradict it", self._conditions_of(name)]
            for name, claim in self.claims().items()
        )
        return markdown.page(
            "# The paper's claims",
            *(f"{summary}." for summary in self.summaries()),
            *self._reasons(),
            markdown.table(
                ["claim", "where", "the paper says", "its figure", *self.settings, "rule", "conditions"], rows
            ),
            "## Conditions",
            "\n".join(f"- {name}: {value}" for name, value in self.conditions.items()),
        )

    def to_html(self) -> str:
        """Return the ledger as a page that needs nothing else: one part for each claim."""
        sections = "".join(self._section(name, claim) for name, claim in self.claims().items())
        head = "".join(f"<p>{escape(text)}.</p>" for text in self.summaries())
        conditions = _listed({name: escape(str(value)) for name, value in self.conditions.items()})
        return (
            '<!doctype html>\n<html lang="en"><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width"><title>The paper’s claims</title>'
            f"<style>{_STYLE}</style><h1>The paper’s claims</h1>{head}{sections}"
            f"<section><h2>Conditions</h2>{conditions}</section></html>\n"
        )

    def _section(self, name: str, claim: Claim) -> str:
        says = escape(f"{claim.statement} ({claim.where})")
        rows = {"the paper says": says, "its figure": escape(claim.figure)}
        for setting in self.settings:
            verdict = self.verdicts[setting][name]
            word = _WORDS[verdict.holds]
            texts = "<br>".join(map(escape, _texts(verdict)))
            rows[escape(setting)] = f'<strong class="{word}">{word}</strong>: {texts}'
        rows["rule"] = escape(claim.rule) or "none: nothing could contradict it"
        rows["conditions"] = escape(self._conditions_of(name))
        return f'<section id="{name}"><h2>{name}</h2>{_listed(rows)}</section>'

    def _reasons(self) -> Iterator[str]:
        for setting in self.settings:
            found = {reason: names for reason, names in self.worth(setting).items() if names}
            yield "\n".join(f"- {setting}, {reason}: {', '.join(names)}" for reason, names in found.items())

    def _conditions_of(self, name: str) -> str:
        values = (f"{setting}: {self.options[setting][name]}" for setting in self.settings)
        return "; ".join((self.scenarios[name], *values)) if self.claims()[name].needs else self.scenarios[name]


def _in_words(verdict: Verdict) -> str:
    word = _WORDS[verdict.holds]
    return f"{word if verdict.holds else f'**{word}**'}: {'; '.join(_texts(verdict))}"


def _texts(verdict: Verdict) -> tuple[str, ...]:
    """Return what was measured and what stands beside it, in words."""
    near = "" if verdict.share is None else f"near its limit: holds under {verdict.share:.0%} of {SEEDS} further seeds"
    return tuple(filter(None, (verdict.measured, near, *verdict.beside)))


def _listed(rows: Mapping[str, str]) -> str:
    """Return names with texts, which are HTML, as a list."""
    return "<dl>" + "".join(f"<dt>{name}</dt><dd>{text}</dd>" for name, text in rows.items()) + "</dl>"
