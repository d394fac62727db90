"""The data that ships with the package is what its command makes."""

from __future__ import annotations

from pathlib import Path

import pytest

from teamsight import policies
from teamsight.cli import main
from teamsight.policies.memory import LazyMemory

DATA = Path(policies.__file__).parent / "data"


@pytest.mark.short
def test_the_600_pairs_are_what_their_command_makes_bit_for_bit(tmp_path: Path) -> None:
    again = tmp_path / "lazy-600.safetensors"
    with pytest.raises(SystemExit) as left:
        main(["learn", "explore", "--out", str(again)])
    assert left.value.code == 0
    assert again.read_bytes() == (DATA / "lazy-600.safetensors").read_bytes()


def test_the_600_pairs_are_the_papers() -> None:
    memory = LazyMemory.load(DATA / "lazy-600.safetensors")
    assert (len(memory), memory.own, memory.added) == (600, 16, 16)
    settings = memory.settings
    assert (settings["robots"], settings["targets"], settings["steps"], settings["runs"], settings["seed"]) == (5, 10, 120, 1, 0)
    assert "random_distance=True" in settings["policy"]
