"""The declaration of commands: each option once, with its type, check, default and help.

A command's settings are a class whose attributes are options; `command` makes click's parameters from it. Nothing slow
is imported here, so that ``--help`` answers at once.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from typing import Any, TypeVar

import click

from teamsight.core import checks

S = TypeVar("S", bound="Settings")


class InputError(Exception):
    """Everything that is wrong with the options of one command line."""

    def __init__(self, messages: Iterable[str]) -> None:
        self.messages = list(messages)
        super().__init__("; ".join(self.messages))


@dataclass(frozen=True)
class Option:
    """One option or argument of a command."""

    check: Callable[[str, Any], Any]  # takes its name and text, returns its value, raises ValueError or TypeError
    default: Any  # the value where it is not given
    help: str  # one sentence; ``{names}`` stands for the names that may be given
    metavar: str = "TEXT"  # what stands for the value in the help
    shown: str = ""  # the default in the help, where it is not the value itself
    names: Callable[[], Iterable[str]] | None = None  # returns the names that may be given
    kind: str = "option"  # how it stands on the command line: as "option", "flag" or "argument"
    many: bool = False  # whether it may be given several times
    required: bool = False  # whether it must be given

    def help_text(self) -> str:
        """Return the help with the names that may be given."""
        return self.help.format(names=", ".join(self.names())) if self.names else self.help

    def default_text(self) -> str:
        """Return the default as the help shows it, or an empty text where there is none."""
        if self.shown or self.default is None or self.default == () or self.kind == "flag":
            return self.shown
        return f"{self.default:g}" if isinstance(self.default, float) else str(self.default)

    def parameter(self, name: str) -> click.Parameter:
        """Return the parameter of click; the text is checked by `Settings`, which reports all errors at once."""
        if self.kind == "argument":
            return click.Argument([name], nargs=-1 if self.many else 1, required=self.required, metavar=self.metavar)
        flag = "--" + name.replace("_", "-")
        if self.kind == "flag":
            return _Option([flag], declared=self, is_flag=True)
        return _Option([flag], declared=self, metavar=self.metavar, required=self.required, multiple=self.many)


class _Option(click.Option):
    """An option of click whose help is made when it is shown, since names may have to be imported."""

    def __init__(self, declarations: list[str], declared: Option, **further: Any) -> None:
        super().__init__(declarations, **further)
        self._declared = declared

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        record = super().get_help_record(ctx)
        if record is None:
            return None
        default = self._declared.default_text()
        extra = "  [required]" if self.required else f"  [default: {default}]" if default else ""
        return record[0], self._declared.help_text() + extra


class Settings:
    """The checked options of one command line, as attributes.

    Parameters
    ----------
    **texts
        The text of each option, or None where it was not given.

    Raises
    ------
    InputError
        With one message for each option that is wrong; `check` runs only if all options are right.
    """

    #: The names of the options that were given.
    given: frozenset[str]

    def __init__(self, **texts: Any) -> None:
        messages = []
        self.given = frozenset(name for name, text in texts.items() if text not in (None, (), False))
        for name, option in self.options().items():
            value = option.default
            if name in self.given:
                try:
                    value = option.check(name, texts[name])
                except (TypeError, ValueError) as error:
                    messages.append(str(error))
            setattr(self, name, value)
        if messages:
            raise InputError(messages)
        self.check()

    @classmethod
    def options(cls) -> dict[str, Option]:
        """Return the options by name, in the order of their declaration; those of a parent class come first."""
        declared = [item for one in reversed(cls.__mro__) for item in vars(one).items()]
        return {name: value for name, value in declared if isinstance(value, Option)}

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


class Group(click.Group):
    """A group of commands that suggests the nearest command for an unknown name.

    Parameters
    ----------
    *given, **further
        The parameters of `click.Group`.
    alone : str, optional
        What the group prints where no command is given; by default its help.
    """

    def __init__(self, *given: Any, alone: str = "", **further: Any) -> None:
        super().__init__(*given, **further)
        self._alone = alone

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if not args:
            # That is no error.
            click.echo(self._alone or ctx.get_help())
            ctx.exit()
        return super().parse_args(ctx, args)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        return super().get_command(ctx, checks.choice("command", cmd_name, self.commands))


def add_command(group: click.Group, work: Callable[[S], int | None], settings: type[S]) -> None:
    """Add a command to a group.

    Parameters
    ----------
    group : click.Group
        The group.
    work : callable
        What the command does; its name is the command's name, and its docstring the help. It returns the exit status,
        or None for 0.
    settings : type
        The command's options.
    """
    group.add_command(
        click.Command(
            work.__name__,
            callback=lambda **texts: work(settings(**texts)),
            params=[option.parameter(name) for name, option in settings.options().items()],
            help=work.__doc__,
            short_help=(work.__doc__ or "").partition("\n")[0],
        )
    )
