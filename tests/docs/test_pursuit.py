"""The tables of the page on pursuit are those of its Parquet file, and its numbers are in them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from teamsight.analysis.plot.verdict_table import verdict_table
from teamsight.analysis.pursuit.claims import CLAIMS, crossings, verdicts
from teamsight.analysis.pursuit.ledger import rows
from teamsight.analysis.pursuit.ono.claims import CLAIMS as OF_MODULES
from teamsight.analysis.pursuit.ono.claims import verdicts as judge
from teamsight.analysis.pursuit.ono.page import learners_table, random_table, sizes_table
from teamsight.analysis.pursuit.ono.plan import Plan as ModulesPlan
from teamsight.analysis.pursuit.page import by_chance, ledger_table, summary
from teamsight.analysis.pursuit.plan import Plan
from teamsight.analysis.pursuit.trials import BLOCK

DOCS = Path(__file__).resolve().parents[2] / "docs" / "tasks"
PAGE = (DOCS / "pursuit.md").read_text(encoding="utf-8")
TABLE = pd.read_parquet(DOCS / "pursuit.parquet")
MODULES = pd.read_parquet(DOCS / "pursuit-modules.parquet")
LEDGER = {(row.value.where, row.value.condition, row.value.phase): row for row in rows(TABLE)}


def test_the_tables_are_those_of_the_file() -> None:
    assert len(LEDGER) == 37
    assert ledger_table(list(LEDGER.values())) in PAGE
    assert len(verdicts(TABLE)) == len(CLAIMS)
    assert verdict_table(verdicts(TABLE)) in PAGE
    assert by_chance(len(CLAIMS)).split(": ")[1] in " ".join(PAGE.split())
    assert summary(TABLE)[0] in PAGE


def test_the_settings_are_the_defaults_of_the_command() -> None:
    assert TABLE.attrs["pursuit"] == Plan().conditions()


def _share(where: str, condition: str, phase: str = "training") -> float:
    row = LEDGER[where, condition, phase]
    return row.mean / row.value.steps - 1


def test_what_the_page_says_is_in_the_file() -> None:
    assert all(row.verdict == "agrees" for key, row in LEDGER.items() if "random" in key[1])
    alone = ["1/1 depth 2", "1/1 depth 4", "1/2 depth 2", "1/2 depth 3", "1/2 depth 4"]
    shares = [_share(key[0], key[1]) for key in LEDGER if key[1] in alone and key[2] == "training"]
    assert max(map(abs, shares)) < 0.14
    together = [_share(where, f"{prey}/2 joint {how}") for where, prey in (("Fig. 7", 2), ("Fig. 8", 1))
                for how in ("passive", "mutual")]  # fmt: skip
    assert max(map(abs, together)) < 0.05
    independent = [_share("Fig. 7", "2/2 joint"), _share("Fig. 8", "1/2 joint")]
    assert 0.3 < min(independent) < max(independent) < 0.55
    assert _share("Table 2", "1/1 depth 2", "test") > 0
    assert all(_share("Fig. 7", f"2/2 joint {how}", "test") < 0 for how in ("passive", "mutual"))
    assert all(_share("Table 2", f"1/1 scout {depth}") < 0 for depth in (2, 3, 4))


def test_the_tables_on_modules_are_those_of_the_file() -> None:
    for shown in (sizes_table(), learners_table(MODULES), random_table(MODULES), verdict_table(judge(MODULES))):
        assert shown in PAGE
    assert len(judge(MODULES)) == len(OF_MODULES)
    assert MODULES.attrs["pursuit-modules"] == ModulesPlan().conditions()


def _curve(condition: str) -> np.ndarray:
    return np.mean([np.asarray(curve) for curve in TABLE[TABLE["condition"] == condition]["curve"]], axis=0)


def test_what_the_page_says_of_curves_is_in_the_file() -> None:
    seen, mutual = _curve("2/2 joint passive"), _curve("2/2 joint mutual")
    at = slice(1800 // BLOCK, 2200 // BLOCK)
    assert 1.4 < seen[at].mean() / seen[-10:].mean() < 1.6
    # Blocks of 50 trials are noisy: means of 1,000 trials are compared.
    later = (mutual - seen).reshape(-1, 1000 // BLOCK).mean(axis=1)
    assert (later[:4] > 0).all()
    assert (later[-2:] < 0).all()
    assert [round(float(np.median(crossings(TABLE, depth))), -2) for depth in (3, 4)] == [200, 300]
    assert (TABLE[TABLE["condition"] == "2/2 joint"]["neighbours"] == 1).all()
