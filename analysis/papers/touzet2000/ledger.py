"""The ledger: every claim beside its verdicts under one or more settings, as lines, Markdown and JSON."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import pandas as pd

from teamsight.analysis.papers.touzet2000.claims import CLAIMS, Claim, span
from teamsight.analysis.papers.touzet2000.experiments import EXPERIMENTS
from teamsight.analysis.plot import markdown
from teamsight.analysis.runs.experiment import Tables
from teamsight.analysis.stats.paired import CELL
from teamsight.core.plain_text import text_table
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
_OPTIONS = (
    "idle", "idle_when", "weights", "gain", "turn_probability", "arrive", "repulsion_scale", "k", "discount",
    "bandwidth",
)  # fmt: skip


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
    return f"{_in_all(by_setting)}; {steps} steps"


def could_fail_by(claim: Claim, judgements: Mapping[str, Mapping[str, Any]]) -> str:
    """Return what decides on a claim, and by what each part of its rule could fail, in words.

    Parameters
    ----------
    claim : Claim
        The claim.
    judgements : mapping of str to mapping
        What its judgements have, by name of the setting. A limit that is measured differs between settings.
    """
    if not claim.rule:
        return "nothing"
    limits = {setting: " or ".join(by for by, _ in one["parts"]) for setting, one in judgements.items()}
    decides = "a mistake in the code" if claim.by_construction else f"runs of {', '.join(claim.needs)}"
    return f"{decides}: {_in_all(limits)}"


def _in_all(by_setting: Mapping[str, str]) -> str:
    """Return texts by the name of a setting as one text, without the names if all are equal."""
    same = set(by_setting.values())
    return "; ".join(same if len(same) == 1 else (f"{setting}: {text}" for setting, text in by_setting.items()))


def _worlds(table: pd.DataFrame) -> str:
    robots, radii, targets = (sorted(set(table[name])) for name in ("robots", "radius", "targets"))
    return f"N = {span(robots)}, R = {span(radii)}, {span(targets)} targets, {runs_of_cells(table)} runs a cell"


def runs_of_cells(table: pd.DataFrame) -> str:
    """Return the number of runs of each cell, in words."""
    counts = table.groupby(list(CELL))["replicate"].nunique()
    return " to ".join(map(str, dict.fromkeys((counts.min(), counts.max()))))


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
    """Judgements on the claims under one or more settings.

    Parameters
    ----------
    conditions : mapping
        Seed, runs, steps, grid, settings and version behind the judgements, fit for JSON.
    claims : sequence of mapping
        Of each claim, in order: claim (its name), where, statement, figure and rule; scenario (worlds, runs and steps,
        in words); settings: by name of the setting what `Judgement` has, and options, the values in force in its
        experiments, in words; and could_fail_by, in words.
    """

    conditions: Mapping[str, Any]
    claims: Sequence[Mapping[str, Any]]

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
        claims = []
        for name, claim in CLAIMS.items():
            found: dict[str, Any] = {"claim": name}
            found |= {part: getattr(claim, part) for part in ("where", "statement", "figure", "rule")}
            found |= {"scenario": scenario(claim, tables, plan.steps), "settings": {}}
            for setting, given in plan.settings.items():
                judgement = claim.judge(tables[setting], beside=True)._replace(share=shares.get((setting, name)))
                found["settings"][setting] = judgement._asdict() | {"options": options(claim, given)}
            found["could_fail_by"] = could_fail_by(claim, found["settings"])
            claims.append(found)
        return cls(plan.conditions() | {"version": __version__}, claims)

    @property
    def settings(self) -> list[str]:
        """The names of the settings."""
        return list(self.claims[0]["settings"])

    def worth(self, setting: str) -> dict[str, list[str]]:
        """Return the claims that hold under a setting, by what that says; the reasons are properties of the claims."""
        changed = set(self.conditions["settings"][setting].get("policy_options", {}))
        found: dict[str, list[str]] = {reason: [] for reason in _REASONS}
        for one in self.claims:
            claim, judgement = CLAIMS[one["claim"]], one["settings"][setting]
            if judgement["holds"]:
                applies = (claim.by_construction, judgement["is_trivial"], bool(changed & set(claim.tuned)), True)
                found[_REASONS[applies.index(True)]].append(one["claim"])
        return found

    def summaries(self) -> Iterator[str]:
        """Yield for each setting how many claims hold, and how many of these for which reason."""
        decidable = sum(bool(one["rule"]) for one in self.claims)
        for setting in self.settings:
            reasons = {reason: len(names) for reason, names in self.worth(setting).items()}
            counts = ", ".join(f"{number} {reason}" for reason, number in reasons.items())
            others = f"{len(self.claims) - decidable} more undecidable"
            yield f"{setting}: {sum(reasons.values())} of {decidable} claims hold ({others}): {counts}"

    def lines(self) -> list[str]:
        """Return a table of 80 columns with a row for each claim: its judgements, its name, and the key number."""
        rows = []
        for one in self.claims:
            of = list(one["settings"].values())
            key = of[0]["measured"].partition(";")[0]
            rows.append([*(_WORDS[judgement["holds"]] for judgement in of), one["claim"], key])
        titles = [*self.settings, "claim", f"under {self.settings[0]}"]
        table = text_table(rows, titles, left=range(len(titles)), width=_WIDEST)
        return [*table.head, *table.body]

    def to_json(self) -> dict[str, Any]:
        """Return the whole ledger, fit for JSON."""
        holding = {setting: sum(map(len, self.worth(setting).values())) for setting in self.settings}
        return {"conditions": dict(self.conditions), "holding": holding, "claims": list(self.claims)}

    def to_markdown(self) -> str:
        """Return the ledger as a page of Markdown with a section for each claim."""
        parts = ["# The paper's claims", *(f"{summary}." for summary in self.summaries())]
        for setting in self.settings:
            worth = {f"{setting}, {reason}": ", ".join(of) for reason, of in self.worth(setting).items() if of}
            parts.append(_items(worth))
        for one in self.claims:
            rows = {f"the paper says ({one['where']})": one["statement"], "its figure": one["figure"]}
            rows |= {setting: _in_words(found) for setting, found in one["settings"].items()}
            rows |= {"rule": one["rule"] or "none: nothing could contradict it", "could fail by": one["could_fail_by"]}
            rows |= {"conditions": one["scenario"]}
            rows |= {f"values, {name}": found["options"] for name, found in one["settings"].items() if found["options"]}
            parts += [f"## {one['claim']}", _items(rows)]
        return markdown.page(*parts, "## Conditions", _items(self.conditions))


def _items(rows: Mapping[str, Any]) -> str:
    return "\n".join(f"- {name}: {text}" for name, text in rows.items())


def _in_words(judgement: Mapping[str, Any]) -> str:
    """Return the verdict, what was measured and what stands beside it."""
    word, share = _WORDS[judgement["holds"]], judgement["share"]
    near = [] if share is None else [f"near its limit: holds under {share:.0%} of {SEEDS} further seeds"]
    parts = [_WORDS[holds] for _, holds in judgement["parts"]]
    # Of a single part it is the verdict.
    each = [f"parts of the rule, in order: {', '.join(parts)}"] if len(parts) > 1 else []
    texts = "; ".join([judgement["measured"], *each, *near, *judgement["beside"]])
    return f"{word if judgement['holds'] else f'**{word}**'}: {texts}"
