"""The search ranks by claims that hold, then by distance, on seeds of its own."""

from __future__ import annotations

import pandas as pd

from teamsight.agents.cmommt import CMOMMT, DEFAULTS
from teamsight.analysis.calibration import calibration
from teamsight.analysis.calibration.calibrate import page
from teamsight.analysis.calibration.calibration import OPEN_CLAIMS, PARAMETERS
from teamsight.analysis.paper.claims import Verdict
from teamsight.analysis.runs.experiment import QUICK
from teamsight.analysis.runs.workers import WorkerPool


def assessed(holds: dict[tuple[float, str, int], set[str]], stage: str = "final") -> pd.DataFrame:
    rows = []
    for (speed, search, root), names in holds.items():
        verdicts = {claim.name: claim.name in names for claim in OPEN_CLAIMS}
        head = {"stage": stage, "root": root, "holding": len(names), "distance": 2.0 - speed}
        rows.append(
            dict(zip(PARAMETERS, (speed, speed / 2, False, search, "no-force", "none"), strict=True)) | head | verdicts
        )
    return pd.DataFrame(rows)


def test_targets_are_always_slower_and_no_setting_comes_twice() -> None:
    found = calibration.candidates()
    assert all(0 < setting["target_speed"] < setting["robot_speed"] for setting in found)
    assert len({tuple(setting.items()) for setting in found}) == len(found)


def test_no_command_accepts_a_seed_of_the_calibration() -> None:
    roots = [*calibration.SCREEN.roots, *calibration.FINAL.roots]
    assert all(root < 0 for root in roots)
    assert len(set(roots)) == len(roots)


def test_more_claims_win_and_distance_breaks_ties() -> None:
    found = calibration.ranking(
        assessed(
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


def test_one_claim_that_is_far_off_does_not_outweigh_all_others() -> None:
    near, far = Verdict(False, "", 2.0), Verdict(False, "", 1e9)
    assert (
        calibration.score({"a": Verdict(True, "", 0.5), "b": far})[1] < calibration.score({"a": near, "b": far})[1] < 5
    )


def test_claims_that_exclude_each_other_are_found() -> None:
    table = assessed(
        {
            (0.1, "stay", -2): {"acmommt-full", "range-gain"},
            (0.2, "stay", -2): {"range-gain", "acmommt-r10"},
        }
    )
    assert calibration.never_together(table) == [("acmommt-full", "acmommt-r10")]
    assert set(calibration.never(table)) == {c.name for c in OPEN_CLAIMS} - {
        "acmommt-full",
        "range-gain",
        "acmommt-r10",
    }


def test_screening_may_leave_claims_to_the_final() -> None:
    screened = assessed({(0.1, "stay", -1): {"acmommt-full"}, (0.2, "stay", -1): set()}, "screen").drop(
        columns="range-gain"
    )
    both = pd.concat([screened, assessed({(0.1, "stay", -2): {"acmommt-full"}})], ignore_index=True)
    assert calibration.ranking(both[both["stage"] == "screen"])["robot_speed"].tolist() == [0.1, 0.2]
    assert "range-gain" in calibration.never(both)
    row = next(line for line in page(both).splitlines() if line.startswith("| range-gain"))
    assert row.endswith("| – | 0 % |")


def test_the_search_judges_the_best_again_and_the_defaults() -> None:
    settings = [
        dict(zip(PARAMETERS, (speed, 0.05, False, "redraw", "no-force", "none"), strict=True)) for speed in (0.1, 0.2)
    ]
    stages = (calibration.SCREEN._replace(runs=2), calibration.FINAL._replace(grid=QUICK, runs=2, roots=(-2, -3)))
    seen: list[tuple[int, int]] = []
    with WorkerPool(1) as pool:
        found = calibration.search(
            pool, settings=settings, stages=stages, finalists=1, steps=3, progress=lambda *done: seen.append(done)
        )
    best = calibration.ranking(found[found["stage"] == "screen"]).iloc[0]
    final = found[found["stage"] == "final"]
    assert len(final) == 2 * 2
    assert final["robot_speed"].iloc[0] == best["robot_speed"]
    assert tuple(final[list(PARAMETERS)].iloc[-1]) == calibration.DEFAULT_VALUES
    assert seen[-1] == (4, 4)


def test_the_defaults_are_those_of_the_model() -> None:
    policy = CMOMMT(rng=1).policy
    defaults = DEFAULTS | {name: getattr(policy, name) for name in calibration.OPTIONS}
    assert tuple(defaults[name] for name in PARAMETERS) == calibration.DEFAULT_VALUES


def test_claims_that_were_not_judged_together_exclude_nothing() -> None:
    screened = assessed({(0.1, "stay", -1): {"acmommt-full"}}, "screen").drop(columns="range-gain")
    both = pd.concat([screened, assessed({(0.2, "stay", -2): {"range-gain"}})], ignore_index=True)
    assert calibration.never_together(both) == []


def test_the_page_names_the_best_setting_and_what_excludes_what() -> None:
    holds = {(0.1, "stay", -2): {"acmommt-full", "range-gain"}, (0.2, "wander", -2): {"acmommt-r10"}}
    text = page(pd.concat([assessed(holds, "screen"), assessed(holds)], ignore_index=True))
    assert "`robot_speed=0.1`, `target_speed=0.05`, `uniform_target_speed=False`, `idle='stay'`" in text
    assert "- acmommt-full and acmommt-r10" in text
