"""The search over the model's open parameters: what it ranks, chooses and reports."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from teamsight.agents.cmommt import CMOMMT
from teamsight.analysis.calibration import model, model_page
from teamsight.analysis.calibration.model import OPEN_CLAIMS, PARAMETERS
from teamsight.analysis.calibration.search import Simulator, assess
from teamsight.analysis.runs import files
from teamsight.analysis.runs.experiment import QUICK
from teamsight.analysis.runs.workers import WorkerPool

DOCS = Path(__file__).parents[3] / "docs"


def judged(holds: dict[tuple[float, str, int], set[str]], phase: str = "final") -> pd.DataFrame:
    rows = []
    for (speed, idle, root), names in holds.items():
        verdicts = {name: name in names for name in OPEN_CLAIMS}
        values = dict(zip(PARAMETERS, (speed, speed / 2, False, idle, "no-force", "none"), strict=True))
        head = {"phase": phase, "root": root, "holding": len(names), "distance_from_paper": 2.0 - speed}
        rows.append(values | head | verdicts)
    return pd.DataFrame(rows)


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
    older = pd.concat([judged(holds, "screen"), judged(holds)], ignore_index=True).drop(columns="range-gain")
    assert "range-gain" not in model.never(older)
    assert "range-gain" not in model_page.page(older)
    assert "acmommt-full and acmommt-r10" in model_page.page(older)


def test_claims_that_were_not_judged_together_exclude_nothing() -> None:
    screened = judged({(0.1, "stay", -1): {"acmommt-full"}}, "screen").drop(columns="range-gain")
    both = pd.concat([screened, judged({(0.2, "stay", -2): {"range-gain"}})], ignore_index=True)
    assert model.never_together(both) == []


def test_screening_may_leave_claims_to_the_final() -> None:
    screened = judged({(0.1, "stay", -1): {"acmommt-full"}, (0.2, "stay", -1): set()}, "screen")
    final = judged({(0.1, "stay", -2): {"acmommt-full"}})
    both = pd.concat([screened.drop(columns="range-gain"), final], ignore_index=True)
    assert model.ranked(both[both["phase"] == "screen"])["robot_speed"].tolist() == [0.1, 0.2]
    assert "range-gain" in model.never(both)
    row = next(line for line in model_page.page(both).splitlines() if line.startswith("| range-gain"))
    assert row.endswith("| – | 0 % |")


def test_the_search_judges_the_best_again_and_the_defaults() -> None:
    values = [
        dict(zip(PARAMETERS, (speed, 0.05, False, "redraw", "no-force", "none"), strict=True)) for speed in (0.1, 0.2)
    ]
    claims = {name: OPEN_CLAIMS[name] for name in ("collective-flat", "neighbours-random")}
    phases = (
        model.SCREEN._replace(claims=claims, runs=1, steps=3),
        model.FINAL._replace(claims=claims, grid=QUICK, runs=1, steps=3, roots=(-2, -3)),
    )
    seen: list[tuple[str, float, float]] = []
    with WorkerPool(1) as pool:
        found = model.search(
            Simulator(pool, lambda *done: seen.append(done)), values=values, phases=phases, finalists=1
        )
    best = model.ranked(found[found["phase"] == "screen"]).iloc[0]
    final = found[found["phase"] == "final"]
    assert len(final) == 2 * 2
    assert final["robot_speed"].iloc[0] == best["robot_speed"]
    assert dict(final[list(PARAMETERS)].iloc[-1]) == model.defaults()
    assert seen[-1] == ("final", 2, 2)


def test_the_defaults_are_those_of_the_model() -> None:
    with_values, without = CMOMMT(**model.setting_of(model.defaults()), rng=1), CMOMMT(rng=1)
    assert with_values.policy == without.policy
    for world in (with_values, without):
        world.run(5)
    assert with_values.robots.position.tobytes() == without.robots.position.tobytes()
    assert with_values.targets.position.tobytes() == without.targets.position.tobytes()


def test_the_page_names_the_best_setting_and_what_excludes_what() -> None:
    holds = {(0.1, "stay", -2): {"acmommt-full", "range-gain"}, (0.2, "wander", -2): {"acmommt-r10"}}
    text = model_page.page(pd.concat([judged(holds, "screen"), judged(holds)], ignore_index=True))
    for part in ("`robot_speed=0.1`", "`target_speed=0.05`", "`idle='stay'`", "- acmommt-full and acmommt-r10"):
        assert part in text


def test_the_shipped_page_is_made_of_the_shipped_table(tmp_path: Path) -> None:
    table = pd.read_parquet(DOCS / "calibration.parquet")
    files.write_page(tmp_path / "calibration.md", model_page.page(table))
    assert (DOCS / "calibration.md").read_bytes() == (tmp_path / "calibration.md").read_bytes()


def test_a_row_of_the_shipped_table_is_what_the_search_makes() -> None:
    shipped = pd.read_parquet(DOCS / "calibration.parquet").to_dict("records")[307]
    values = {name: shipped[name] for name in PARAMETERS}
    # The shipped table leaves out claims that are younger than it.
    claims = {name: claim for name, claim in model.SCREEN.claims.items() if name in shipped}
    screen = model.SCREEN._replace(claims=claims)
    (row,) = assess(screen, [values], model.candidate_of)
    assert len(claims) > 10
    assert row == {name: shipped[name] for name in row}
