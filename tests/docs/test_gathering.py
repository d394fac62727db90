"""The tables of the page on the gathering index are those of its Parquet files, and what it says is in them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pandas as pd

from teamsight.analysis.gathering.cells import Cell, DeltaInterval
from teamsight.analysis.gathering.claims import judge
from teamsight.analysis.gathering.page import index_table, summary_table
from teamsight.analysis.stats.paired import Interval

DOCS = Path(__file__).resolve().parents[2] / "docs" / "tasks"
PAGE = (DOCS / "gathering.md").read_text(encoding="utf-8")
TABLE = pd.read_parquet(DOCS / "gathering-index.parquet")
ROUNDS = pd.read_parquet(DOCS / "gathering-rounds.parquet")
MEETING = ["forage", "consume", "push", "collect"]
# Only the answers are in the file, not the shortfalls.
_ANSWERS = {"yes": Interval(0.0, 0.0, 0.0), "undecided": Interval(0.0, -math.inf, math.inf)}


def _cell(row: Any) -> Cell:
    explore, skilled, saturation = (
        DeltaInterval(*(int(row[f"{name}_{part}"]) for part in ("delta", "low", "high")))
        for name in ("explore", "skilled", "saturation")
    )
    ratio, gain, skill = (Interval(row[name], row[f"{name}_low"], row[f"{name}_high"]) for name in ("ratio", "gain", "skill"))
    found = _ANSWERS[row["enough_at_explore"]]
    shortfall = {skilled.delta: _ANSWERS[row["enough_at_skilled"]], explore.delta: found}
    given = {name: row[name] for name in ("objective", "tolerance", "censored", "too_few", "too_many", "crowded")}
    return Cell(
        row["task"], row["gathers"], row["size"], explore, skilled, ratio, saturation, shortfall,
        gain=gain, skill=skill, explored=found, **given,
    )  # fmt: skip


def _room(rows: pd.DataFrame) -> pd.Series[int]:
    """Return by how much δ of skill may be larger, by bounds, for each task and N."""
    rows = rows.set_index(["task", "size"])
    return rows["skilled_high"] - rows["explore_low"]


CELLS = [_cell(row) for _, row in TABLE.iterrows()]


def test_the_tables_are_those_of_the_files() -> None:
    assert index_table(CELLS) in PAGE
    assert summary_table(judge(CELLS)) in PAGE
    for (task, size), rounds in ROUNDS.groupby(["task", "size"], sort=False):
        more, trainings = rounds["runs"].iloc[1:].sum(), rounds["trainings"].sum()
        line = next(line for line in PAGE.splitlines() if line.startswith(f"| {task} | {size} |"))
        assert line.endswith(f"| {more} | {trainings} | yes | 0 (0 to 0) |")


def test_what_the_page_says_of_neighbours_is_in_the_file() -> None:
    apart = TABLE[TABLE["gathers"].eq(False)]
    assert ((apart["ratio"] >= 0.8) & (apart["ratio"] <= 1.25)).all()
    assert apart["ratio_high"].max().round(2) == 1.89
    assert (apart["skilled_delta"] - apart["explore_delta"]).max() == 2
    room = _room(apart)
    assert room[room > 1].to_dict() == {("graze", 16): 3, ("graze", 30): 8}
    hunters = TABLE[TABLE["task"].isin(["pursuit", "surround"])]
    assert ((hunters["ratio"] >= 1) & (hunters["ratio"] < 1.3)).all()
    room = _room(hunters)
    assert room[room > 2].to_dict() == {("pursuit", 16): 4, ("pursuit", 30): 6}


def test_what_the_page_says_of_robots_that_meet_is_in_the_file() -> None:
    many = TABLE[TABLE["task"].isin(MEETING) & (TABLE["size"] >= 8)]
    shown = many["ratio_low"] > 1
    assert sorted(many.loc[shown, "ratio"].round(1))[::9] == [1.6, 3.6]
    assert sorted(many.loc[shown, "ratio"].round(1))[-2] == 2.5
    assert (many.loc[shown, "skilled_delta"] == many.loc[shown, "size"] - 1).sum() == 7
    left = many[~shown]
    assert set(zip(left["task"], left["size"], strict=True)) == {("consume", 8), ("collect", 30)}
    assert many.loc[(many["task"] == "push") & (many["size"] == 30), "censored"].item() == 0.54


def test_what_the_page_says_of_need_is_in_the_file() -> None:
    below = TABLE[TABLE["explore_delta"] < TABLE["size"] - 1]
    assert below["enough_at_explore"].value_counts().to_dict() == {"yes": 22, "undecided": 5}
    left = below[below["enough_at_explore"] == "undecided"]
    assert left["task"].value_counts().to_dict() == {"collect": 4, "forage": 1}
    worse = TABLE[TABLE["gain_high"] < 0]
    assert worse.groupby("task")["size"].apply(list).to_dict() == {
        "consume": [16, 30], "forage": [4, 16, 30], "pursuit": [16, 30],
    }  # fmt: skip
    g2 = [one.outcome for one in judge(CELLS) if one.claim == "G2" and one.task]
    assert (g2.count("holds"), g2.count("does not hold"), g2.count("undecided")) == (10, 0, 12)


def test_what_the_page_says_of_robot_steps_is_in_the_file() -> None:
    assert set(TABLE["has_skill"]) == {"yes"}
    by_task = {task: (100 * rows.set_index("size")["crowded"]).round(2) for task, rows in TABLE.groupby("task")}
    assert (by_task["push"].min(), by_task["push"].max()) == (64.46, 80.89)
    assert (by_task["forage"].min(), by_task["forage"].loc[8:].min(), by_task["forage"].max()) == (0.0, 4.4, 6.05)
    assert (by_task["consume"].loc[8:].min(), by_task["consume"].max()) == (1.3, 2.0)
    assert by_task["collect"].tolist() == [7.13, 3.01, 0.87, 0.0]
    assert max(by_task[task].max() for task in ("cmommt", "graze", "pursuit", "surround")) < 0.1
