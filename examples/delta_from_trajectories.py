"""δ from recorded positions: record a simulated run, as a tracking system records robots, then read the file.

With the name of a file it is kept: `python examples/delta_from_trajectories.py trajectories.csv`.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from teamsight import CMOMMT
from teamsight.analysis.delta import delta_from_trajectories, read_trajectories


def record(path: Path) -> None:
    """Write the positions of a team's robots: columns time, robot, x, y."""
    model = CMOMMT(robots=20, radius=3.0, rng=1)
    model.recording.record_positions(every=5)
    model.run(3000)
    seen = model.recording.trajectory
    robots = seen[seen["group"] == "robots"].rename(columns={"identity": "robot"})
    robots[["time", "robot", "x", "y"]].to_csv(path, index=False)


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(*sys.argv[1:2]) if sys.argv[1:] else Path(folder) / "trajectories.csv"
        record(path)
        report = delta_from_trajectories(read_trajectories(path), awareness_range=1.0, risk=0.05, window=100)
    print(report)
    print(f"δ = {report.delta} (point estimate), {report.delta_safe} (with confidence)")


if __name__ == "__main__":
    main()
