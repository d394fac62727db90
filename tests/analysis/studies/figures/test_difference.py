"""Differences of two studies are those of runs under the same noise."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_up_results import results

from teamsight.analysis.studies.figures.difference import pair
from teamsight.analysis.studies.study import Study

AXES = {"robots": [2, 4, 8], "radius": [2.5, 4.0]}
AWARE, UNAWARE = (Study(fixed={"policy": policy}, axes=AXES, replicates=4) for policy in ("a-cmommt", "centroid"))


def noisy(parameters: Mapping[str, Any], rng: np.random.Generator) -> float:
    """Return noise that two policies share, and a gain from one of them that depends on the team."""
    gain = 0.001 * parameters["robots"] if parameters.get("policy") == "a-cmommt" else 0.0
    return float(rng.random() * 0.5 + gain)


def table(rows: list[tuple[int, int, float]]) -> pd.DataFrame:
    return pd.DataFrame([(n, r, 100 * n + r, v) for n, r, v in rows], columns=["robots", "replicate", "seed", "loss"])


RUNS = st.dictionaries(
    st.tuples(st.integers(1, 3), st.integers(0, 3)), st.floats(-5, 5) | st.just(float("nan")), max_size=12
)


@pytest.mark.short
@given(RUNS, RUNS)
def test_pairs_are_those_of_equal_setting_replicate_and_seed(
    one: dict[tuple[int, int], float], other: dict[tuple[int, int], float]
) -> None:
    left, right = (table([(*run, value) for run, value in runs.items()]) for runs in (one, other))
    wanted = {
        row: one[run] - other[run]
        for row, run in enumerate(one)
        if run in other and not np.isnan(one[run]) and not np.isnan(other[run])
    }
    if not wanted:
        with pytest.raises(ValueError, match=f"none of the {len(one)} runs"):
            pair(left, right, ["robots"], "loss")
        return
    found = pair(left, right, ["robots"], "loss")
    assert dict(zip(found.row.tolist(), found.values.tolist(), strict=True)) == wanted


@pytest.mark.short
def test_noise_that_both_studies_share_leaves_the_difference() -> None:
    figure = results(AWARE, noisy, name="aware").plot(
        minus=results(UNAWARE, noisy, name="unaware"), kind="lines", x="robots"
    )
    lines = [line for line in figure.axes[0].lines if len(line.get_xdata()) == 3]
    assert len(lines) == 2
    for line in lines:
        # In percentage points; common noise of 50 points would hide these gains.
        assert np.asarray(line.get_ydata(), float) == pytest.approx([0.2, 0.4, 0.8], abs=1e-9)


def test_a_partial_study_is_paired_where_both_have_runs() -> None:
    aware, unaware = results(AWARE, noisy, share=0.6, seed=1), results(UNAWARE, noisy, share=0.6, seed=2)
    common = set(aware.frame.set_index(["robots", "radius", "replicate"]).index)
    common &= set(unaware.frame.set_index(["robots", "radius", "replicate"]).index)
    texts = " ".join(text.get_text() for text in aware.plot(minus=unaware).texts)
    assert f"{len(common)} pairs of runs" in texts
    assert texts.count("partial: ") == 2


def test_other_seeds_are_refused() -> None:
    other = Study(fixed={"policy": "centroid"}, axes=AXES, replicates=4, seed=1)
    with pytest.raises(ValueError, match=r"none of the 24 runs .* 24 of the other.*seeds differ; .*same seed"):
        results(AWARE).plot(minus=results(other))


def test_axes_without_common_values_are_refused() -> None:
    other = Study(axes={"robots": [3, 5], "radius": [2.5]}, replicates=4)
    with pytest.raises(ValueError, match="no values of robots, radius in common"):
        results(AWARE).plot(minus=results(other))


def test_an_axis_that_only_the_other_study_has_needs_a_value() -> None:
    other = Study(axes=AXES | {"policy": ["centroid", "random-walk"]}, replicates=4)
    with pytest.raises(ValueError, match=r"policy: is a-cmommt in the study, centroid, random-walk in that.*--where"):
        results(AWARE, noisy).plot(minus=results(other, noisy))
    figure = results(AWARE, noisy).plot(minus=results(other, noisy), where={"policy": "centroid"})
    assert "24 pairs of runs" in " ".join(text.get_text() for text in figure.texts)


def test_an_axis_that_only_the_first_study_has_is_kept() -> None:
    study = Study(axes=AXES | {"policy": ["a-cmommt", "centroid"]}, replicates=4)
    figure = results(study, noisy).plot(
        minus=results(UNAWARE, noisy), kind="lines", x="robots", y="policy", where={"radius": "4"},
        across=["policy"],
    )
    aware, unaware = (line for line in figure.axes[0].lines if len(line.get_xdata()) == 3)
    assert np.asarray(aware.get_ydata(), float) == pytest.approx([0.2, 0.4, 0.8], abs=1e-9)
    assert np.asarray(unaware.get_ydata(), float) == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)


def test_other_steps_are_refused() -> None:
    longer = Study(fixed={"policy": "centroid"}, axes=AXES, replicates=4, steps=60)
    with pytest.raises(ValueError, match=r"minus: has runs of 60 steps, not 600; "):
        results(AWARE, noisy).plot(minus=results(longer, noisy), across=["model", "policy"])


def test_an_axis_that_is_fixed_at_another_value_in_the_other_study_is_refused() -> None:
    other = Study(fixed={"policy": "centroid", "robots": 4}, axes={"radius": [2.5, 4.0]}, replicates=4)
    message = r"robots: is 2, 4, 8 in the study, 4 in that which is subtracted; .*--where.*--across"
    with pytest.raises(ValueError, match=message):
        results(AWARE).plot(minus=results(other))
    with pytest.raises(ValueError, match=r"robots: is 4 in the study, 2, 4, 8 in that"):
        results(other).plot(minus=results(AWARE))
    # One value was chosen, which is the other study's.
    figure = results(AWARE).plot(minus=results(other), where={"robots": 4})
    assert "8 pairs of runs" in " ".join(text.get_text() for text in figure.texts)


def test_an_axis_that_the_other_study_does_not_give_is_refused() -> None:
    other = Study(fixed={"policy": "centroid"}, axes={"radius": [2.5, 4.0]}, replicates=4)
    with pytest.raises(ValueError, match=r"robots: is 2, 4, 8 in the study, not given in that which is subtracted"):
        results(AWARE).plot(minus=results(other))


def test_an_axis_with_the_one_value_of_the_other_study_is_no_difference() -> None:
    one = Study(fixed={"policy": "a-cmommt"}, axes={"robots": [4], "radius": [2, 4]}, replicates=4)
    other = Study(fixed={"policy": "centroid", "robots": 4}, axes={"radius": [2, 4]}, replicates=4)
    figure = results(one).plot(minus=results(other))
    assert "8 pairs of runs" in " ".join(text.get_text() for text in figure.texts)


def test_another_model_is_refused_unless_it_is_named() -> None:
    model = "odd_models:printing"
    one, other = (results(Study(model=name, axes={"robots": [2, 4]}, replicates=3)) for name in (model, "cmommt"))
    with pytest.raises(ValueError, match=rf"minus: is of the model cmommt, not {model}, .*--across model"):
        one.plot(minus=other)
    with pytest.raises(ValueError, match="their seeds differ"):
        one.plot(minus=other, across=["model"])
    with pytest.raises(ValueError, match="across='modell': .*model"):
        one.plot(minus=other, across=["modell"])
