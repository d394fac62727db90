"""The conditions of a row of the ledger: worlds, runs and steps, and the options of the policies, with their values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import pandas as pd

from teamsight.analysis.paper.claims.interface import Claim, Tables
from teamsight.analysis.paper.experiments import EXPERIMENTS

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
    found = {setting: _scenario(claim, of) for setting, of in tables.items()}
    # A cell that the results of a setting choose is not that of another.
    parts = (
        set(found.values()) if len(set(found.values())) == 1 else (f"{name}: {text}" for name, text in found.items())
    )
    return f"{'; '.join(parts)}; {steps} steps"


def _scenario(claim: Claim, tables: Tables) -> str:
    worlds: dict[str, list[str]] = {}
    for name in claim.needs:
        worlds.setdefault(_worlds(tables[name]), []).append(name)
    return "; ".join(world if len(worlds) == 1 else f"{', '.join(names)}: {world}" for world, names in worlds.items())


def options(claim: Claim, setting: Mapping[str, Any]) -> str:
    """Return the values in force in the experiments that decide on a claim under a setting, in words."""
    from teamsight.agents.cmommt import DEFAULTS

    if not claim.needs:
        return ""
    world = {name: setting.get(name, DEFAULTS[name]) for name in _WORLD}
    teams = dict.fromkeys(_team(name, setting) for name in claim.needs)
    return "; ".join((_listed(world), *teams))


def _worlds(table: pd.DataFrame) -> str:
    cells = table.groupby(["robots", "radius", "targets"]).size()
    # Values that are swept are counted as runs of their own.
    runs = table["replicate"].nunique() if "replicate" in table else int(cells.max())
    robots, radii, targets = (sorted(set(table[name])) for name in ("robots", "radius", "targets"))
    return f"N = {span(robots)}, R = {span(radii)}, {span(targets)} targets, {runs} runs a cell"


def span(values: Sequence[float]) -> str:
    """Return ascending values in words, whole numbers without gaps as a range."""
    if len(values) > 2 and all(later - value == 1 for value, later in pairwise(values)):
        return f"{values[0]:g}..{values[-1]:g}"
    return ", ".join(f"{value:g}" for value in values)


def _team(experiment: str, setting: Mapping[str, Any]) -> str:
    from teamsight.agents.resolve import shared_options
    from teamsight.policies.registry import label, policy_named

    treatment = EXPERIMENTS[experiment].treatment_under(setting)
    if callable(treatment):
        # Policies that were learned from different explorations have the same options.
        treatment = treatment(0).treatment
    policy = given = treatment["policy"]
    if isinstance(given, str):
        policy = policy_named(given, shared_options(given, setting.get("policy_options", {})))
    shown = {name: value for name, value in treatment.items() if name != "policy"}
    shown |= {name: getattr(policy, name) for name in _OPTIONS if hasattr(policy, name)}
    return f"{given if isinstance(given, str) else label(policy)} ({_listed(shown)})"


def _listed(values: Mapping[str, Any]) -> str:
    return ", ".join(f"{name}={value}" for name, value in values.items())
