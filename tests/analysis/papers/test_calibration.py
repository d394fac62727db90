"""The search over the model's open parameters: what it scores, ranks, chooses, reports and keeps."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from teamsight.agents.cmommt import CMOMMT
from teamsight.agents.presets import PRESETS
from teamsight.analysis.papers import calibration
from teamsight.analysis.papers.calibration import OPEN_CLAIMS, PARAMETERS, SEARCH, Phase, assess
from teamsight.analysis.papers.touzet2000.claims import CLAIMS, Claim, Part
from teamsight.analysis.runs.grid import QUICK, Grid
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.run import Run

PHASES = (calibration.SCREEN, calibration.FINAL, calibration.REPORT)
page = partial(SEARCH.text, plan=SEARCH.plan())
DOCS = Path(__file__).parents[3] / "docs"
SMALL = Grid((2, 30), (1.0, 2.0))
PHASE = Phase("try", SMALL, (-7, -8), {"neighbours-random": CLAIMS["neighbours-random"]}, runs=1, steps=3)
TRIED = [calibration.defaults() | {"robot_speed": speed} for speed in (0.1, 0.2, 0.3)]


def judged(holds: dict[tuple[float, str, int], set[str]], phase: str = "final") -> pd.DataFrame:
    rows = []
    for (speed, idle, root), names in holds.items():
        verdicts = {name: name in names for name in OPEN_CLAIMS}
        values = dict(zip(PARAMETERS, (speed, speed / 2, False, idle, "no-force", "shared", 1.0), strict=True))
        head = {"phase": phase, "root": root, "holding": len(names), "distance_from_paper": 2.0 - speed}
        rows.append(values | head | verdicts)
    return pd.DataFrame(rows)


def whole_search(holds: dict[tuple[float, str, int], set[str]]) -> pd.DataFrame:
    return pd.concat([judged(holds, phase.name) for phase in PHASES], ignore_index=True)


def test_targets_are_always_slower_and_no_setting_comes_twice() -> None:
    found = calibration.candidates()
    assert all(0 < values["target_speed"] < values["robot_speed"] for values in found)
    assert len({tuple(values.items()) for values in found}) == len(found)


def test_more_claims_win_and_distance_breaks_ties() -> None:
    found = calibration.ranked(
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
    assert calibration.never_together(table) == [("acmommt-full", "acmommt-r10")]
    never = [name for name in OPEN_CLAIMS if name not in ("acmommt-full", "range-gain", "acmommt-r10")]
    text = " ".join(page(pd.concat([table.assign(phase=one.name) for one in PHASES])).split())
    assert f"hold under no setting: {', '.join(never)}." in text
    assert "- acmommt-full and acmommt-r10" in text


def test_a_claim_that_is_younger_than_a_table_is_left_out() -> None:
    holds = {(0.1, "stay", -2): {"acmommt-full"}, (0.2, "wander", -2): {"acmommt-r10"}}
    older = whole_search(holds).drop(columns="range-gain")
    assert "| range-gain" not in page(older)
    assert "acmommt-full and acmommt-r10" in page(older)


def test_claims_that_were_not_judged_together_exclude_nothing() -> None:
    screened = judged({(0.1, "stay", -1): {"acmommt-full"}}, "screen").drop(columns="range-gain")
    both = pd.concat([screened, judged({(0.2, "stay", -2): {"range-gain"}})], ignore_index=True)
    assert calibration.never_together(both) == []


def test_screening_may_leave_claims_to_the_final() -> None:
    screened = judged({(0.1, "stay", -1): {"acmommt-full"}, (0.2, "stay", -1): set()}, "screen")
    final = judged({(0.1, "stay", -2): {"acmommt-full"}})
    report = judged({(0.1, "stay", -5): {"acmommt-full"}}, "report")
    both = pd.concat([screened.drop(columns="range-gain"), final, report], ignore_index=True)
    assert calibration.ranked(both[both["phase"] == "screen"])["robot_speed"].tolist() == [0.1, 0.2]
    (row,) = [line for line in page(both).splitlines() if line.startswith("| range-gain")]
    assert row == "| range-gain | – | 0 % | – | – | – | – |"


def test_the_search_judges_the_best_again_and_the_defaults_and_reports_each_gain(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    values = [
        dict(zip(PARAMETERS, (speed, 0.05, False, "redraw", "no-force", "shared", 1.0), strict=True))
        for speed in (0.1, 0.2)
    ]
    claims = {name: OPEN_CLAIMS[name] for name in ("collective-flat", "neighbours-random")}
    monkeypatch.setattr(calibration, "candidates", lambda: values)
    monkeypatch.setattr(calibration, "FINALISTS", 1)
    for phase, roots in zip(PHASES, ((-1,), (-2, -3), (-4,)), strict=True):
        small = phase._replace(claims=claims, grid=QUICK, runs=1, steps=3, roots=roots)
        monkeypatch.setattr(calibration, phase.name.upper(), small)
    seen: list[tuple[str, float, float]] = []
    with WorkerPool(1) as pool:
        found = calibration.search(pool, lambda *done: seen.append(done))
    best = calibration.ranked(found[found["phase"] == "screen"]).iloc[0]
    final, report = (found[found["phase"] == phase] for phase in ("final", "report"))
    assert len(final) == 2 * 2
    assert final["robot_speed"].iloc[0] == best["robot_speed"]
    assert dict(final[PARAMETERS].iloc[-1]) == calibration.defaults()
    winner = calibration.best_of(final)
    assert report[PARAMETERS].iloc[0].to_dict() == winner
    assert set(report["gain"]) == set(calibration.VALUES["gain"])
    assert calibration.defaults() in report[PARAMETERS].to_dict("records")
    assert {name for name, _, _ in seen} == {"screen", "final", "report", "unsearched"}
    beside = found[found["phase"] == "unsearched"]
    assert beside[PARAMETERS].to_dict("records") == [winner]
    assert beside["arrive"].tolist() == [False]
    assert found.loc[found["phase"] != "unsearched", "arrive"].isna().all()
    assert seen[-1][1] == seen[-1][2]


def test_the_page_says_which_claims_change_with_the_gain() -> None:
    table = whole_search({(0.1, "stay", -2): {"acmommt-full", "range-gain"}})
    other = table[table["phase"] == "report"].assign(gain=0.5, **{"acmommt-full": False, "acmommt-r10": True})
    text = " ".join(page(pd.concat([table, other], ignore_index=True)).split())
    assert "verdict changes with the gain under the best setting: acmommt-full, acmommt-r10." in text
    assert "| acmommt-full | 0 % | 100 % | – |" in text


def test_the_page_says_what_an_option_decides_that_was_not_searched() -> None:
    table = whole_search({(0.1, "stay", -2): {"acmommt-full", "range-gain"}})
    report = table[table["phase"] == "report"]
    beside = report.assign(phase="unsearched", arrive=False, **{"acmommt-full": False, "small-arena-policy": True})
    text = page(pd.concat([table, beside], ignore_index=True))
    rows = text.partition("| value | claim |")[2].partition("\n\n")[0].splitlines()[2:]
    assert rows == [
        "| arrive=False | small-arena-policy | 0 % | 100 % |", "| arrive=False | acmommt-full | 100 % | 0 % |",
    ]  # fmt: skip
    # It is not a setting of the search, and none of its verdicts is one of them.
    never = " ".join(text.split()).partition("hold under no setting:")[2].partition("Pairs of")[0]
    assert "small-arena-policy" in never
    assert "## What was not searched\n\nNothing." in page(table)


def test_a_robot_that_never_stops_short_gains_one_claim_and_loses_two() -> None:
    # As docs/claims.md says.
    table = pd.read_parquet(DOCS / "calibration.parquet")
    report, beside = (table[table["phase"] == phase] for phase in ("report", "unsearched"))
    best = calibration.best_of(table[table["phase"] == "final"])
    default = report[(report[PARAMETERS] == pd.Series(best)).all(axis=1)]
    assert default["root"].tolist() == beside["root"].tolist() == list(calibration.REPORT.roots)
    for name, holds in (("small-arena-policy", True), ("collective-flat", False), ("awareness-where", False)):
        assert beside[name].eq(holds).all()
        assert default[name].eq(not holds).all()


def test_the_shipped_page_is_that_of_the_shipped_table() -> None:
    # Without the first line, which has the version.
    shipped = (DOCS / "calibration.md").read_text(encoding="utf-8").partition("\n")[2]
    assert shipped == page(pd.read_parquet(DOCS / "calibration.parquet"))


def test_the_default_is_what_was_not_searched() -> None:
    from teamsight.policies import Centroid

    values = calibration.defaults() | dict(calibration.UNSEARCHED)
    options = calibration.setting_of(values)["policy_options"]
    assert not options["arrive"]
    assert Centroid().arrive
    assert "arrive" not in calibration.setting_of(calibration.defaults())["policy_options"]


def test_the_preset_is_the_best_setting_of_the_shipped_table() -> None:
    table = pd.read_parquet(DOCS / "calibration.parquet")
    best = calibration.best_of(table[table["phase"] == "final"])
    assert PRESETS["touzet2000"] == calibration.setting_of(best)


def test_the_defaults_are_those_of_the_model() -> None:
    with_values, without = CMOMMT(**calibration.setting_of(calibration.defaults()), rng=1), CMOMMT(rng=1)
    assert with_values.policy == without.policy
    for world in (with_values, without):
        world.run(5)
    assert with_values.robots.position.tobytes() == without.robots.position.tobytes()
    assert with_values.targets.position.tobytes() == without.targets.position.tobytes()


def test_the_page_names_the_best_setting_and_what_excludes_what() -> None:
    holds = {(0.1, "stay", -2): {"acmommt-full", "range-gain"}, (0.2, "wander", -2): {"acmommt-r10"}}
    text = page(whole_search(holds))
    for part in ("`robot_speed=0.1`", "`target_speed=0.05`", "`idle='stay'`", "- acmommt-full and acmommt-r10"):
        assert part in text


def test_one_claim_that_is_far_off_does_not_outweigh_all_others() -> None:
    def at(distance: float) -> Claim:
        return Claim("", "", "", "a rule", decide=lambda: ("", Part(distance, "")))

    def score(*distances: float) -> tuple[int, float]:
        found = calibration.score({}, {str(number): at(one) for number, one in enumerate(distances)})
        return found["holding"], found["distance_from_paper"]

    assert score(0.5, 1e9)[1] < score(2.0, 1e9)[1] < 5
    assert score(0.5, 2.0) == (1, 1.25)


def test_every_candidate_is_judged_on_every_root_whoever_does_it(two_workers: WorkerPool) -> None:
    seen: list[tuple[str, float, float]] = []
    rows = assess(PHASE, TRIED, watch=lambda *done: seen.append(done))
    assert [(row["robot_speed"], row["root"]) for row in rows] == [
        (speed, root) for speed in (0.1, 0.2, 0.3) for root in (-7, -8)
    ]
    assert {row["phase"] for row in rows} == {"try"}
    assert seen[-1] == ("try", 3, 3)
    assert [done for _, done, _ in seen] == sorted(done for _, done, _ in seen)
    assert assess(PHASE, TRIED, two_workers) == rows
    # No candidate depends on those beside it.
    assert assess(PHASE, TRIED[1:2]) == rows[2:4]


def test_an_interrupted_search_continues_with_the_runs_that_it_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[pd.DataFrame] = []

    def search(*how: Any) -> pd.DataFrame:
        made.append(pd.DataFrame(assess(PHASE, TRIED[:2], *how)))
        if len(made) == 1:
            raise KeyboardInterrupt
        return made[-1]

    monkeypatch.setattr(calibration, "search", search)
    paper = replace(SEARCH, values=lambda table, plan: {}, template="a page", figures={})
    with pytest.raises(KeyboardInterrupt):
        paper.reproduce(paper.plan(), tmp_path)
    assert paper.checkpoint(tmp_path).count() == 2 * len(PHASE.roots) * len(SMALL.cells)
    monkeypatch.setattr(Run, "make", lambda *given: pytest.fail("made again"))
    paper.reproduce(paper.plan(), tmp_path)
    pd.testing.assert_frame_equal(made[0], made[1], check_exact=True)
    assert {file.name for file in tmp_path.iterdir()} == {"calibration.parquet", "calibration.md"}


def test_a_file_in_the_place_of_the_checkpoint_is_refused_before_the_search(tmp_path: Path) -> None:
    (tmp_path / "calibration.checkpoint").write_text("mine")
    with pytest.raises(ValueError, match=r"calibration\.checkpoint: holds something else; move it away"):
        SEARCH.reproduce(SEARCH.plan(), tmp_path)


def test_no_root_seed_of_a_search_is_one_that_a_command_accepts() -> None:
    assert max(seed for phase in PHASES for seed in phase.roots) < 0
