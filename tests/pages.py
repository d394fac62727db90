"""Pages as programs: their blocks are run in order, in one folder, and must print what the page shows below them."""

from __future__ import annotations

import contextlib
import io
import re
import shlex
import sys
import types
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

DOCS = Path(__file__).resolve().parents[1] / "docs"
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)


class Block(NamedTuple):
    """A block of a page: its language, its content, the line on which it begins, and whether it follows another at once."""

    language: str
    content: str
    line: int
    follows: bool


def blocks_of(page: Path) -> list[Block]:
    """Return the blocks of a page, in order."""
    text = page.read_text(encoding="utf-8")
    blocks, end = [], 0
    for found in FENCE.finditer(text):
        follows = bool(blocks) and not text[end : found.start()].strip()
        blocks.append(Block(found[1], found[2], text.count("\n", 0, found.start(2)), follows))
        end = found.end()
    return blocks


def matches(printed: str, shown: str) -> bool:
    """Return whether an output is as shown, line by line; … stands for anything within a line."""
    lines = printed.rstrip().splitlines(), shown.rstrip().splitlines()
    return len(lines[0]) == len(lines[1]) and all(
        re.fullmatch(".*".join(map(re.escape, expected.rstrip().split("…"))), line.rstrip())
        for line, expected in zip(*lines, strict=True)
    )


def contains(printed: str, shown: str) -> bool:
    """Return whether the lines shown are among those printed, in this order."""
    rest = iter(printed.splitlines())
    return all(any(matches(line, expected) for line in rest) for expected in shown.splitlines())


class Session:
    """What the blocks of one page share: a namespace, and the folder in which they run, which is the current one.

    Parameters
    ----------
    name : str
        The name of the module that holds the namespace.
    folder : Path
        Where files are written.
    """

    def __init__(self, name: str, folder: Path) -> None:
        self.folder = folder
        self.module = types.ModuleType(name)
        self.count = 0

    def run(self, block: Block) -> str:
        """Run a block and return what it printed; blocks in other languages are files, if they begin with a name."""
        named = re.match(r"# ([\w-]+\.\w+)\n", block.content)
        if named:
            (self.folder / named[1]).write_text(block.content, encoding="utf-8")
        elif block.language == "python":
            return self.python(block.content)
        elif block.language == "sh":
            return "".join(self.command(line) for line in block.content.splitlines() if line.strip())
        return ""

    def python(self, code: str) -> str:
        """Run code in the namespace of the page and return what it printed."""
        self.count += 1
        # A file, because kernels are looked up by their source.
        script = self.folder / f"block_{self.count}.py"
        script.write_text(code, encoding="utf-8")
        sys.modules[self.module.__name__] = self.module
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            exec(compile(code, str(script), "exec"), self.module.__dict__)
        return out.getvalue()

    def command(self, line: str) -> str:
        """Run a teamsight command in this process and return what it printed."""
        from teamsight.cli import main

        program, *arguments = shlex.split(line, comments=True)
        assert program == "teamsight", f"{line}: only teamsight commands are run"
        # A worker process for these few runs would take longer to start than they last.
        workers = ["--workers", "1"] if arguments[0] == "sweep" else []
        out = io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
            try:
                main([*arguments, *workers])
            except SystemExit as left:
                assert not left.code, f"{line}: exit status {left.code}\n{out.getvalue()}"
        return out.getvalue()


def run_page(page: Path, folder: Path) -> Iterator[tuple[Block, str, Block]]:
    """Run a page; yield each block that shows an output, what was printed, and the block that printed it.

    A block of text directly below another one shows its output.
    """
    session = Session("page_" + re.sub(r"\W", "_", page.stem), folder)
    printed, by = "", None
    for block in blocks_of(page):
        if block.language == "text":
            if block.follows and by:
                yield block, printed, by
        elif block.content.startswith("import torch") and not find_spec("torch"):
            continue  # no extra of this package
        elif block.language in ("python", "sh", "toml"):
            try:
                printed, by = session.run(block), block
            except Exception as error:
                raise AssertionError(f"{page.name}, block of line {block.line}: {error}") from error
