"""Does an installed wheel work by itself? With a folder: are the results of `teamsight reproduce` complete?"""

from __future__ import annotations

import json
import sys
from pathlib import Path


def try_models() -> None:
    """Run the package's model on both paths, and a world composed of groups."""
    import teamsight
    from teamsight import CMOMMT, Robot, Target, Torus, World

    assert "site-packages" in teamsight.__file__, f"{teamsight.__file__}: this is not the installed wheel"
    running, stepping = CMOMMT(rng=1), CMOMMT(rng=1)
    running.run(50)
    for _ in range(50):
        stepping.step()
    assert (running.robots.position == stepping.robots.position).all()
    assert 0 < running.observed_fraction == stepping.observed_fraction <= 1
    world = World(Torus(10, 10), rng=1)
    robots = world.add(Robot, 5, policy="a-cmommt", awareness="ring")
    world.senses(robots, world.add(Target, 5, policy="random-walk"))
    world.run(10)
    assert len(world.recording.history) == 10
    print("the wheel works")


def look_at(results: Path) -> None:
    """Refuse a folder that lacks a figure, a table or the ledger."""
    pictures = sorted(path.stem for path in results.glob("figure-*.png"))
    wanted = [f"figure-{name}" for name in range(2, 12)]
    assert set(wanted) <= set(pictures), f"{results} has only {pictures}"
    assert len(list(results.glob("*.parquet"))) >= len(wanted)
    assert all(path.stat().st_size > 0 for path in results.iterdir())
    assert json.loads((results / "ledger.json").read_text(encoding="utf-8"))
    assert "collective-drop" in (results / "ledger.md").read_text(encoding="utf-8")
    print(f"{len(pictures)} pictures, their tables and the ledger are there")


if __name__ == "__main__":
    look_at(Path(sys.argv[1])) if len(sys.argv) > 1 else try_models()
