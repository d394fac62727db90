"""The search over the model's open parameters: what it ranks, chooses and reports."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from teamsight.agents.cmommt import CMOMMT
from teamsight.agents.settings import PRESETS
from teamsight.analysis.calibration import model, model_page
from teamsight.analysis.calibration.model import OPEN_CLAIMS, PARAMETERS
from teamsight.analysis.calibration.search import Simulator, assess
from teamsight.analysis.runs import files
from teamsight.analysis.runs.experiment import QUICK
from teamsight.analysis.runs.processes import WorkerPool

DOCS = Path(__file__).parents[3] / "docs"


def judged(holds: dict[tuple[float, str, int], set[str]], phase: str = "final") -> pd.DataFrame:
    rows = []
    for (speed, idle, root), names in holds.items():
        verdicts = {name: name in names for name in OPEN_CLAIMS}
        values = dict(zip(PARAMETERS, (speed, speed / 2, False, idle, "no-force", "shared", 1.0), strict=True))
        head = {"phase": phase, "root": root, "holding": len(names), "distance_from_paper": 2.0 - speed}
        rows.append(values | head | verdicts)
    return pd.DataFrame(rows)


def whole_search(holds: dict[tuple[float, str, int], set[str]]) -> pd.DataFrame:
    return pd.concat([judged(holds, phase.name) for phase in model.PHASES], ignore_index=True)


def test_targets_are_always_slower_and_no_setting_comes_twice() -> None:
    found = model.candidates()
    assert all(0 < values["target_speed"] < values["robot_speed"] for values in found)
    assert len({tuple(values.items()) for values in found}) == len(found)


def test_more_claims_win_and_distance_breaks_ties() -> None:
    found = model.ranked(
        judged(
            {
                (0.1, "stay", -2): {"acmommt-full"},
                (0.1, "stay", -3): {"acmommt-full", "range-gain"},
                (0.2, "stay", -2): {"acmommt-full"},
                (0.2, "stay", -3): {"acmommt-full"},
                (0.3, "stay", -2): {"range-gain"},
                (0.3, "stay", -3): {"range-gain"},
            }
        )
    )
    assert found["robot_speed"].tolist() == [0.1, 0.3, 0.2]
    assert found["holding"].tolist() == [1.5, 1.0, 1.0]
    assert found[["fewest", "most"]].iloc[0].tolist() == [1, 2]
    assert found["range-gain"].tolist() == [0.5, 1.0, 0.0]


def test_claims_that_exclude_each_other_are_found() -> None:
    table = judged(
        {(0.1, "stay", -2): {"acmommt-full", "range-gain"}, (0.2, "stay", -2): {"range-gain", "acmommt-r10"}}
    )
    assert model.never_together(table) == [("acmommt-full", "acmommt-r10")]
    assert set(model.never(table)) == set(OPEN_CLAIMS) - {"acmommt-full", "range-gain", "acmommt-r10"}


def test_a_claim_that_is_younger_than_a_table_is_left_out() -> None:
    holds = {(0.1, "stay", -2): {"acmommt-full"}, (0.2, "wander", -2): {"acmommt-r10"}}
    older = whole_search(holds).drop(columns="range-gain")
    assert "range-gain" not in model.never(older)
    assert "| range-gain" not in model_page.page(older)
    assert "acmommt-full and acmommt-r10" in model_page.page(older)


def test_claims_that_were_not_judged_together_exclude_nothing() -> None:
    screened = judged({(0.1, "stay", -1): {"acmommt-full"}}, "screen").drop(columns="range-gain")
    both = pd.concat([screened, judged({(0.2, "stay", -2): {"range-gain"}})], ignore_index=True)
    assert model.never_together(both) == []


def test_screening_may_leave_claims_to_the_final() -> None:
    screened = judged({(0.1, "stay", -1): {"acmommt-full"}, (0.2, "stay", -1): set()}, "screen")
    final = judged({(0.1, "stay", -2): {"acmommt-full"}})
    report = judged({(0.1, "stay", -5): {"acmommt-full"}}, "report")
    both = pd.concat([screened.drop(columns="range-gain"), final, report], ignore_index=True)
    assert model.ranked(both[both["phase"] == "screen"])["robot_speed"].tolist() == [0.1, 0.2]
    assert "range-gain" in model.never(both)
    row = [line for line in model_page.page(both).splitlines() if line.startswith("| range-gain")][-1]
    assert row.endswith("| – | 0 % |")


def test_the_search_judges_the_best_again_and_the_defaults_and_reports_each_gain() -> None:
    values = [
        dict(zip(PARAMETERS, (speed, 0.05, False, "redraw", "no-force", "shared", 1.0), strict=True))
        for speed in (0.1, 0.2)
    ]
    claims = {name: OPEN_CLAIMS[name] for name in ("collective-flat", "neighbours-random")}
    phases = (
        model.SCREEN._replace(claims=claims, runs=1, steps=3),
        model.FINAL._replace(claims=claims, grid=QUICK, runs=1, steps=3, roots=(-2, -3)),
        model.REPORT._replace(claims=claims, grid=QUICK, runs=1, steps=3, roots=(-4,)),
    )
    seen: list[tuple[str, float, float]] = []
    with WorkerPool(1) as pool:
        found = model.search(
            Simulator(pool, lambda *done: seen.append(done)), values=values, phases=phases, finalists=1
        )
    best = model.ranked(found[found["phase"] == "screen"]).iloc[0]
    final, report = (found[found["phase"] == phase] for phase in ("final", "report"))
    assert len(final) == 2 * 2
    assert final["robot_speed"].iloc[0] == best["robot_speed"]
    assert dict(final[list(PARAMETERS)].iloc[-1]) == model.defaults()
    winner = model.best_of(final)
    assert report[list(PARAMETERS)].iloc[0].to_dict() == winner
    assert set(report["gain"]) == set(model.GAINS)
    assert model.defaults() in report[list(PARAMETERS)].to_dict("records")
    assert {name for name, _, _ in seen} == {"screen", "final", "report"}
    assert seen[-1][1] == seen[-1][2]


def test_the_page_says_which_claims_change_with_the_gain() -> None:
    table = whole_search({(0.1, "stay", -2): {"acmommt-full", "range-gain"}})
    other = table[table["phase"] == "report"].assign(gain=0.5, **{"acmommt-full": False, "acmommt-r10": True})
    text = " ".join(model_page.page(pd.concat([table, other], ignore_index=True)).split())
    assert "verdict changes with the gain under the best setting: acmommt-full, acmommt-r10." in text
    assert "| acmommt-full | 0 % | 100 % | – |" in text


def test_the_preset_is_the_best_setting_of_the_shipped_table() -> None:
    table = pd.read_parquet(DOCS / "calibration.parquet")
    best = model.best_of(table[table["phase"] == "final"])
    assert PRESETS["touzet2000"] == model.setting_of(best)


def test_the_defaults_are_those_of_the_model() -> None:
    with_values, without = CMOMMT(**model.setting_of(model.defaults()), rng=1), CMOMMT(rng=1)
    assert with_values.policy == without.policy
    for world in (with_values, without):
        world.run(5)
    assert with_values.robots.position.tobytes() == without.robots.position.tobytes()
    assert with_values.targets.position.tobytes() == without.targets.position.tobytes()


def test_the_page_names_the_best_setting_and_what_excludes_what() -> None:
    holds = {(0.1, "stay", -2): {"acmommt-full", "range-gain"}, (0.2, "wander", -2): {"acmommt-r10"}}
    text = model_page.page(whole_search(holds))
    for part in ("`robot_speed=0.1`", "`target_speed=0.05`", "`idle='stay'`", "- acmommt-full and acmommt-r10"):
        assert part in text


def test_the_shipped_page_is_made_of_the_shipped_table(tmp_path: Path) -> None:
    table = pd.read_parquet(DOCS / "calibration.parquet")
    files.write_page(tmp_path / "calibration.md", model_page.page(table))
    assert (DOCS / "calibration.md").read_bytes() == (tmp_path / "calibration.md").read_bytes()


def test_a_row_of_the_shipped_table_is_what_the_search_makes() -> None:
    shipped = pd.read_parquet(DOCS / "calibration.parquet").to_dict("records")[37]
    values = {name: shipped[name] for name in PARAMETERS}
    # The shipped table leaves out claims that are younger than it.
    claims = {name: claim for name, claim in model.SCREEN.claims.items() if name in shipped}
    screen = model.SCREEN._replace(claims=claims)
    (row,) = assess(screen, [values], model.candidate_of)
    assert len(claims) > 10
    assert row == {name: shipped[name] for name in row}
