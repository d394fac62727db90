"""The seed of a run, derived from a root, its setting and its replicate."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, get_args

from teamsight.analysis.runs.seeds import model_seed, run_seed, setting_seed

#: Which values of a setting enter its seeds: those of its scenario, so that treatments are paired, or all.
Pairing = Literal["scenario", "none"]
PAIRINGS: tuple[Pairing, ...] = get_args(Pairing)
#: The parameters of `CMOMMT` that make its scenario.
SCENARIO = ("robots", "targets", "radius")


def scenario_of(setting: Mapping[str, object]) -> tuple[object, ...]:
    """Return the robots, targets and radius of a setting of `CMOMMT`, which are the defaults if not given."""
    from teamsight.agents.cmommt import DEFAULTS

    return tuple(setting.get(name, DEFAULTS[name]) for name in SCENARIO)


def derived_seed(
    root: int, replicate: int, setting: Mapping[str, object], is_cmommt: bool, pairing: Pairing = "scenario"
) -> int:
    """Return the seed of one replicate of a setting; `run_many` and studies use the same.

    Parameters
    ----------
    root : int
        Root seed.
    replicate : int
        Number of the run, from 0.
    setting : mapping
        Parameters of the model.
    is_cmommt : bool
        Whether the model is `CMOMMT`, whose scenario is known: robots, targets and radius. All settings of another
        model get the same seeds.
    pairing : "scenario" or "none"
        With "none" all values of the setting enter, so that the runs of two settings are independent.
    """
    if pairing == "none":
        return setting_seed(root, replicate, setting)
    if not is_cmommt:
        return run_seed(root, replicate)
    return model_seed(root, replicate, *scenario_of(setting))  # type: ignore[arg-type]
