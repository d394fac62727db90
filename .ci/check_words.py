"""Find words that this project does not use: each thing has one name, which docs/glossary.md explains.

Run it from anywhere: `python .ci/check_words.py [PATH]...`, where PATH is the beginning of a path in the repository. It
prints one line for each find and exits with 1 if there is any.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
PLACES = ("agents", "analysis", "policies", "world", "teamsight", "examples", "benchmarks", "tests", "docs")
# They quote the words.
LEFT_OUT = ("tests/docs/test_words.py",)
PAGES = ("README.md", "CONTRIBUTING.md", "pyproject.toml")


class Rule(NamedTuple):
    """A word that is not used.

    Attributes
    ----------
    pattern : str
        A regular expression; upper and lower case are distinguished.
    instead : str
        What to write.
    where : tuple of str
        Beginnings of the paths to which the rule applies; all if there are none.
    allowed : str
        A regular expression of legitimate uses, which are removed from a line before it is searched.
    """

    pattern: str
    instead: str
    where: tuple[str, ...] = ()
    allowed: str = ""


def name(*words: str) -> str:
    """Return a pattern of words, alone or as parts of an identifier, at its beginning or end or between underscores."""
    return rf"(?<![A-Za-z])(?:{'|'.join(words)})(?![a-z])"


_LEARNING = (
    "policies/lazy", "policies/eager", "policies/memory", "policies/rewards", "analysis/learning",
    "agents/recording", "teamsight/cli", "docs/learning", "docs/commands", "docs/glossary", "examples/learn",
)  # fmt: skip

RULES = (
    Rule(
        name("pairs?"), "transition", _LEARNING,
        r"(?i)pairs? of (?:robots|agents|arrays|numbers)|in pairs|object_pairs_hook|situation–action pair",
    ),
    Rule(name("gamma", "GAMMA"), "discount"),
    Rule(name("alpha"), "learning_rate", allowed=r"\balpha=|\"alpha\""),
    Rule(r"\b[cC]rews?\b", "worker pool"),
    Rule(
        name("tells?", "told", "telling", "Tells?", "Told"), "emit, message, or say it directly",
        allowed=r"(?i)\b(?:tells?|telling|told)(?: \w+){0,3} apart|(?:file|strategy)\.tell\(",
    ),
    Rule(name("unfinished", "Unfinished"), "checkpoint"),
    Rule(r"\bLectures?\b|\blectures?\b|_lectures?\b", "curve job"),
    Rule(r"\bLessons?\b|\blessons?\b|_lessons?\b", "objective"),
    Rule(name("stages?", "Stage"), "scenario", allowed=r"teamsight-stage|at this stage|early stage"),
    Rule(r"\bsearch_when\b|\bsearch=.(?:redraw|wander|stay)|ACmommt\.search|\bSEARCH_", "idle, idle_when"),
    Rule(r"\b[Ll]earned rule\b|policy=\"learned\"|\bclass Learned\b|learned\.(?:md|png|parquet)", "evolved"),
    Rule(r"(?<![A-Za-z])mates\b", "teammates"),
    Rule(r"percept\.reports|\breports=", "relayed"),
    Rule(r"\bSightings\b|\bSightingsOfOne\b|\bProximityGraph\b", "NeighbourList"),
    Rule(r"\bMinds?\b|\bminds?\b|\barrays\.knowledge\b", "policy, PolicyArrays"),
    Rule(name("noting", "experiences?", "Experience", "EXPERIENCE"), "transitions"),
    Rule(name("membership"), "building"),
    Rule(name("tents?", "paces?"), "hat features, distances"),
    Rule(
        # In teamsight/view and teamsight/live, tracks are what a page plays.
        name("tracks", "Tracks"), "trajectories",
        ("analysis", "teamsight/cli", "teamsight/core", "docs/delta", "examples", "README"),
        r"(?i)target[_ -]?tracks",
    ),
    Rule(name("roads?"), "path"),
    Rule(r"\b[Bb]elieved?\b", "say what the code does"),
    Rule(r"\b[Oo]beys?\b", "say what the code does"),
    Rule(name("rooms"), "package"),
    Rule(r"\b[Ww]hat a step later is worth\b|\bWho is nearer\b", "discount factor; distance within which …"),
    Rule(
        r"\bneighbor|\bcolor(?!map|bar|s?=|\()|\bbehavior", "neighbour, colour, behaviour",
        ("docs", "README", "teamsight/cli"),
    ),
)  # fmt: skip


def files() -> Iterator[Path]:
    """Yield each file that is searched."""
    for place in PLACES:
        for path in sorted((ROOT / place).rglob("*")):
            if path.suffix not in (".py", ".md") or any(part.is_symlink() for part in path.parents):
                continue
            if path.relative_to(ROOT).as_posix() not in LEFT_OUT:
                yield path
    yield from (ROOT / page for page in PAGES)


def found_in(path: str, text: str) -> Iterator[str]:
    """Yield one line for each word in a file that is not used.

    Parameters
    ----------
    path : str
        Where the file is, from the root of the repository.
    text : str
        Its content.
    """
    rules = [rule for rule in RULES if not rule.where or path.startswith(rule.where)]
    # Most files have none of the words, and one search of a text is faster than one of each line.
    rules = [rule for rule in rules if re.search(rule.pattern, text)]
    for number, line in enumerate(text.splitlines(), 1):
        for rule in rules:
            cleared = re.sub(rule.allowed, "", line) if rule.allowed else line
            if word := re.search(rule.pattern, cleared):
                yield f"{path}:{number}: {word.group()!r}: write {rule.instead}"


def main(beginnings: tuple[str, ...] = ("",)) -> int:
    """Print what is found in files whose path begins so, and return the exit status."""
    found = [
        line
        for path in files()
        if (name := path.relative_to(ROOT).as_posix()).startswith(beginnings)
        for line in found_in(name, path.read_text(encoding="utf-8"))
    ]
    print("\n".join(found) or "no words that are not used")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(tuple(sys.argv[1:]) or ("",)))
