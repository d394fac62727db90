"""One rule for every file that a command writes: what teamsight did not write stays, unless --force is given."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from teamsight.analysis.runs import simulate
from teamsight.cli import main
from teamsight.policies.memory import LazyMemory

SMALL = ["--steps", "3", "--robots", "2", "--targets", "2"]
QUICK = ["--steps", "2", "--runs", "1", "--workers", "1", "--quick", "--preset", "defaults"]
#: Each command with all that it writes: to a file, or into a folder.
COMMANDS: dict[str, tuple[list[str], str, list[str]]] = {
    "run": (["run", *SMALL], "--save", ["x.parquet"]),
    "delta": (
        ["delta", *SMALL, "--runs", "3"], "--out",
        [*(f"delta_{name}.parquet" for name in ("exceedance", "maxima", "ring", "cost")), "delta_exceedance.png", "delta.md"],
    ),
    "reproduce": (
        ["reproduce", "2", *QUICK, "--format", "png, svg,pdf"], "--out",
        ["figure-2.parquet", "figure-2.png", "figure-2.svg", "figure-2.pdf"],
    ),
    "ledger": (["reproduce", "ledger", *QUICK], "--out", ["ledger.parquet", "ledger.md", "ledger.json"]),
    "explore": (["learn", "explore", *SMALL], "--out", ["x.safetensors"]),
    "evaluate": (["learn", "evaluate", "memory.safetensors", "--steps", "2", "--runs", "1", "--learner", "linear"], "--save", ["x.parquet"]),
    "figure": (
        ["learn", "figure", "--samples", "4", "--memories", "1", "--worlds", "1", "--steps", "2", "--robots", "2", "--workers", "1", "--learners", "linear"],
        "--out", ["learning-curves.parquet", "learning-curves-gains.parquet", "learning-curves-crossings.parquet", "learning-curves.png"],
    ),
    "diagnose": (
        ["learn", "diagnose", "memory.safetensors", "--samples", "5", "--k", "2", "--learners", "lazy"], "--out",
        ["diagnosis.parquet", "diagnosis.md", "diagnosis.png"],
    ),
}  # fmt: skip
#: What makes each command's results those of other settings.
OTHER = ["--seed", "1"]


@pytest.fixture
def call(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, str]]:
    """Return a function that runs a command in a folder of its own, and returns its status and what it complained of."""
    monkeypatch.chdir(tmp_path)
    # Compiled kernels and fonts are where they were.
    monkeypatch.setenv("XDG_CACHE_HOME", os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache"))
    monkeypatch.setenv("HOME", str(tmp_path))
    # On an empty cache the first command would say that it compiles.
    monkeypatch.setattr(simulate, "_announced", True)

    def run(*arguments: str) -> tuple[int, str]:
        with pytest.raises(SystemExit) as left:
            main(arguments)
        return int(left.value.code or 0), capsys.readouterr().err

    run(*COMMANDS["explore"][0], "--out", "memory.safetensors")
    return run


def place(command: str, file: str, folder: Path) -> tuple[list[str], Path]:
    """Return the whole command, and the path of one of the files that it writes."""
    line, option, files = COMMANDS[command]
    one_file = len(files) == 1
    return [*line, option, file if one_file else "results"], folder / file if one_file else folder / "results" / file


FILES = [(command, file) for command, (_, _, files) in COMMANDS.items() for file in files]


#: These make many runs even so, and write as `reproduce` does.
LONG = {"ledger"}


@pytest.mark.parametrize("command", [command for command in COMMANDS if command not in LONG])
def test_a_command_replaces_its_own_results_of_the_same_settings(
    command: str, tmp_path: Path, call: Callable[..., tuple[int, str]]
) -> None:
    line, path = place(command, COMMANDS[command][2][0], tmp_path)
    for _ in range(2):
        assert call(*line) == (0, "")
    before = path.read_bytes()
    status, message = call(*line, *OTHER)
    assert (status, message.count("\n"), "give --" in message and "--force" in message) == (2, 1, True)
    assert path.read_bytes() == before
    assert call(*line, *OTHER, "--force") == (0, "")
    assert path.read_bytes() != before
    names = sorted(file.name for file in path.parent.iterdir()) if path.parent != tmp_path else [path.name]
    assert names == sorted(COMMANDS[command][2])


@pytest.mark.parametrize(("command", "file"), FILES)
def test_what_teamsight_did_not_write_stays_and_is_named_before_the_work(
    command: str, file: str, tmp_path: Path, call: Callable[..., tuple[int, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    from teamsight.agents.world import World

    line, path = place(command, file, tmp_path)
    path.parent.mkdir(exist_ok=True)
    table = pd.DataFrame({"thesis": [1]})
    table.attrs.update(version="0.1.0", curves={})
    table.to_parquet(path.with_name("mine"))
    mine = [b"my notes", b"", b"{}", b"PAR1", b"\x89PNG\r\n\x1a\n", b"<?xml <svg/>", b"%PDF-1.4", b"[" * 100_000, path.with_name("mine").read_bytes()]
    with monkeypatch.context() as patch:
        patch.setattr(World, "run", lambda *given: pytest.fail("worked in vain"))
        for content in mine:
            path.write_bytes(content)
            status, message = call(*line)
            assert (status, message.count("\n"), path.name in message, "--force" in message) == (2, 1, True, True), message
            assert path.read_bytes() == content
    if file == COMMANDS[command][2][-1] and command not in LONG:
        assert call(*line, "--force") == (0, "")
        assert path.read_bytes() not in mine


@pytest.mark.parametrize("force", [(), ("--force",)])
@pytest.mark.parametrize(("command", "file"), FILES)
def test_only_regular_files_are_replaced_even_when_forced(
    command: str, file: str, force: tuple[str, ...], tmp_path: Path, call: Callable[..., tuple[int, str]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    from teamsight.agents.world import World

    line, path = place(command, file, tmp_path)
    path.parent.mkdir(exist_ok=True)
    (tmp_path / "elsewhere").write_text("mine")
    patches: list[tuple[Callable[[], object], str]] = [
        (lambda: path.symlink_to(tmp_path / "elsewhere"), "link"), (lambda: path.symlink_to(tmp_path / "new"), "link"),
        (lambda: os.mkfifo(path), "named pipe"), (path.mkdir, "folder"),
    ]  # fmt: skip
    monkeypatch.setattr(World, "run", lambda *given: pytest.fail("worked in vain"))
    for make, kind in patches:
        make()
        status, message = call(*line, *force)
        assert (status, message.count("\n"), f"is a {kind}" in message) == (2, 1, True), message
        path.rmdir() if kind == "folder" else path.unlink()
    assert (tmp_path / "elsewhere").read_text() == "mine"
    assert not (tmp_path / "new").exists()


def test_drafts_and_checkpoints_are_not_written_through_links(
    tmp_path: Path, call: Callable[..., tuple[int, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    from teamsight.analysis.learning import explore as exploring

    # The name that drafts had before: anybody could foresee it, and it was followed.
    (tmp_path / "mine").write_text("mine")
    (tmp_path / f".x.parquet.{os.getpid()}.part").symlink_to("mine")
    assert call(*place("run", "x.parquet", tmp_path)[0])[0] == 0
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "learning-curves.checkpoint").symlink_to(tmp_path / "mine")
    status, message = call(*place("figure", "learning-curves.png", tmp_path)[0])
    assert (status, "learning-curves.checkpoint: is a link" in message) == (2, True)
    (tmp_path / "results" / ".checkpoint").symlink_to(tmp_path / "mine")
    status, message = call(*place("ledger", "ledger.md", tmp_path)[0])
    assert (status, ".checkpoint: is a link" in message) == (2, True)
    (tmp_path / "results" / ".checkpoint").unlink()
    (tmp_path / "results" / ".checkpoint").write_text("mine")
    status, message = call(*place("ledger", "ledger.md", tmp_path)[0])
    assert (status, ".checkpoint: holds something else" in message) == (2, True)
    monkeypatch.setattr(exploring, "_LONG", 1)
    (tmp_path / "x.safetensors.checkpoint").symlink_to(tmp_path / "mine")
    status, message = call(*place("explore", "x.safetensors", tmp_path)[0], "--runs", "2")
    assert (status, "x.safetensors.checkpoint: is a link" in message) == (2, True)
    assert (tmp_path / "mine").read_text() == "mine"


def test_the_home_folder_is_expanded_once(tmp_path: Path, call: Callable[..., tuple[int, str]]) -> None:
    for path in ("~/x.parquet", "~/a b/y.parquet"):
        assert call("run", *SMALL, "--save", path)[0] == 0
        assert len(pd.read_parquet(tmp_path / path[2:])) == 3
        assert call("run", *SMALL, f"--save={path}")[0] == 0
    assert call("learn", "explore", *SMALL, "--out", "~/m.safetensors")[0] == 0
    evaluate = ["learn", "evaluate", "~/m.safetensors", "--steps", "2", "--runs", "1", "--learner", "linear"]
    assert call(*evaluate, "--save", "~/e.parquet")[0] == 0
    assert call("delta", *SMALL, "--runs", "3", "--out", "~/d")[0] == 0
    assert (tmp_path / "d" / "delta.md").exists()
    assert len(LazyMemory.load(tmp_path / "m.safetensors")) == 6
    assert not any("~" in str(path) or path.stat().st_size == 0 for path in tmp_path.rglob("*"))


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("", "is empty; give a file"),
        (" ", "is empty; give a file"),
        (".", "is a folder; give a file"),
        ("x/..", "is a folder; give a file"),
        ("x.parquet/", "is a folder; give a file"),
        ("s3://bucket/x.parquet", "is an address; give a file on this machine"),
        ("file:///x.parquet", "is an address; give a file on this machine"),
        ("~no-such-user/x", "there is no such user; write ./~"),
        ("x\0y", "contains a null character"),
        ("x" * 300, "cannot be written (File name too long)"),
    ],
)


def test_paths_that_cannot_be_meant(path: str, message: str, tmp_path: Path, call: Callable[..., tuple[int, str]]) -> None:
    before = sorted(tmp_path.rglob("*"))
    status, error = call("run", *SMALL, "--save", path)
    assert (status, error.count("\n"), message in error, len(error) < 400) == (2, 1, True, True), error
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    "name", ["x\ny.parquet", "é ✓.parquet", "n" * 250, "x.parquet.gz", "[red]x", "%s{0}", "-x", "./~x"]
)


def test_names_are_taken_literally(name: str, tmp_path: Path, call: Callable[..., tuple[int, str]]) -> None:
    assert call("run", *SMALL, f"--save={name}") == (0, "")
    with (tmp_path / name).open("rb") as file:
        assert len(pd.read_parquet(file)) == 3
