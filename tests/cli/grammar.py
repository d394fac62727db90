"""A grammar of command lines: commands, options and values, valid, at their limits, and nonsense.

Paths are names without a folder, or in folders of the fuzzer's own, so that nothing outside the current folder is met;
"~" is whatever HOME is. Valid sizes are tiny, and there is one worker.
"""

from __future__ import annotations

import random

# Each is refused before any work, whatever else stands in the line.
HUGE = ("10000000000000", "1" * 400, "9" * 10_000, "1e400", "1e308", "-1e308", "99999999999999999999")
SMALL = ("1e-320", "5e-324", "1e-300", "-0.0", "0", "-1", "-1e-320")
ODD = ("nan", "inf", "-inf", "NaN", "", " ", "1.5", "x", "1,2", "0x10", "1_0", "١", "½", "true", "None", "--", "\u202e3", "\x1b[2J", "3\n4", "a" * 5000, "\udcff", "1\0")

PATHS = (
    "r.parquet", "deep/er/r.parquet", "here/r.parquet", "~/r.parquet", "~nobody-of-this-name/r", "~", ".", "..x", "here", "here/", "",
    " ", "r.parquet/", "x\ny.parquet", "é✓.parquet", "n" * 240, "n" * 300, "n" * 5000, "file:/r", "s3:/bucket/r.parquet", "http://r/r",
    "notes.md", "table.parquet", "notes.md/x", "link", "dangling", "pipe", "folder-link/r.parquet", "ours.parquet", "r.parquet.gz",
    "\x1b[31mr", "-r", "[red]r", "[/]r", "\udcffr", "r\0", "memory.safetensors", "a/../r.parquet", "trajectories.csv", "CON", "x|y", "%s%n{0}",
)  # fmt: skip
MEMORIES = ("memory.safetensors", "damaged.safetensors", "notes.md", "pipe", "none", "here", "table.parquet", "link", "")
ODD_MEMORIES = tuple(f"odd-{number}" for number in range(15))
TRAJECTORIES = ("trajectories.csv", "[red]trajectories.csv", "notes.md", "table.parquet", "none.csv", "here", "empty.csv", "memory.safetensors", "[/]none")

COUNT = (("1", "2", "3", "2.0", "1e0", "+3", " 2 "), HUGE, SMALL, ODD)
LENGTH = (("1", "1.5", "2", "1e0", ".5"), HUGE, SMALL, ODD)
SEED = (("0", "1", "7", "9007199254740993"), HUGE, SMALL, ODD)
SHARE = (("0", "0.5", "1", "1e-9"), HUGE, SMALL, ODD)


def _names(*valid: str) -> tuple[tuple[str, ...], ...]:
    return valid, (valid[0].upper(), valid[0] + "s", valid[-1][:-1]), ("unknown", "ring,ring", "0"), ODD


POLICY = _names("random-walk", "a-cmommt", "centroid", "stationary", "evolved")
AWARENESS = _names("ring", "none", "nearest", "pairwise", "shared", "relayed")
PRESET = _names("touzet2000", "touzet2000")
REWARD = _names("own", "team", "alone", "keep", "interaction")
LEARNERS = _names("linear", "tabular", "lazy", "pessimistic", "sheppard")
SEVERAL = _names("linear", "linear,tabular", "linear, linear", ",")
PATH = (PATHS, PATHS, PATHS, ODD)
WORKERS = (("1",), HUGE, SMALL, ("200", "1000000", "x", "1.5"))
STEPS = (("1", "2", "5"), (*HUGE, "1000000000", "1000000000000"), SMALL, ODD)

#: What every line of a command begins with, so that whatever else is chosen stays small.
BASE = {
    ("run",): ["--steps", "3", "--robots", "2", "--targets", "2"],
    ("delta",): ["--steps", "3", "--robots", "3", "--targets", "2", "--runs", "3"],
    ("reproduce",): ["--steps", "2", "--runs", "1", "--workers", "1", "--quick"],
    ("learn", "explore"): ["--steps", "3", "--robots", "2", "--targets", "2"],
    ("learn", "evaluate"): ["--steps", "2", "--runs", "1", "--targets", "2", "--learner", "linear"],
    ("learn", "figure"): ["--samples", "4,6", "--memories", "1", "--worlds", "1", "--steps", "2", "--robots", "2",
                          "--workers", "1", "--learners", "linear"],
    ("learn", "diagnose"): ["--samples", "4,6", "--k", "3", "--memories", "1", "--workers", "1", "--learners", "lazy"],
}  # fmt: skip
FLAGS = {
    ("run",): ["--force", "--events"], ("delta",): ["--force", "--sort"], ("reproduce",): ["--quick", "--force"],
    ("learn", "explore"): ["--append", "--force"], ("learn", "evaluate"): ["--force"], ("learn", "figure"): ["--quick", "--force"],
    ("learn", "diagnose"): ["--force"],
}  # fmt: skip
OPTIONS = {
    ("run",): {
        "--robots": COUNT, "--targets": COUNT, "--radius": LENGTH, "--policy": POLICY, "--awareness": AWARENESS, "--delta": COUNT,
        "--awareness-range": LENGTH, "--steps": STEPS, "--seed": SEED, "--preset": PRESET, "--save": PATH, "--save-events": PATH,
        "--failures": LENGTH, "--repair": LENGTH,
    },
    ("delta",): {
        "--robots": COUNT, "--targets": COUNT, "--radius": LENGTH, "--policy": POLICY, "--preset": PRESET, "--awareness-range": LENGTH,
        "--risk": (("0.5", "0.9", "1"), HUGE, (*SMALL, "1e-12"), ODD), "--runs": (("1", "3"), (*HUGE, "1000000000"), SMALL, ODD),
        "--steps": STEPS, "--seed": SEED, "--trajectories": (TRAJECTORIES,), "--window": LENGTH, "--out": PATH,
    },
    ("reproduce",): {
        "--out": PATH, "--runs": (("1",), (*HUGE, "100000"), SMALL, ODD), "--steps": STEPS, "--workers": WORKERS, "--seed": SEED,
        "--preset": _names("defaults", "touzet2000"),
    },
    ("learn", "explore"): {
        "--out": PATH, "--robots": COUNT, "--targets": COUNT, "--radius": LENGTH, "--steps": STEPS, "--runs": COUNT,
        "--awareness": AWARENESS, "--delta": COUNT, "--policy": POLICY, "--distance": _names("random", "full"), "--robot-speed": LENGTH,
        "--seed": SEED, "--workers": WORKERS, "--merge": (MEMORIES, ODD_MEMORIES),
    },
    ("learn", "evaluate"): {
        "--learner": LEARNERS, "--reward": REWARD, "--k": COUNT, "--discount": SHARE, "--robots": COUNT, "--targets": COUNT,
        "--radius": LENGTH, "--runs": COUNT, "--steps": STEPS, "--seed": SEED, "--workers": WORKERS, "--sample": COUNT, "--save": PATH,
    },
    ("learn", "figure"): {
        "--out": PATH, "--learners": SEVERAL, "--samples": (("4", "4,5", "6, 4"), ("10000000000000", "1e9"), ("0", "-1,4", ","), ODD),
        "--memories": COUNT, "--worlds": COUNT, "--reward": REWARD, "--k": COUNT, "--discount": SHARE, "--robots": COUNT,
        "--targets": COUNT, "--radius": LENGTH, "--steps": STEPS, "--seed": SEED, "--workers": WORKERS,
    },
    ("learn", "diagnose"): {
        "--out": PATH, "--learners": SEVERAL, "--samples": (("4", "4,5", "6, 4"), ("10000000000000", "1e9"), ("0", "-1,4", ","), ODD),
        "--memories": COUNT, "--reward": REWARD, "--k": COUNT, "--discount": SHARE, "--seed": SEED, "--workers": WORKERS,
    },
}  # fmt: skip
_WRONG = (
    [], ["--help"], ["--version"], ["lern"], ["learn"], ["learn", "explor"], ["run", "--robot"], ["run", "run"], ["run", "--steps"],
    ["--nothing"], [""], ["run", "-h", "x"], ["learn", "explore"], ["learn", "evaluate"], ["delta", "x" * 3000], ["reproduce", *"y" * 500],
    ["\udcff"], ["run", "--save"], ["learn", "figure", "--help"], ["run", *["--seed", "1"] * 200],
    ["calibrate", "modl"], ["calibrate", "--workers", "0"], ["evolve"], ["evolve", "trian"],
    ["evolve", "train", "--generations", "0"], ["evolve", "train", "--population", "1"], ["evolve", "test", "--runs", "1e9"], ["evolve", "test", "--out", ""],
)  # fmt: skip
_ARGUMENTS = {
    ("reproduce",): (["2"], ["2"], ["2", "2"], ["0"], ["ledgr"], ["2 "], ["\udcff"], ["z" * 3000], ["2", "12"]),
    ("learn", "evaluate"): tuple([name] for name in (*MEMORIES, *ODD_MEMORIES)),
}


def command_line(noise: random.Random) -> list[str]:
    """Return the arguments of one command; most have a few options, of which most are valid."""
    if noise.random() < 0.03:
        return list(noise.choice(_WRONG))
    # Drawing takes longest.
    command = noise.choices(list(OPTIONS), [1 if "--learners" in options or "--quick" in BASE[c] else 3 for c, options in OPTIONS.items()])[0]
    line = [*command]
    if command in _ARGUMENTS:
        valid = noise.random() < 0.7
        line += _ARGUMENTS[command][0] if valid else noise.choice(_ARGUMENTS[command])
    options = dict(OPTIONS[command])
    if command != ("delta",) or noise.random() < 0.7:
        line += BASE[command]
        options.pop("--trajectories", None)
    else:
        line += ["--trajectories", noise.choice(TRAJECTORIES), "--awareness-range", "1", *noise.choice(([], ["--window", "5"]))]
    if command == ("learn", "explore") or noise.random() < 0.3:
        where = next(name for name in ("--out", "--save") if name in options)
        line += [where, noise.choice(PATHS)]
    # What is chosen later wins, as in a shell's line.
    for name in noise.sample(sorted(options), noise.choice((0, 1, 1, 2, 2, 3))):
        value = noise.choice(options[name][0] if noise.random() < 0.45 else noise.choice(options[name]))
        line += [f"{name}={value}"] if noise.random() < 0.2 else [name, value]
    line += [flag for flag in FLAGS[command] if noise.random() < 0.15]
    # Without a figure, all of them would be drawn.
    if noise.random() < 0.03 and command != ("reproduce",):
        line.pop(noise.randrange(len(line)))
    return line
