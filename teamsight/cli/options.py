"""Commands are made from components and functions: the fields of a component are the options of a command.

Nothing slow is imported here, so that ``--help`` answers at once.
"""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, replace
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self, TypeVar

import click
from click.shell_completion import CompletionItem

from teamsight.core import checks, references
from teamsight.core.component import USE, Allowed, Component, Declared, Flag, declared, number_in, of_name
from teamsight.core.registry import Registry

if TYPE_CHECKING:
    from teamsight.analysis.runs.executor import Executor

C = TypeVar("C", bound=Component)
S = TypeVar("S", bound="Options")

# An address, such as https://…; a scheme of one letter is a drive of Windows.
_ADDRESS = re.compile(r"^[A-Za-z][A-Za-z0-9+.-]+:/")
# Headings of the help for options of many commands, which are declared in several places; files have theirs by kind.
_SECTIONS = {
    name: section
    for section, names in {
        "Task": ("task", "set", "treatment", "preset"), "Runs": ("runs", "replicates", "steps", "seed", "workers"),
        "Files": ("force", "format", "append", "record_every"),
    }.items()
    for name in names
}  # fmt: skip
# The headings that stand behind the others, in this order.
_LAST = ("Task", "Runs", "Files", "Cluster", "Help")
# Longer than the first sentence of any help.
_SENTENCE = 400
# Where a command line keeps the options that its other options bring.
_FURTHER = "teamsight.further"
_METAVARS = {
    "integer": "INTEGER", "number": "NUMBER", "choice": "NAME", "component": "NAME", "mapping": "NAME=VALUE",
}  # fmt: skip


class InputError(Exception):
    """Everything that is wrong with the options of one command line."""

    def __init__(self, messages: Iterable[str]) -> None:
        self.messages = list(messages)
        super().__init__("; ".join(self.messages))


@dataclass(frozen=True, kw_only=True)
class Options(Component):
    """The options of one command line, checked.

    Attributes
    ----------
    given : frozenset of str
        The names of the options that were given.
    brought : mapping of str to object
        The values of options that other options bring; see `brings`.
    """

    given: frozenset[str] = field(default=frozenset(), init=False, repr=False, compare=False)
    brought: Mapping[str, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    @classmethod
    def options(cls) -> dict[str, Declared]:
        """Return the options by name; what can be given in Python only is none."""
        return {
            name: one
            for name, one in declared(cls).items()
            if one.kind != "object" or one.allowed.check is not None or one.allowed.parse is not None
        }

    @classmethod
    def brings(cls, arguments: Sequence[str]) -> Mapping[str, Declared]:
        """Return the options that those of a command line bring, as a policy brings its own."""
        return {}

    @classmethod
    def read(cls, texts: Mapping[str, Any], further: Mapping[str, Declared]) -> Self:
        """Return the options for the texts of a command line.

        Parameters
        ----------
        texts : mapping of str to object
            The text of each option; None, False or empty where it was not given.
        further : mapping of str to Declared
            The options that others bring.

        Raises
        ------
        InputError
            With one message for each option that is wrong; `check` runs only if all are right.
        """
        values, messages = cls.values_in(texts, further)
        if messages:
            raise InputError(messages)
        made = cls(**{name: value for name, value in values.items() if name not in further})
        object.__setattr__(made, "given", frozenset(values))
        object.__setattr__(made, "brought", {name: value for name, value in values.items() if name in further})
        # Each class of options checks its own.
        for one in cls.__mro__[::-1]:
            if (check := vars(one).get("check")) is not None:
                check(made)
        return made

    @classmethod
    def values_in(cls, texts: Mapping[str, Any], further: Mapping[str, Declared]) -> tuple[dict[str, Any], list[str]]:
        """Return the value of each option that was given, and one message for each that is wrong."""
        values, messages = {}, []
        for name, one in {**cls.options(), **further}.items():
            if (text := texts.get(name)) in (None, (), [], False):
                continue
            try:
                if not _is_many(one) and isinstance(text, (tuple, list)):
                    if len(text) > 1:
                        shown = " and ".join(f"--{flag(name)} {part}" for part in text)
                        raise ValueError(f"{name}: is given {len(text)} times, as {shown}; leave all but one out")
                    (text,) = text
                values[name] = one.parsed(text)
            except (TypeError, ValueError) as error:
                messages.append(str(error))
        return values, messages

    def check(self) -> None:
        """Check what several options must satisfy together.

        Raises
        ------
        ValueError, TypeError
            Naming the values, the limit and the cure.
        """

    def values(self, names: Collection[str] = (), *, without: Collection[str] = ()) -> dict[str, Any]:
        """Return options by name, except those that are None.

        Parameters
        ----------
        names : collection of str
            Which; all where none are named.
        without : collection of str
            Which are left out.
        """
        chosen = [name for name in self.options() if (not names or name in names) and name not in without]
        return {name: value for name in chosen if (value := getattr(self, name)) is not None}

    def part(self, kind: type[C]) -> C:
        """Return the component of a kind whose fields are among these options."""
        return kind(**{name: getattr(self, name) for name in declared(kind)})

    def refuse(self, names: Iterable[str], why: str) -> None:
        """Refuse options that were given, although something else stands against them.

        Raises
        ------
        ValueError
            With the first of them, its value and `why`.
        """
        for name in names:
            if name in self.given:
                value = getattr(self, name)
                shown = ",".join(map(str, value)) if isinstance(value, (tuple, Mapping)) else value
                cure = ", or" if "; give " in why else ";"
                raise ValueError(f"{name}={shown}: {why}{cure} leave --{flag(name)} out")


def path(name: str, given: str | os.PathLike[str], wanted: str) -> Path:
    """Return the path of a file or of a folder.

    Parameters
    ----------
    name : str
        What the error calls it.
    given : str or PathLike
        The path as it was given.
    wanted : {"a file", "a folder"}
        What it must be able to be.

    Raises
    ------
    ValueError
        If it cannot be such a path.
    """
    text = os.fspath(given)
    if not text.strip():
        raise ValueError(f"{name}={checks.shown(text)}: is empty; give {wanted}")
    if "\0" in text:
        raise ValueError(f"{name}={checks.shown(text)}: contains a null character; give {wanted}")
    if _ADDRESS.match(text):
        raise ValueError(f"{name}={checks.shown(text)}: is an address; give {wanted} on this machine")
    # Shells expand "~" neither in quotes nor behind "=".
    expanded = os.path.expanduser(text)
    if expanded.startswith("~"):
        raise ValueError(f"{name}={checks.shown(text)}: there is no such user; write ./~ for a name that begins so")
    if wanted == "a file" and os.path.basename(text) in ("", ".", ".."):
        raise ValueError(f"{name}={checks.shown(text)}: is a folder; give a file")
    found = Path(expanded)
    # pathlib drops the "./" of "./~", and the result would be expanded again.
    return found.absolute() if os.fspath(found).startswith("~") else found


def check_apart(option: str, path: Path, name: str, read: Path) -> None:
    """Refuse to overwrite a file that the command reads, even with ``--force``.

    Parameters
    ----------
    option, path : str, Path
        The option that names the output, and a file that would be written.
    name, read : str, Path
        What the file that is read is called, and its path.

    Raises
    ------
    ValueError
        If both are the same file.
    """
    with contextlib.suppress(OSError):  # one of them does not exist
        if os.path.samefile(path, read):
            raise ValueError(f"{option}={path}: is the {name} file, which would be overwritten; give another place")


def _workers(name: str, value: Any) -> int:
    from teamsight.analysis.runs.processes import check_workers

    return check_workers(value)


def _shard(name: str, given: Any) -> tuple[int, int]:
    """Return one part of several equal ones, as in 1/8."""
    first, _, second = given.partition("/") if isinstance(given, str) else (given[0], "/", given[1])
    try:
        count = checks.count(name, number_in(second))
        return checks.count(name, number_in(first), most=count), count
    except (TypeError, ValueError):
        raise ValueError(
            f"{name}={checks.shown(given)}: must be i/n with i from 1 to n; give, for example, 1/8"
        ) from None


def names_in(reference: str) -> Allowed:
    """Return that the names in a registry are allowed, which is imported when they are asked for."""
    return Allowed(choices=lambda: resolve_name(reference))


WORKERS = Allowed(least=1, check=_workers, shown="number of cores")
_FILE, _FOLDER = (partial(path, wanted=kind) for kind in ("a file", "a folder"))
File = Annotated[Path, Allowed(check=_FILE, metavar="FILE", section="Files")]
Folder = Annotated[Path, Allowed(check=_FOLDER, metavar="FOLDER", section="Files")]
StudyFile = Annotated[Path, Allowed(check=_FILE, metavar="STUDY", is_argument=True)]
StudyFolder = Annotated[Path, Allowed(check=_FOLDER, metavar="DIR", is_argument=True)]
Shard = Annotated[tuple[int, int] | None, Allowed(check=_shard, parse=str, metavar="I/N", shown="all")]
Format = Annotated[str, names_in("teamsight.analysis.plot.style:FORMATS")]
TaskName = Annotated[str, names_in("teamsight.tasks.registry:TASKS")]
_CLUSTER = Allowed(section="Cluster")
_OF_DASK = ("scheduler", "tls_ca", "tls_cert", "tls_key")
#: Agents of one kind: any two of them may be neighbours.
Agents = Annotated[int, Allowed(least=1, most=1_000_000)]
#: A smaller risk would need by far more runs than a command may make.
Risk = Annotated[float, Allowed(least=1e-9, most=1)]


@dataclass(frozen=True, kw_only=True)
class Works(Options):
    """Options of commands that make runs.

    Parameters
    ----------
    workers : int, optional
        Number of worker processes. The results do not depend on it.
    engine : {"local", "dask"}
        What makes the runs. The results do not depend on it.
    scheduler : str, optional
        Address of a Dask scheduler, such as tcp://10.0.0.1:8786.
    tls_ca : Path, optional
        Certificate authority of the Dask cluster.
    tls_cert : Path, optional
        Certificate for the Dask cluster.
    tls_key : Path, optional
        Private key of the certificate.
    """

    workers: Annotated[int | None, WORKERS] = None
    engine: Annotated[Literal["local", "dask"], _CLUSTER] = "local"
    scheduler: Annotated[str | None, _CLUSTER, Allowed(metavar="ADDRESS", shown="a cluster on this machine")] = None
    tls_ca: Annotated[File | None, Allowed(section="Cluster", shown="no TLS")] = None
    tls_cert: Annotated[File | None, Allowed(section="Cluster", shown="no TLS")] = None
    tls_key: Annotated[File | None, Allowed(section="Cluster", shown="no TLS")] = None

    def check(self) -> None:
        """Refuse options of Dask without it, and workers that a scheduler has already."""
        if self.engine != "dask":
            self.refuse(_OF_DASK, "is for Dask; give --engine dask")
        if "scheduler" in self.given:
            self.refuse(("workers",), "the scheduler has its own workers")

    @contextlib.contextmanager
    def executor(self) -> Iterator[Executor | None]:
        """Start the Dask cluster that makes the runs, or connect to it; None without Dask."""
        if self.engine == "local":
            yield None
            return
        from teamsight.analysis.runs.dask import DaskExecutor
        from teamsight.analysis.runs.processes import cores

        tls = {name: place for name in _OF_DASK[1:] if (place := getattr(self, name)) is not None}
        with DaskExecutor(self.scheduler, self.workers or cores(), **tls) as executor:
            yield executor


@dataclass(frozen=True, kw_only=True)
class Divides(Works):
    """Options of commands that keep what is finished, so that several machines can share the work.

    Parameters
    ----------
    shard : (int, int), optional
        Make part i of n parts of the runs only, as in 1/8, and keep it in the folder of the results: for a job array.
    """

    shard: Annotated[Shard, _CLUSTER] = None


@dataclass(frozen=True, kw_only=True)
class Writes(Options):
    """Options of commands that write files.

    Parameters
    ----------
    force : bool
        Overwrite files that teamsight did not write, and results of other settings.
    """

    force: Flag = False


def flag(name: str) -> str:
    """Return the name of an option as it stands on a command line."""
    return name.replace("_", "-")


def _is_many(one: Declared) -> bool:
    """Return whether an option may be given several times."""
    return bool(one.allowed.is_repeated or one.kind == "mapping")


def help_of(one: Declared) -> str:
    """Return what the help says of an option, with the names that may be given."""
    text = one.meaning.replace("`", "")
    of = one.item or one
    names = list(of.choices) if of.kind in ("choice", "component") else []
    return f"{text} One of {', '.join(names)}." if names else text


def default_of(one: Declared) -> str:
    """Return the default as the help shows it, or an empty text where there is none."""
    default = one.default
    if one.allowed.shown or default is None or default is MISSING or default is False or default in ((), {}):
        return one.allowed.shown
    if default is True:
        return "true"
    if isinstance(default, tuple):
        return ",".join(f"{part:g}" if isinstance(part, float) else str(part) for part in default)
    return f"{default:g}" if isinstance(default, float) else str(default)


def metavar_of(one: Declared) -> str:
    """Return what stands in the help for the value of an option."""
    if given := one.allowed.metavar or (one.item.allowed.metavar if one.item else ""):
        return given
    if one.item is not None:
        return "NUMBERS" if one.item.kind in ("integer", "number") else "NAMES"
    return _METAVARS.get(one.kind, "TEXT")


class _Argument(click.Argument):
    """An argument of click that has a help, as an option has."""

    def __init__(self, declarations: list[str], declared: Declared, **more: Any) -> None:
        super().__init__(declarations, **more)
        self.declared = declared

    def get_help_record(self, ctx: click.Context) -> tuple[str, str]:
        default = default_of(self.declared)
        return self.make_metavar(ctx), help_of(self.declared) + (f"  [default: {default}]" if default else "")


class _Option(click.Option):
    """An option of click whose help is made when it is shown, since names may have to be imported."""

    def __init__(self, declarations: list[str], declared: Declared, **more: Any) -> None:
        super().__init__(declarations, **more)
        self.declared = declared

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        record = super().get_help_record(ctx)
        if record is None:
            return None
        default, unit = default_of(self.declared), self.declared.allowed.unit
        notes = "; ".join(filter(None, ("required" * self.required, unit, default and f"default: {default}")))
        return record[0], help_of(self.declared) + (f"  [{notes}]" if notes else "")

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Return the names that an option takes, or what stands for files and folders."""
        one = self.declared.item or self.declared
        if kind := {"FILE": "file", "FOLDER": "dir"}.get(metavar_of(one)):
            return [CompletionItem(incomplete, type=kind)]
        names = one.choices if one.kind in ("choice", "component") else ()
        # Of a list, what follows the last comma.
        before, comma, last = incomplete.rpartition(",") if self.declared.item else ("", "", incomplete)
        return [CompletionItem(f"{before}{comma}{name}") for name in names if name.startswith(last)]


def parameter_of(one: Declared) -> click.Parameter:
    """Return the parameter of click; `Options.read` checks its text, and reports all errors at once."""
    name, required = one.name.replace(".", "__"), one.default is MISSING
    if one.allowed.is_argument:
        return _Argument([name], one, nargs=-1 if _is_many(one) else 1, required=required, metavar=metavar_of(one))
    names = [name, f"--{flag(one.name)}"]
    if one.kind == "flag":
        # One that is on by default is set by name: --copy false.
        return _Option(names, one, is_flag=True) if not one.default else _Option(names, one, metavar="true|false")
    # One that is given twice is refused, not dropped.
    return _Option(names, one, metavar=metavar_of(one), required=required, multiple=True)


def _section_of(one: click.Parameter) -> str:
    """Return the heading of the help under which a parameter stands."""
    if isinstance(one, _Argument):
        return "Arguments"
    if not isinstance(one, _Option):
        return "Help"
    return _SECTIONS.get(one.declared.name) or one.declared.allowed.section or "Options"


class Command(click.Command):
    """A command that is made of a function and the component of its options.

    Parameters
    ----------
    work : callable
        What the command does; its name is the command's name, and its docstring the help. It returns the exit status,
        or None for 0.
    settings : type
        The command's options.
    section : str
        Under which heading the help of the group lists it.
    """

    def __init__(self, work: Callable[[S], int | None], settings: type[S], section: str = "") -> None:
        super().__init__(
            work.__name__,
            callback=self._call,
            params=[parameter_of(one) for one in settings.options().values()],
            help=work.__doc__,
            short_help=(work.__doc__ or "").partition("\n")[0],
        )
        self.settings: type[Options] = settings
        self.section, self._work = section, work

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if any(references.is_reference(text.rpartition("=")[2]) for text in args):
            # Of a program that is installed, unlike of python -m, Python does not search that folder.
            references.search_in([os.getcwd()])
        args = [references.from_file(text) for text in args]
        ctx.meta[_FURTHER] = self.settings.brings(args)
        given = list(args)
        try:
            return super().parse_args(ctx, args)
        except click.UsageError as error:
            # What else is wrong comes first: an option is unknown because the task that brings it is.
            reason, known = usage(error), self.settings.options()
            # The world of such a command is that of a task alone.
            needs_task = "task" in known and "robots" not in known and not options_in(given, "task")
            if needs_task and isinstance(error, click.NoSuchOption):
                reason += "; with --task NAME, the parameters of the task are options too"
            raise InputError([*self._wrong_in(ctx, given), reason]) from error

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        sections: dict[str, list[tuple[str, str]]] = {}
        for one in self.get_params(ctx):
            if (record := one.get_help_record(ctx)) is not None:
                sections.setdefault(_section_of(one), []).append(record)
        for section in sorted(sections, key=lambda name: _LAST.index(name) if name in _LAST else -1):
            with formatter.section(section):
                formatter.write_dl(sections[section])

    def _wrong_in(self, ctx: click.Context, arguments: list[str]) -> list[str]:
        """Return what is wrong with the options that a command line gives, although others are missing or unknown."""
        ctx.ignore_unknown_options = ctx.allow_extra_args = True
        try:
            texts, _, _ = self.make_parser(ctx).parse_args(arguments)
        except click.UsageError:  # an option without its value
            return []
        named = {one.name for one in self.params if isinstance(one, click.Argument)}
        given = {name.replace("__", "."): text for name, text in texts.items() if name not in named}
        return self.settings.values_in(given, ctx.meta[_FURTHER])[1]

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        *own, last = super().get_params(ctx)
        return [*own, *map(parameter_of, ctx.meta.get(_FURTHER, {}).values()), last]

    def _call(self, **texts: Any) -> int | None:
        further = click.get_current_context().meta.get(_FURTHER, {})
        given = {name.replace("__", "."): text for name, text in texts.items()}
        work: Any = self._work
        status: int | None = work(self.settings.read(given, further))
        return status


def usage(error: click.ClickException) -> str:
    """Return what click says of a command line, and where to look."""
    context = error.ctx if isinstance(error, click.UsageError) else None
    return error.format_message().rstrip(".") + (f"; see {context.command_path} --help" if context else "")


class LazyCommands(Mapping[str, click.Command]):
    """The commands of a group; each is made, and its file imported, when it is asked for.

    Parameters
    ----------
    names : collection of str
        Their names, in the order of the help.
    make : callable
        Returns the command of a name.
    """

    def __init__(self, names: Collection[str], make: Callable[[str], click.Command]) -> None:
        self._names, self._make = names, make

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __getitem__(self, name: str) -> click.Command:
        if name not in self._names:
            raise KeyError(name)
        return self._make(name)


@cache
def command_in(place: str, section: str = "") -> click.Command:
    """Return the command of a function, as in ``look.run``, whose parameter is annotated with its options.

    Parameters
    ----------
    place : str
        The module in `teamsight.cli`, and the function or a command that is made there.
    section : str
        As of `Command`.
    """
    name, _, function = place.rpartition(".")
    module = import_module(f"teamsight.cli.{name}")
    work = getattr(module, function)
    if isinstance(work, click.Command):
        return work
    return Command(work, getattr(module, work.__annotations__["settings"]), section)


class Group(click.Group):
    """A group of commands that suggests the nearest command for an unknown name.

    Parameters
    ----------
    *given, **further
        The parameters of `click.Group`.
    alone : str, optional
        What the group prints where no command is given; by default its help.
    section : str
        As of `Command`.
    made : mapping of str to Command
        Its commands.
    """

    def __init__(
        self, *given: Any, made: Mapping[str, click.Command], alone: str = "", section: str = "", **further: Any
    ) -> None:
        super().__init__(*given, **further)
        self.commands: Any = made
        self._alone, self.section = alone, section

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if not args and not ctx.resilient_parsing:  # as where a shell completes the name of a command
            # That is no error.
            click.echo(self._alone or ctx.get_help())
            ctx.exit()
        return super().parse_args(ctx, args)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        return super().get_command(ctx, checks.choice("command", cmd_name, self.commands))

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        sections: dict[str, list[tuple[str, str]]] = {}
        for name, command in self.commands.items():
            # The first sentence, whole.
            row = name, command.get_short_help_str(_SENTENCE)
            sections.setdefault(getattr(command, "section", ""), []).append(row)
        for section, rows in sections.items():
            with formatter.section(section or "Commands"):
                formatter.write_dl(rows)


def options_in(arguments: Sequence[str], name: str) -> list[str]:
    """Return the values that a command line gives to an option, before it is parsed."""
    found, wanted = [], f"--{flag(name)}"
    for place, text in enumerate(arguments):
        if text.startswith(f"{wanted}="):
            found.append(text.partition("=")[2])
        elif text == wanted and place + 1 < len(arguments):
            found.append(arguments[place + 1])
    return found


def component_options(options: Mapping[str, Declared], arguments: Sequence[str]) -> dict[str, Declared]:
    """Return the options of the components that a command line names: ``--policy.gain`` is that of a policy.

    A component is imported only if one of its options, or the help, is asked for.

    Raises
    ------
    ValueError
        If there is no component of this name.
    """
    found: dict[str, Declared] = {}
    for name, one in options.items():
        asks = any(text.startswith(f"--{flag(name)}.") for text in arguments)
        named = options_in(arguments, name)
        chosen = named[-1] if named else one.default
        is_known = isinstance(chosen, str) and isinstance(one.choices, Registry)
        if is_known and (asks or (named and {"-h", "--help"} & set(arguments))):
            owner = of_name(one, chosen)
            own: dict[str, Declared] = {}
            # A task is made already.
            for option, of in declared(owner).items() if callable(owner) else ():
                if of.kind != "object" or of.allowed.check is not None or of.allowed.parse is not None:
                    # A component stays a name until it is made with its own options.
                    check = None if of.kind == "component" else of.allowed.check
                    allowed = replace(of.allowed, section=f"{flag(name).capitalize()} {chosen}", check=check)
                    own[f"{name}.{option}"] = replace(of, name=f"{name}.{option}", allowed=allowed)
            found |= own | component_options(own, arguments)
    return found


def made_of(one: Declared, value: Any) -> Any:
    """Return the value of an option; one that is a component with options, `with_tables`, is made."""
    if not (isinstance(value, Mapping) and USE in value):
        return value
    owner = of_name(one, value[USE])
    known = declared(owner)
    return owner(**{name: made_of(known[name], its) for name, its in value.items() if name != USE})
