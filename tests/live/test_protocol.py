"""Messages: what a page sends is read, or refused with a reason."""

from __future__ import annotations

import contextlib
import json
import struct
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from teamsight.live import protocol
from teamsight.live.protocol import Message, parsed


@pytest.mark.parametrize(
    "fields",
    [
        {"type": "run"}, {"type": "ack", "frame": 7}, {"type": "every", "value": 3}, {"type": "rate", "value": None},
        {"type": "rate", "value": 12.5}, {"type": "compare", "on": True},
        {"type": "set", "name": "delta", "value": 8, "track": None}, {"type": "set", "name": "x", "value": "y", "track": 1},
    ],
)  # fmt: skip
def test_right_messages_are_read(fields: dict[str, Any]) -> None:
    found = parsed(json.dumps(fields))
    assert found == Message(fields.pop("type"), fields)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ("", "is not JSON"), ("[", "is not JSON"), ("[" * 4000, "is not JSON"), ("NaN", "is not JSON"),
        ('{"type":"ack","frame":Infinity}', "is not JSON"), (b"\x01\x02", "2 bytes: pages send JSON"), ("3", "must be an object"),
        ("[1]", "must be an object"), ("{}", "type=None: unknown"), ('{"type":["run"]}', "unknown"), ('{"type":"runs"}', "did you mean 'run'"),
        ('{"type":"run","extra":1}', "run: must have no fields, not 'extra'"), ('{"type":"ack"}', "ack: must have frame"),
        ('{"type":"ack","frame":-1}', "frame=-1: must be at least 0"), ('{"type":"ack","frame":true}', "frame=True: must be a whole number"),
        ('{"type":"rate","value":0}', "at least 0.1"), ('{"type":"rate","value":1e300}', "at most 10000"),
        ('{"type":"every","value":10001}', "at most 10000"), ('{"type":"compare","on":1}', "on=1: must be True or False"),
        ('{"type":"set","name":"a","value":1,"track":2}', "track=2: must be at most 1"),
        ('{"type":"set","name":3,"value":1,"track":0}', "name=3: must be a text"),
    ],
)  # fmt: skip
def test_wrong_messages_are_refused_with_a_reason(data: str | bytes, said: str) -> None:
    with pytest.raises((TypeError, ValueError)) as error:
        parsed(data)
    assert said in str(error.value)
    assert len(str(error.value)) < 300
    assert "\n" not in str(error.value)


_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=30),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from(["type", "name", "value", "track", "on"]), inner),
    max_leaves=8,
)  # fmt: skip


@given(st.text() | st.binary() | _JSON.map(json.dumps))
def test_nonsense_raises_nothing_else(data: str | bytes) -> None:
    with contextlib.suppress(TypeError, ValueError):
        assert parsed(data).type in protocol.KINDS


@given(st.dictionaries(st.text(max_size=5), _JSON, max_size=4))
def test_messages_of_the_server_are_json(fields: dict[str, Any]) -> None:
    fields.pop("type", None)
    fields.pop("kind", None)

    def refuse(name: str) -> None:
        raise AssertionError(name)

    assert json.loads(protocol.text("state", **fields), parse_constant=refuse)["type"] == "state"


def test_half_a_character_can_be_sent() -> None:
    # JSON of a page can hold one, and a socket sends UTF-8.
    sent = protocol.text("controls", value=json.loads('"\\ud800"')).encode()
    assert json.loads(sent) == {"type": "controls", "value": "\ud800"}


def test_frames_have_a_head() -> None:
    data = protocol.frame_message(1, 2**32 + 5, b"block")
    assert struct.unpack("<BBHI", data[:8]) == (1, 1, 0, 5)
    assert data[8:] == b"block"
