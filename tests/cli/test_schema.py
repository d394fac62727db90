"""``teamsight schema`` prints the JSON Schema of study files."""

from __future__ import annotations

import json

import pytest

from teamsight.analysis.studies.definition.schema import schema
from teamsight.cli.main import main


@pytest.mark.short
def test_the_schema_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["schema"])
    assert ended.value.code in (None, 0)
    assert json.loads(capsys.readouterr().out) == schema()
