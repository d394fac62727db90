"""Memory files load only if `LazyMemory.of` and `save` could have written them, whoever computed their checksums."""

from __future__ import annotations

import copy
import hashlib
import json
import os
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from teamsight.policies.memory import LazyMemory, MemoryFileError

CASES = 300
INPUTS, PAIRS = 5, 12


def memory() -> LazyMemory:
    noise = np.random.default_rng(3)
    # Few values, so that transitions are equal in their first components.
    before, after = noise.integers(0, 2, (2, PAIRS, INPUTS))
    action = np.stack([noise.uniform(-3, 3, PAIRS), noise.random(PAIRS)], axis=1)
    facts = {"gained": noise.integers(0, 2, PAIRS), "lost": noise.integers(0, 2, PAIRS)}
    return LazyMemory.of(before, action, after, facts, own=3, settings={"robots": 5, "by": "θ", "arena": {"radius": 0.5}})


class Parts:
    """A memory file in parts, which are put together with checksums that fit."""

    def __init__(self, content: bytes) -> None:
        length = int.from_bytes(content[:8], "little")
        self.header = json.loads(content[8 : 8 + length])
        self.table = np.frombuffer(content[8 + length :], "<f4").reshape(-1, PAIRS).copy()

    @property
    def metadata(self) -> dict[str, Any]:
        found: dict[str, Any] = self.header["__metadata__"]
        return found

    def bytes(self, change: Callable[[bytes], bytes] = lambda header: header) -> bytes:
        metadata = self.metadata
        metadata.pop("sha256_of_metadata", None)
        metadata["sha256"] = hashlib.sha256(self.table.tobytes()).hexdigest()
        metadata["sha256_of_metadata"] = hashlib.sha256(json.dumps(metadata, sort_keys=True).encode()).hexdigest()
        header = change(json.dumps(self.header, ensure_ascii=False).encode(errors="surrogatepass"))
        header += b" " * (-(8 + len(header)) % 64)
        return len(header).to_bytes(8, "little") + header + self.table.tobytes()


NAN = float("nan")
NUMBERS = (NAN, float("inf"), -float("inf"), 2e30, -2e30, -0.0)
TEXTS: dict[str, tuple[str, ...]] = {
    "own": ("-1", "0", "6", "true", "3.0", '"3"', "null", "[3]", "1e9", "NaN", " 3", "03", "3", "9" * 5000, ""),
    "added": ("-1", "3", "false", "2.0", '"2"', "null", "-0", "Infinity", "2 ", "1e400", "{}"),
    "facts": ('["lost", "gained"]', '["gained", "gained"]', '["gained", 1]', '["gained"]', '{"gained": 1, "lost": 2}', '"gained, lost"', "null",
              '["gained", "\\ud800"]', '["gained","lost"]', '["gained", ["lost"]]', '["gained", "lost", "sensed"]', "7"),
    "settings": ("null", "[]", "[1]", '"x"', "7", "{", "{]", "x", "", '{"seed": NaN}', '{"seed": Infinity}', '{"seed": -Infinity}', '{"a": 1, "a": 2}',
                 '{"a":1}', '{"a": 1e400}', '{"a": "\\ud800"}', '{"a": ' * 100_000 + "1" + "}" * 100_000, "[" * 200_000, '{"a": ' + "9" * 5000 + "}", '{"a": 1.50}', "{'a': 1}"),
    "sha256_of_pairs": ("1",), "also": ('"more"',), "": ("0",),
}  # fmt: skip


def forge_number(parts: Parts, noise: random.Random) -> bytes:
    """A number that no memory holds, with checksums that fit."""
    row = noise.randrange(len(parts.table))
    limits = {INPUTS: (3.2, -4.0), INPUTS + 1: (1.5, -0.5)}.get(row, ())
    parts.table[row, noise.randrange(PAIRS)] = noise.choice((*NUMBERS, *limits))
    return parts.bytes()


def forge_order(parts: Parts, noise: random.Random) -> bytes:
    """Transitions in another order; all are different, as their rotations are."""
    one, other = noise.sample(range(PAIRS), 2)
    parts.table[:, [one, other]] = parts.table[:, [other, one]]
    return parts.bytes()


def forge_text(parts: Parts, noise: random.Random) -> bytes:
    """Metadata that `save` does not write."""
    name = noise.choice(sorted(TEXTS))
    text = noise.choice(TEXTS[name])
    if parts.metadata.get(name) == text:
        text += " "
    parts.metadata[name] = text
    return parts.bytes()


def forge_missing(parts: Parts, noise: random.Random) -> bytes:
    """Metadata that lacks something."""
    del parts.metadata[noise.choice(("own", "added", "facts", "settings", "format", "schema"))]
    return parts.bytes()


def forge_tensor(parts: Parts, noise: random.Random) -> bytes:
    """A tensor that is described in another way."""
    tensor = parts.header["table"]
    columns = len(parts.table)
    name, value = noise.choice((
        ("dtype", "F16"), ("dtype", ["F32"]), ("dtype", None), ("shape", [PAIRS, columns]), ("shape", [columns * PAIRS]), ("shape", [columns, float(PAIRS)]),
        ("shape", [str(columns), PAIRS]), ("shape", [-columns, -PAIRS]), ("shape", [columns, 0]), ("shape", [columns, 2**70]), ("shape", [1, columns * PAIRS]),
        ("shape", [columns, PAIRS, 1]), ("shape", {"0": 1}), ("shape", None), ("shape", [True, PAIRS]), ("data_offsets", [0, 4.0 * columns * PAIRS]),
        ("data_offsets", [4, 4 * columns * PAIRS]), ("data_offsets", [False, 4 * columns * PAIRS]), ("data_offsets", []), ("data_offsets", [0, 10**400]), ("more", 1),
    ))  # fmt: skip
    tensor[name] = value
    return parts.bytes()


def forge_header(parts: Parts, noise: random.Random) -> bytes:
    """A header that is not quite the JSON that `save` writes."""
    change: Callable[[bytes], bytes] = noise.choice((
        lambda header: header[:-1], lambda header: header + b"}", lambda header: b"[" + header + b"]", lambda header: b"[" * 100_000,
        lambda header: header.replace(b'"table":', b'"table": 1, "table":'), lambda header: header.replace(b'"own":', b'"own": "3", "own":'),
        lambda header: b"\xef\xbb\xbf" + header, lambda header: header.decode().encode("utf-16"), lambda header: header.replace(b"\xce\xb8", b"\xff"),
        lambda header: header[:-1] + b', "more": {}}', lambda header: b"null", lambda header: b"{}", lambda header: b"",
        lambda header: header.replace(b'"__metadata__": {', b'"__metadata__": {"more": 1, '), lambda header: header.replace(b'"F32"', b"NaN"),
    ))  # fmt: skip
    return parts.bytes(change)


def damage(parts: Parts, noise: random.Random) -> bytes:
    """Bytes that an accident changed."""
    content = bytearray(parts.bytes())
    end = 8 + len(bytes(content[8:]).split(b" " * 8)[0].rstrip(b" "))
    how = noise.randrange(5)
    if how == 0:
        content[noise.randrange(end)] ^= 1 << noise.randrange(8)
    elif how == 1:
        content = content[: noise.randrange(len(content))]
    elif how == 2:
        content += bytes(noise.randrange(1, 9))
    elif how == 3:
        content[:8] = noise.choice((0, 1, 7, 8, len(content), 2**31, 2**63, 2**64 - 1)).to_bytes(8, "little")
    else:
        content = bytearray(noise.randbytes(noise.randrange(200)))
    return bytes(content)


FORGERIES = (forge_number, forge_order, forge_text, forge_missing, forge_tensor, forge_header, damage)


@pytest.mark.short
def test_no_damaged_or_forged_file_loads(tmp_path: Path) -> None:
    whole, path = tmp_path / "whole", tmp_path / "file"
    memory().save(whole)
    parts = Parts(whole.read_bytes())
    assert parts.bytes() == whole.read_bytes()
    for case in range(CASES):
        noise = random.Random(case)
        forge = FORGERIES[case % len(FORGERIES)]
        content = forge(copy.deepcopy(parts), noise)
        path.write_bytes(content)
        with pytest.raises(MemoryFileError) as caught:
            pytest.fail(f"seed {case}, {forge.__name__}: loads as {LazyMemory.load(path)!r}")
        message = str(caught.value).removeprefix(str(path))
        assert len(message) < 300, f"seed {case}, {forge.__name__}: {message}"
        assert "\n" not in message, f"seed {case}, {forge.__name__}: {message}"
        assert path.read_bytes() == content


@pytest.mark.parametrize("verify", [True, False])
def test_what_the_metadata_say_is_checked_whether_or_not_the_pairs_are(tmp_path: Path, verify: bool) -> None:
    memory().save(tmp_path / "file")
    parts = Parts((tmp_path / "file").read_bytes())
    parts.metadata["settings"] = "[1]"
    (tmp_path / "file").write_bytes(parts.bytes())
    with pytest.raises(MemoryFileError, match=r"settings=\[1\]: must be a mapping.*; write it with LazyMemory\.save"):
        LazyMemory.load(tmp_path / "file", verify=verify)


def test_every_memory_that_can_be_made_comes_back(tmp_path: Path) -> None:
    noise = np.random.default_rng(5)
    for number in range(20):
        transitions, inputs, facts = noise.integers(1, 6000), noise.integers(1, 4), noise.integers(0, 3)
        before, after = noise.integers(-1, 2, (2, transitions, inputs)) * 1e30
        action = np.stack([noise.integers(-1, 2, transitions) * np.float32(np.pi), noise.integers(0, 2, transitions)], axis=1)
        made = LazyMemory.of(
            before, action, after, {f"δ{n}": -noise.integers(0, 2, transitions) * 0.0 for n in range(facts)}, own=1,
            settings={"": None, "deep": [[[{}]]], "é\n\x00": [1e-300, -0.0, 2**70, True], "number": number},
        )  # fmt: skip
        made.save(tmp_path / "file")
        back = LazyMemory.load(tmp_path / "file")
        assert (back, dict(back.settings)) == (made, dict(made.settings))


@pytest.mark.parametrize("settings", [{"a": "\ud800"}, {"\udfff": 1}, {"a": 10**5000}, {"a": {1, 2}}])
def test_settings_that_no_file_holds_are_refused_when_the_memory_is_made(settings: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="settings: cannot be written as JSON .* give numbers, strings and lists"):
        LazyMemory.of([[0.5]], [[0, 0]], [[0.5]], {}, own=1, settings=settings)


def test_only_regular_files_are_read_and_only_memories_replaced(tmp_path: Path) -> None:
    notes, link, pipe = tmp_path / "notes", tmp_path / "link", tmp_path / "pipe"
    notes.write_text("thesis")
    link.symlink_to("notes")
    os.mkfifo(pipe)
    with pytest.raises(MemoryFileError, match="Not a regular file"):
        LazyMemory.load(pipe)
    with pytest.raises(MemoryFileError, match="holds something else; give --force .in Python, force=True. to replace it"):
        memory().save(notes)
    for force in (False, True):
        for place, kind in ((link, "link"), (pipe, "named pipe"), (tmp_path, "folder")):
            with pytest.raises(MemoryFileError, match=f"is a {kind}, which is never replaced; give "):
                memory().save(place, force=force)
    assert notes.read_text() == "thesis"
    memory().save(notes, force=True)
    assert LazyMemory.load(notes) == memory()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link", "notes", "pipe"]
