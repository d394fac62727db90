"""What A-CMOMMT observes with a narrower field of view, and with missed detections. Runs on the compiled path."""

from __future__ import annotations

import math

from matplotlib.figure import Figure

from teamsight import Sensor, run_many
from teamsight.analysis.stats.paired import interval_of

PANELS = {
    "field of view [degrees]": {angle: Sensor(math.radians(angle)) for angle in (30, 60, 90, 120, 180, 240, 300, 360)},
    "missed detections [%]": {share: Sensor(missed=share / 100) for share in (0, 10, 25, 50, 75, 90)},
}


def main() -> None:
    sensors = list(dict.fromkeys(sensor for panel in PANELS.values() for sensor in panel.values()))
    table = run_many({"robots": 10, "targets": 15, "sensor": sensors}, steps=600, replicates=100, rng=1)
    observed = 100 * table.pivot(index="replicate", columns="sensor", values="observed_fraction")
    exact = observed[Sensor()]
    figure = Figure(figsize=(9, 3.8), layout="constrained")
    for axes, (label, panel) in zip(figure.subplots(1, 2, sharey=True), PANELS.items(), strict=True):
        # The same replicates with and without errors: intervals of the differences are narrow.
        lost = [interval_of((observed[sensor] - exact).to_numpy()) for sensor in panel.values()]
        for value, each in zip(panel, lost, strict=True):
            print(f"{value:4} {label:24} {each.mean:+6.1f} points ({each.low:+.1f} to {each.high:+.1f})")
        mean, error = [exact.mean() + each.mean for each in lost], [each.high - each.mean for each in lost]
        axes.errorbar(list(panel), mean, error, marker="o", markersize=4, capsize=3)
        axes.axhline(exact.mean(), color="grey", linestyle=":")
        axes.set(xlabel=label, ylim=(0, None), xticks=list(panel))
    figure.axes[0].set_ylabel("targets observed [%]")
    figure.suptitle("10 robots, 15 targets, A-CMOMMT; 95 % intervals of differences from an exact sensor (dotted)")
    figure.savefig("field_of_view.png", dpi=110)


if __name__ == "__main__":
    main()
