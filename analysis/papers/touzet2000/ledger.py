"""The ledger: every claim beside its verdicts under one or more settings, as lines, Markdown and JSON."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import pandas as pd

from teamsight.analysis.papers.touzet2000.claims import CLAIMS, Claim, Judgement, span
from teamsight.analysis.papers.touzet2000.experiments import EXPERIMENTS
from teamsight.analysis.plot import markdown
from teamsight.analysis.runs.experiment import Tables
from teamsight.core.version import __version__

if TYPE_CHECKING:
    from teamsight.analysis.papers.touzet2000 import Touzet

#: Further root seeds under which claims near their limit are judged; they follow that of the ledger.
SEEDS = 20
# Longest line in a terminal.
_WIDEST = 80
_WORDS = {True: "holds", False: "differs", None: "undecidable"}
# What it says that a claim holds. Each claim counts under the first reason that applies.
_REASONS = ("by construction", "for a random walk too", "by a constant chosen so that they do", "that say something")
# Parameters of CMOMMT that are the same in all experiments of a setting, unless the experiment says otherwise.
_WORLD = ("robot_speed", "target_speed", "uniform_target_speed", "sensing_range", "awareness_range")
# Options of policies that decide what a robot does; the constants of the forces are those of docs/model.md.
_OPTIONS = ("idle", "idle_when", "weights", "gain", "turn_probability", "repulsion_scale", "k", "discount", "bandwidth")


def scenario(claim: Claim, tables: Mapping[str, Tables], steps: int) -> str:
    """Return team sizes, radii, targets, runs and steps of the experiments that decide on a claim, in words.

    Parameters
    ----------
    claim : Claim
        The claim.
    tables : mapping of str to mapping
        The tables of its experiments, by name of the setting.
    steps : int
        Steps of each run.
    """
    if not claim.needs:
        return "closed form"
    by_setting = {}
    for setting, made in tables.items():
        worlds: dict[str, list[str]] = {}
        for name in claim.needs:
            worlds.setdefault(_worlds(made[name]), []).append(name)
        parts = (world if len(worlds) == 1 else f"{', '.join(names)}: {world}" for world, names in worlds.items())
        by_setting[setting] = "; ".join(parts)
    # A cell that the results of a setting choose is not that of another.
    same = set(by_setting.values())
    found = same if len(same) == 1 else (f"{setting}: {text}" for setting, text in by_setting.items())
    return f"{'; '.join(found)}; {steps} steps"


def _worlds(table: pd.DataFrame) -> str:
    robots, radii, targets = (sorted(set(table[name])) for name in ("robots", "radius", "targets"))
    runs = table["replicate"].nunique()
    return f"N = {span(robots)}, R = {span(radii)}, {span(targets)} targets, {runs} runs a cell"


def options(claim: Claim, setting: Mapping[str, Any]) -> str:
    """Return the values in force in the experiments that decide on a claim under a setting, in words."""
    from teamsight.agents.cmommt import DEFAULTS

    if not claim.needs:
        return ""
    world = {name: setting.get(name, DEFAULTS[name]) for name in _WORLD}
    return "; ".join((_listed(world), *dict.fromkeys(_team(name, setting) for name in claim.needs)))


def _team(experiment: str, setting: Mapping[str, Any]) -> str:
    from teamsight.agents.resolve import shared_options
    from teamsight.policies.registry import label, policy_named

    # Policies that were learned from different explorations have the same options.
    shown = dict(EXPERIMENTS[experiment].variant(setting).treatment)
    policy = name = shown.pop("policy")
    if isinstance(name, str):
        policy = policy_named(name, shared_options(name, setting.get("policy_options", {})))
    shown |= {option: getattr(policy, option) for option in _OPTIONS if hasattr(policy, option)}
    return f"{name if isinstance(name, str) else label(policy)} ({_listed(shown)})"


def _listed(values: Mapping[str, Any]) -> str:
    return ", ".join(f"{name}={value}" for name, value in values.items())


@dataclass(frozen=True)
class Ledger:
    """Verdicts on the claims under one or more settings.

    Parameters
    ----------
    judgements : mapping of str to mapping
        The judgements by name of the claim, by name of the setting.
    conditions : mapping
        Seed, runs, steps, grid, settings and version behind the verdicts, fit for JSON.
    scenarios : mapping of str to str
        Worlds, runs and steps of each claim, in words, by its name.
    options : mapping of str to mapping
        Values in force in the experiments of each claim, in words, by its name, by name of the setting.
    """

    judgements: Mapping[str, Mapping[str, Judgement]]
    conditions: Mapping[str, Any]
    scenarios: Mapping[str, str]
    options: Mapping[str, Mapping[str, str]]

    @classmethod
    def of(cls, plan: Touzet, tables: Mapping[str, Tables], shares: Mapping[tuple[str, str], float]) -> Ledger:
        """Return the ledger of a plan.

        Parameters
        ----------
        plan : Touzet
            What was simulated.
        tables : mapping of str to mapping
            The tables of the experiments, by name of the setting.
        shares : mapping
            See `repeated`.
        """
        judgements = {
            setting: {
                name: claim.judge(made, beside=True)._replace(share=shares.get((setting, name)))
                for name, claim in CLAIMS.items()
            }
            for setting, made in tables.items()
        }
        scenarios = {name: scenario(claim, tables, plan.steps) for name, claim in CLAIMS.items()}
        in_force = {
            setting: {name: options(claim, given) for name, claim in CLAIMS.items()}
            for setting, given in plan.settings.items()
        }
        return cls(judgements, plan.conditions() | {"version": __version__}, scenarios, in_force)

    def worth(self, setting: str) -> dict[str, str]:
        """Return for each claim that holds under a setting what that says; the reasons are properties of the claims."""
        chosen = set(self.conditions["settings"][setting].get("policy_options", {}))
        reasons = {}
        for name, claim in CLAIMS.items():
            judgement = self.judgements[setting][name]
            if judgement.holds:
                applies = (claim.by_construction, judgement.is_trivial, bool(chosen & set(claim.tuned)), True)
                reasons[name] = _REASONS[applies.index(True)]
        return reasons

    def summaries(self) -> Iterator[str]:
        """Yield for each setting how many claims hold, and how many of these for which reason."""
        decidable = sum(bool(claim.rule) for claim in CLAIMS.values())
        others = len(CLAIMS) - decidable
        for setting in self.judgements:
            reasons = Counter(self.worth(setting).values())
            counts = ", ".join(f"{reasons[reason]} {reason}" for reason in _REASONS)
            yield f"{setting}: {reasons.total()} of {decidable} claims hold ({others} more undecidable): {counts}"

    def lines(self) -> Iterator[str]:
        """Yield one line of at most 80 columns for each claim: its verdicts, its name, and the key number."""
        first, *_ = self.judgements
        rows = [[*self.judgements, "claim", f"under {first}"]]
        for name in CLAIMS:
            of = [found[name] for found in self.judgements.values()]
            rows.append([*(_WORDS[one.holds] for one in of), name, of[0].measured.partition(";")[0]])
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        for row in rows:
            line = "  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip()
            yield line if len(line) <= _WIDEST else line[: _WIDEST - 1] + "…"

    def to_json(self) -> dict[str, Any]:
        """Return the whole ledger, fit for JSON."""
        records = [
            {
                "claim": name,
                **{part: getattr(claim, part) for part in ("where", "statement", "figure", "rule")},
                "scenario": self.scenarios[name],
                "settings": {
                    setting: {**found[name]._asdict(), "options": self.options[setting][name]}
                    for setting, found in self.judgements.items()
                },
            }
            for name, claim in CLAIMS.items()
        ]
        holding = {setting: len(self.worth(setting)) for setting in self.judgements}
        return {"conditions": dict(self.conditions), "holding": holding, "claims": records}

    def to_markdown(self) -> str:
        """Return the ledger as a page of Markdown with a section for each claim."""
        parts = ["# The paper's claims", *(f"{summary}." for summary in self.summaries())]
        for setting in self.judgements:
            by_reason: dict[str, list[str]] = {}
            for name, reason in self.worth(setting).items():
                by_reason.setdefault(reason, []).append(name)
            parts.append(_items({f"{setting}, {reason}": ", ".join(names) for reason, names in by_reason.items()}))
        for name, claim in CLAIMS.items():
            rows = {f"the paper says ({claim.where})": claim.statement, "its figure": claim.figure}
            rows |= {setting: _in_words(found[name]) for setting, found in self.judgements.items()}
            rows |= {"rule": claim.rule or "none: nothing could contradict it", "conditions": self.scenarios[name]}
            rows |= {f"values, {setting}": of[name] for setting, of in self.options.items() if of[name]}
            parts += [f"## {name}", _items(rows)]
        return markdown.page(*parts, "## Conditions", _items(self.conditions))


def _items(rows: Mapping[str, Any]) -> str:
    return "\n".join(f"- {name}: {text}" for name, text in rows.items())


def _in_words(judgement: Judgement) -> str:
    """Return the verdict, what was measured and what stands beside it."""
    word = _WORDS[judgement.holds]
    texts = [judgement.measured, *judgement.beside]
    if judgement.share is not None:
        texts.insert(1, f"near its limit: holds under {judgement.share:.0%} of {SEEDS} further seeds")
    return f"{word if judgement.holds else f'**{word}**'}: {'; '.join(texts)}"
