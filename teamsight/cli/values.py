"""Kinds of options: each function declares one option, see `teamsight.cli.options.Option`.

They are typed as returning Any, so that a settings class can annotate the attribute with the type of the value.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from importlib import import_module
from typing import Any

from teamsight.analysis.runs.limits import MOST_RUNS, MOST_STEPS
from teamsight.cli import limits, paths
from teamsight.cli.options import Option
from teamsight.core import checks
from teamsight.world import limits as world_limits

# Python takes long to read longer numbers, or refuses them.
_LONGEST_NUMBER = 500
_TRUTH = {"true": True, "false": False}
_file = partial(paths.path, wanted="a file")
_folder = partial(paths.path, wanted="a folder")


def number_in(text: Any) -> Any:
    """Return the number that a text spells, or the text itself, which the check then refuses."""
    if not isinstance(text, str) or len(text) > _LONGEST_NUMBER:
        return text
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def _numeric(check: Callable[[str, Any], Any]) -> Callable[[str, Any], Any]:
    return lambda name, text: check(name, number_in(text))


def count(
    default: int | None, help: str, *, least: int = 1, most: int | None = None, cure: str = "", shown: str = ""
) -> Any:
    """Declare a whole number of at least `least` and at most `most`."""
    check = partial(checks.count, least=least, most=most, cure=cure)
    return Option(_numeric(check), default, help, "INTEGER", shown)


def number(default: float | None, help: str, *, least: float, most: float, shown: str = "") -> Any:
    """Declare a finite number of at least `least` and at most `most`."""
    return Option(_numeric(partial(checks.number, least=least, most=most)), default, help, "NUMBER", shown)


def counts(default: tuple[int, ...], help: str, *, most: int, shown: str = "", sort: bool = True) -> Any:
    """Declare up to `most` different whole numbers above 0, with commas between them; they are sorted if asked for."""

    def check(name: str, text: str) -> tuple[int, ...]:
        try:
            found = dict.fromkeys(checks.count(name, number_in(part)) for part in text.split(","))
        except TypeError:
            raise ValueError(f"{name}={checks.shown(text)}: must be whole numbers, as in 150,600") from None
        if len(found) > most:
            raise ValueError(f"{name}: are {len(found)} numbers, at most {most}; leave some out")
        return tuple(sorted(found) if sort else found)

    return Option(check, default, help, "NUMBERS", shown or ",".join(map(str, default)))


def length(default: float, help: str) -> Any:
    """Declare a length or a speed, in the unit of the model."""
    return Option(_numeric(world_limits.length), default, help, "NUMBER")


def duration(help: str, shown: str) -> Any:
    """Declare a mean time [ticks] without a default."""
    return Option(_numeric(partial(checks.number, above=0.0)), None, help, "NUMBER", shown)


def agents(default: int | None, help: str, shown: str = "") -> Any:
    """Declare a number of robots or targets."""
    return count(default, help, most=limits.MOST_AGENTS, shown=shown)


def runs(default: int | None, help: str, shown: str = "") -> Any:
    """Declare a number of runs, worlds or memories."""
    return count(default, help, most=MOST_RUNS, shown=shown)


def period(default: float, help: str) -> Any:
    """Declare a period of robots [steps]."""
    return number(default, help, least=1, most=MOST_STEPS)


def steps(default: int | None, help: str = "Number of steps of each run.", shown: str = "") -> Any:
    """Declare a number of steps."""

    def check(name: str, value: Any) -> int:
        checks.count(name, value)  # the cure of too many is none of too few
        return checks.count(name, value, most=MOST_STEPS, cure="give fewer steps, or make more runs with other seeds")

    return Option(_numeric(check), default, help, "INTEGER", shown)


def seed(default: int, help: str, shown: str = "") -> Any:
    """Declare a seed."""
    return count(default, help, least=0, most=checks.MOST_SEED, shown=shown)


def workers(shown: str = "number of cores") -> Any:
    """Declare the number of worker processes; None stands for what is shown as the default."""

    def check(name: str, number: Any) -> int:
        from teamsight.analysis.runs.workers import check_workers

        return check_workers(number)

    help = "Number of worker processes. The results do not depend on it."
    return Option(_numeric(check), None, help, "INTEGER", shown)


def choice(
    default: str | None, help: str, names: Callable[[], Iterable[str]], more: tuple[str, ...] = (), shown: str = ""
) -> Any:
    """Declare one of some names; ``{names}`` in the help does not list `more`."""
    return Option(
        # A registry itself also knows the names of plug-ins.
        lambda name, text: checks.choice(name, text, (*names(), *more) if more else names()),
        default, help, "NAME", shown, names=names,
    )  # fmt: skip


def choices(default: tuple[str, ...], help: str, names: Callable[[], Iterable[str]], called: str) -> Any:
    """Declare several of some names, with commas between them; an error calls one of them `called`."""

    def check(name: str, text: str) -> tuple[str, ...]:
        return _distinct(called, (part.strip() for part in text.split(",")), names)

    return Option(check, default, help, "NAMES", ",".join(default), names=names)


def _distinct(called: str, texts: Iterable[str], names: Callable[[], Iterable[str]]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(checks.choice(called, text, names()) for text in texts))


def argument(metavar: str, names: Callable[[], Iterable[str]], *, many: bool = False) -> Any:
    """Declare an argument that is one of some names, or, if `many`, any number of them."""

    def check(name: str, given: Any) -> Any:
        chosen = _distinct(metavar.lower(), given if many else (given,), names)
        return chosen if many else chosen[0]

    default, shown = ((), f"[{metavar}]...") if many else (None, metavar)
    return Option(check, default, "", shown, kind="argument", many=many, required=not many)


def file(help: str, *, metavar: str = "FILE", many: bool = False, shown: str = "", **how: Any) -> Any:
    """Declare a file to read or to write, without a default; `how` is passed on to `Option`."""

    def check(name: str, text: Any) -> Any:
        return tuple(_file(name, one) for one in text) if many else _file(name, text)

    return Option(check, () if many else None, help, metavar, shown, many=many, **how)


def folder(default: Any, help: str, *, required: bool = False, shown: str = "") -> Any:
    """Declare a folder."""
    return Option(_folder, default, help, "FOLDER", shown, required=required)


def input_file(metavar: str, *, required: bool = True) -> Any:
    """Declare an argument that is a file to read."""
    return Option(_file, None, "", metavar if required else f"[{metavar}]", kind="argument", required=required)


def input_folder(metavar: str) -> Any:
    """Declare an argument that is a folder."""
    return Option(_folder, None, "", metavar, kind="argument", required=True)


def word(metavar: str) -> Any:
    """Declare an argument that is a text."""
    return Option(lambda name, given: given, None, "", metavar, kind="argument", required=True)


def text(help: str, shown: str, *, metavar: str = "TEXT") -> Any:
    """Declare a text without a default."""
    return Option(lambda name, given: given, None, help, metavar, shown)


def word_option(default: str, help: str, *, metavar: str = "TEXT") -> Any:
    """Declare a text with a default."""
    return Option(lambda name, given: given, default, help, metavar)


def assignments(help: str, *, dotted: bool = False) -> Any:
    """Declare parameters of a model by name, each as NAME=VALUE; values are numbers, true, false or texts.

    Parameters
    ----------
    help : str
        The text of the help.
    dotted : bool
        Whether a name may have two parts with a dot between them, as in forage.side.
    """

    def check(name: str, given: Iterable[str]) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for text in given:
            parameter, equals, value = text.partition("=")
            parts = parameter.split(".")
            if not equals or len(parts) > 1 + dotted or not all(map(str.isidentifier, parts)):
                raise ValueError(f"{name}={checks.shown(text)}: must be NAME=VALUE, as in policy=centroid")
            if parameter in found:
                raise ValueError(f"{name}={checks.shown(text)}: is given twice; leave one out")
            found[parameter] = _TRUTH.get(value, number_in(value))
        return found

    return Option(check, {}, help, "NAME=VALUE", "none", many=True)


def shard(help: str, shown: str) -> Any:
    """Declare one part of several equal ones, as in 1/8."""

    def check(name: str, given: str) -> tuple[int, int]:
        first, slash, second = given.partition("/")
        try:
            count = checks.count(name, number_in(second))
            part = checks.count(name, number_in(first), most=count)
        except (TypeError, ValueError):
            slash = ""
        if not slash:
            raise ValueError(f"{name}={checks.shown(given)}: must be i/n with i from 1 to n; give, for example, 1/8")
        return part, count

    return Option(check, None, help, "I/N", shown)


def flag(help: str) -> Any:
    """Declare a switch that is off unless it is given."""
    return Option(lambda name, given: bool(given), False, help, kind="flag")


def force() -> Any:
    """Declare the switch that allows to overwrite other files."""
    return flag("Overwrite files that teamsight did not write, and results of other settings.")


def registry(module: str, name: str) -> Callable[[], Iterable[str]]:
    """Return a function that returns the names in a registry, imported when it is called."""
    return lambda: getattr(import_module(module), name)


POLICIES = registry("teamsight.policies.registry", "POLICIES")
DEGREES = registry("teamsight.agents.awareness.registry", "AWARENESS")
PRESETS = registry("teamsight.agents.settings", "PRESETS")
RANGE_SHAPES = registry("teamsight.world.limits", "SHAPES")
LEARNERS = registry("teamsight.analysis.learning.registry", "LEARNERS")
FORMATS = registry("teamsight.analysis.plot.style", "FORMATS")
REWARDS = registry("teamsight.analysis.learning.registry", "REWARDS")


def sectors(default: int) -> Any:
    """Declare δ, the number of sectors of a ring, or of teammates of a list."""
    help = f"Number δ of sectors of 'ring', or of teammates of 'nearest', at most {limits.MOST_SECTORS}."
    return count(default, help, most=limits.MOST_SECTORS)


def preset() -> Any:
    """Declare a preset by name."""
    return choice(None, "Settings for what the paper leaves open: {names}. See docs/calibration.md.", PRESETS)


def reward(default: str | None, shown: str = "") -> Any:
    """Declare a reward by name."""
    return choice(default, "Reward of a transition: {names}. See docs/learning.md.", REWARDS, shown=shown)


def matches() -> Any:
    """Declare k; None stands for the default of the learner."""
    return count(None, "Number k of nearest transitions that a learner uses.", shown="that of the learner")


def discount(default: float | None, shown: str = "") -> Any:
    """Declare the discount factor."""
    return number(default, "Discount factor γ, in [0, 1].", least=0.0, most=1.0, shown=shown)
