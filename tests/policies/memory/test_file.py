"""The file of a lazy memory: round trip, mapping, and files that are not what they were."""

from __future__ import annotations

import json
import os
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from safetensors import safe_open

from teamsight.policies.memory import LazyMemory, MemoryFileError
from teamsight.policies.memory.file import checksum, write

SETTINGS = {"awareness": "RingAwareness(delta=3)", "robots": 5, "speed": 0.1, "by": "θ"}
ABOUT = {"own": 2, "added": 3, "facts": ["gained", "lost"], "settings": SETTINGS}


def memory_of(transitions: int = 40, seed: int = 1) -> LazyMemory:
    rng = np.random.default_rng(seed)
    facts = {"lost": rng.integers(0, 2, transitions), "gained": rng.integers(0, 2, transitions)}
    situation, after = rng.random((2, transitions, 5))
    action = np.stack([rng.uniform(-3, 3, transitions), rng.random(transitions)], axis=1)
    return LazyMemory.of(situation, action, after, facts, own=2, settings=SETTINGS)


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    path = tmp_path / "transitions.safetensors"
    memory_of().save(path)
    return path


@pytest.mark.short
def test_round_trip(saved: Path) -> None:
    memory, loaded = memory_of(), LazyMemory.load(saved)
    assert loaded.table.tobytes() == memory.table.tobytes()
    assert (loaded.own, loaded.added, loaded.facts) == (memory.own, memory.added, memory.facts)
    assert loaded.settings == memory.settings == SETTINGS
    assert loaded == memory
    before = saved.read_bytes()
    loaded.save(saved)
    assert saved.read_bytes() == before
    assert loaded == memory
    assert os.listdir(saved.parent) == [saved.name]


def test_other_programs_read_it(saved: Path) -> None:
    with safe_open(saved, "numpy") as file:
        assert list(file.keys()) == ["table"]
        assert file.get_tensor("table").tobytes() == memory_of().table.tobytes()
        metadata = file.metadata()
    assert json.loads(metadata["settings"]) == SETTINGS
    assert json.loads(metadata["facts"]) == ["gained", "lost"]
    assert (metadata["own"], metadata["added"], metadata["schema"]) == ("2", "3", "1")


@pytest.mark.parametrize("verify", [True, False])
def test_a_table_is_mapped(tmp_path: Path, verify: bool) -> None:
    table = np.zeros((14, 500_000), np.float32)
    write(tmp_path / "large", table, checksum(table), ABOUT)
    tracemalloc.start()
    memory = LazyMemory.load(tmp_path / "large", verify=verify)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < table.nbytes / 50
    assert memory.table.ctypes.data % 64 == 0
    assert not memory.table.flags.writeable
    assert not memory.table.flags.owndata


def test_what_is_mapped_stays_when_the_file_is_replaced(saved: Path) -> None:
    loaded = LazyMemory.load(saved)
    memory_of(seed=2).save(saved)
    assert checksum(loaded.table) == memory_of().sha256
    assert LazyMemory.load(saved) == memory_of(seed=2)


def test_every_byte_counts(saved: Path, tmp_path: Path) -> None:
    whole, path = saved.read_bytes(), tmp_path / "altered"
    length = int.from_bytes(whole[:8], "little")
    text = whole[8 : 8 + length].rstrip()
    # All of the header but the blanks behind it, which mean nothing; and bytes here and there of the transitions.
    places = [*range(8 + len(text)), *range(8 + length, len(whole), 97), len(whole) - 1]
    for place in places:
        for bit in (0, 4, 7):
            altered = bytearray(whole)
            altered[place] ^= 1 << bit
            path.write_bytes(altered)
            with pytest.raises(MemoryFileError):
                LazyMemory.load(path)


def test_every_length_counts(saved: Path, tmp_path: Path) -> None:
    whole, path = saved.read_bytes(), tmp_path / "cut"
    header = 8 + int.from_bytes(whole[:8], "little")
    for length in {*range(0, len(whole), 37), 1, 7, 8, 9, header - 1, header, header + 1, len(whole) - 1}:
        path.write_bytes(whole[:length])
        with pytest.raises(MemoryFileError, match="explore again|that LazyMemory.save wrote"):
            LazyMemory.load(path)
    path.write_bytes(whole + b"\0")
    with pytest.raises(MemoryFileError, match="has 1 bytes too many for its 40 transitions"):
        LazyMemory.load(path)


def test_unverified_pairs_are_the_only_thing_believed(saved: Path) -> None:
    altered = bytearray(saved.read_bytes())
    altered[-1] ^= 1
    saved.write_bytes(altered)
    with pytest.raises(MemoryFileError, match="was altered, since its checksum does not fit; copy it again"):
        LazyMemory.load(saved)
    LazyMemory.load(saved, verify=False)
    saved.write_bytes(altered.replace(b"delta=3", b"delta=4"))
    with pytest.raises(MemoryFileError, match="was altered"):
        LazyMemory.load(saved, verify=False)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b'"schema": "1"', b'"schema": "2"', "in format '2', and this one reads format 1 only; use that version"),
        (b'"F32"', b'"I32"', "its header is not that of a lazy memory"),
        (b"teamsight lazy memory", b"teamsight lost memory", "its header is not that of a lazy memory"),
        (b"[14, 40]", b"[40, 14]", "its (metadata|content) is invalid"),
    ],
)
def test_other_files(saved: Path, old: bytes, new: bytes, message: str) -> None:
    content = saved.read_bytes()
    assert old in content
    saved.write_bytes(content.replace(old, new))
    with pytest.raises(MemoryFileError, match=message):
        LazyMemory.load(saved)


def test_files_that_never_were_memories(tmp_path: Path) -> None:
    for content in (b"", b"{}", b"PAR1" * 30, (2).to_bytes(8, "little") + b"[]", (2).to_bytes(8, "little") + b"{}"):
        (tmp_path / "other").write_bytes(content)
        with pytest.raises(MemoryFileError, match="LazyMemory.save|cut off"):
            LazyMemory.load(tmp_path / "other")
    for missing in ("nowhere", "."):
        with pytest.raises(MemoryFileError, match="cannot be read .* give the path of a saved memory"):
            LazyMemory.load(tmp_path / missing)


@pytest.mark.parametrize("lacking", ["own", "added", "facts", "settings"])
def test_foreign_files_that_say_too_little(tmp_path: Path, lacking: str) -> None:
    table = memory_of().table
    write(tmp_path / "foreign", table, checksum(table), {name: v for name, v in ABOUT.items() if name != lacking})
    with pytest.raises(MemoryFileError, match=f"its (metadata|content) is invalid .*{lacking}"):
        LazyMemory.load(tmp_path / "foreign")


def test_a_failed_save_leaves_what_was_there(saved: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = saved.read_bytes()

    def full(*arguments: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(MemoryFileError, match=r"cannot be written \(No space left on device\)"):
        memory_of(seed=2).save(saved)
    assert saved.read_bytes() == before
    assert os.listdir(saved.parent) == [saved.name]
    with pytest.raises(MemoryFileError, match="cannot be written .* give a path that can be"):
        memory_of().save(saved.parent / "nowhere" / "transitions")
