"""What all commands share: options that are texts, and groups that suggest the nearest command."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import click

F = TypeVar("F", bound=Callable[..., Any])


class Commands(click.Group):
    """A group that suggests the nearest command for one that it does not know."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if not args:
            # To ask for nothing is to ask what there is, and no mistake.
            click.echo(ctx.get_help())
            ctx.exit()
        return super().parse_args(ctx, args)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        from teamsight.core import checks

        return super().get_command(ctx, checks.choice("command", cmd_name, self.commands))


def text(*names: str, default: Any = None, metavar: str = "TEXT", **kwargs: Any) -> Callable[[F], F]:
    """Return an option whose text is checked by the command's settings, which report all that is wrong at once."""
    if default is not None:
        kwargs["default"] = str(default)
    return click.option(*names, metavar=metavar, type=str, **kwargs)
