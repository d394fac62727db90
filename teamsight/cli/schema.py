"""``teamsight schema``: the JSON Schema of study files."""

from __future__ import annotations

from dataclasses import dataclass

from teamsight.cli.options import Options


@dataclass(frozen=True, kw_only=True)
class SchemaSettings(Options):
    """``teamsight schema`` has no options."""


def schema(settings: SchemaSettings) -> None:
    """Print the JSON Schema of study files, by which an editor completes and checks them.

    It has all keys with what they mean. An editor uses it for a study file whose first line is "#:schema FILE".

    \b
    Example:
      teamsight schema > study.schema.json
    """
    from importlib.resources import files

    import click

    # As it ships: making it anew would import the model.
    place = files("teamsight.analysis.studies.definition").joinpath("study.schema.json")
    click.echo(place.read_text(encoding="utf-8"), nl=False)
