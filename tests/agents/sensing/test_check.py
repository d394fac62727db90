"""`check_sensor`: what ships passes, and a sensor that breaks the contract is named with the cure."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from teamsight.agents.sensing import Sensor, check_sensor
from teamsight.agents.sensing.sensor import uniform, words_of
from teamsight.core.kernel import kernel

SENSORS = [
    Sensor(), Sensor(field_of_view=2.0), Sensor(range_noise=0.3), Sensor(bearing_noise=1.0), Sensor(missed=0.5),
    Sensor(false_positives=1.0), Sensor(occluded=False), Sensor(missed=1.0, false_positives=0.5),
    Sensor(field_of_view=1.0, range_noise=0.1, bearing_noise=0.1, missed=0.1, false_positives=0.2, delay=3, range=2.0),
]  # fmt: skip


@pytest.mark.parametrize("number", range(len(SENSORS)))
def test_every_sensor_that_ships_keeps_the_contract(number: int) -> None:
    check_sensor(SENSORS[number], seed=number)


# A sensor that senses only the nearest agent in range, and errs in its distance. The others differ in one thing.


@kernel
def _nearest(view: Any, i: int) -> int:
    best = -1
    for k in range(view.in_range.start[i], view.in_range.start[i + 1]):
        if best < 0 or view.in_range.distance[k] < view.in_range.distance[best]:
            best = k
    return best


@kernel
def _put(view: Any, sensed: Any, at: int, k: int, factor: float) -> None:
    sensed.identity[at] = view.in_range.identity[k]
    sensed.offset[at, 0] = view.in_range.offset[k, 0] * factor
    sensed.offset[at, 1] = view.in_range.offset[k, 1] * factor
    sensed.distance[at] = view.in_range.distance[k] * factor


@kernel
def _sense(view: Any, parameters: Any, sensed: Any) -> int:
    at = 0
    for i in range(view.heading.shape[0]):
        sensed.start[i] = at
        k = _nearest(view, i)
        if k >= 0:
            if at < sensed.distance.shape[0]:
                words = words_of(view, i, view.everyone[view.in_range.identity[k]])
                _put(view, sensed, at, k, 0.5 + uniform(words[0]))
            at += 1
    sensed.start[view.heading.shape[0]] = at
    return at


class Nearest(Sensor):
    sense = _sense


def test_a_sensor_of_ones_own_passes() -> None:
    check_sensor(Nearest())


@kernel
def _no_room(view: Any, parameters: Any, sensed: Any) -> int:
    at = 0
    for i in range(view.heading.shape[0]):
        sensed.start[i] = at
        k = _nearest(view, i)
        if k >= 0:
            _put(view, sensed, at, k, 1.0)
            at += 1
    sensed.start[view.heading.shape[0]] = at
    return at


@kernel
def _returns_too_little(view: Any, parameters: Any, sensed: Any) -> int:
    return _sense(view, parameters, sensed) // 2


@kernel
def _never_enough(view: Any, parameters: Any, sensed: Any) -> int:
    return sensed.distance.shape[0] + 1 if _sense(view, parameters, sensed) > 0 else 0


@kernel
def _no_last_start(view: Any, parameters: Any, sensed: Any) -> int:
    before = sensed.start[view.heading.shape[0]]
    need = _sense(view, parameters, sensed)
    sensed.start[view.heading.shape[0]] = before
    return need


@kernel
def _no_distance(view: Any, parameters: Any, sensed: Any) -> int:
    need = _sense(view, parameters, sensed)
    for at in range(min(need, sensed.distance.shape[0])):
        sensed.distance[at] = 2.0
    return need


@kernel
def _nan_offset(view: Any, parameters: Any, sensed: Any) -> int:
    need = _sense(view, parameters, sensed)
    for at in range(min(need, sensed.distance.shape[0])):
        sensed.offset[at, 0] = np.nan
    return need


@kernel
def _identities(view: Any, parameters: Any, sensed: Any) -> int:
    need = _sense(view, parameters, sensed)
    for at in range(min(need, sensed.distance.shape[0])):
        sensed.identity[at] = 1000 + sensed.identity[at]
    return need


@kernel
def _wrong_index(view: Any, parameters: Any, sensed: Any) -> int:
    need = _sense(view, parameters, sensed)
    for at in range(min(need, sensed.distance.shape[0])):
        if sensed.identity[at] > 0:
            sensed.identity[at] -= 1
    return need


@kernel
def _descending(view: Any, parameters: Any, sensed: Any) -> int:
    size = view.heading.shape[0]
    need = view.in_range.start[size]
    if need > sensed.distance.shape[0]:
        return need
    for i in range(size):
        first = view.in_range.start[i]
        last = view.in_range.start[i + 1]
        sensed.start[i] = first
        for k in range(first, last):
            _put(view, sensed, first + last - 1 - k, k, 1.0)
    sensed.start[size] = need
    return need


@kernel
def _itself(view: Any, parameters: Any, sensed: Any) -> int:
    size = view.heading.shape[0]
    if size > sensed.distance.shape[0]:
        return size
    for i in range(size):
        sensed.start[i] = i
        sensed.identity[i] = ~max(view.own + i, 0)
        sensed.offset[i, :] = 0.0
        sensed.distance[i] = 0.0
    sensed.start[size] = size if view.own >= 0 else 0
    return sensed.start[size]


@kernel
def _writes_view(view: Any, parameters: Any, sensed: Any) -> int:
    if view.heading.shape[0] > 0:
        view.heading[0, 0] = 1.0  # writes_view
    return _sense(view, parameters, sensed)


@kernel
def _third_parameter(view: Any, parameters: Any, sensed: Any) -> int:
    return _sense(view, parameters, sensed) + int(parameters[9])  # third_parameter


@kernel
def _by_index(view: Any, parameters: Any, sensed: Any) -> int:
    need = _sense(view, parameters, sensed)
    for i in range(view.heading.shape[0]):
        k = _nearest(view, i)
        if k >= 0 and sensed.start[i] < sensed.distance.shape[0]:
            words = words_of(view, i, view.in_range.identity[k])
            _put(view, sensed, sensed.start[i], k, 2.0 + uniform(words[0]))
    return need


@kernel
def _by_row(view: Any, parameters: Any, sensed: Any) -> int:
    need = _sense(view, parameters, sensed)
    for i in range(view.heading.shape[0]):
        k = _nearest(view, i)
        if k >= 0 and sensed.start[i] < sensed.distance.shape[0]:
            _put(view, sensed, sensed.start[i], k, 1.0 + i)
    return need


@kernel
def _remembers(view: Any, parameters: Any, sensed: Any) -> int:
    room = sensed.distance.shape[0]
    need = _sense(view, parameters, sensed)
    for at in range(min(need, room)):
        factor = 1.0 + room
        sensed.offset[at, 0] *= factor
        sensed.offset[at, 1] *= factor
        sensed.distance[at] *= factor
    return need


@kernel
def _misspelt(view: Any, parameters: Any, sensed: Any) -> int:
    return int(view.headings[0, 0])  # misspelt


WRONG = [
    ({"sense": _no_room}, r".*test_check\.py:\d+: sense uses index 0 of sensed\.identity, whose number of entries is 0; write no more than there is room for"),
    ({"sense": _returns_too_little}, r"sense returns \d+, but writes \d+ entries of sensed; return how many"),
    ({"sense": _never_enough}, r"sense asks for more room on every call, last for \d+; return what is needed"),
    ({"sense": _no_last_start}, r"sense writes sensed\.start = \[.*-7777777.*write all n \+ 1 elements"),
    ({"sense": _no_distance}, r"sense writes for observer \d+: the distance 2 and an offset of length .*equal"),
    ({"sense": _nan_offset}, r"sense writes for observer \d+: an offset or a distance that is unwritten or not finite; write both"),
    ({"sense": _identities}, r"sense writes for observer \d+: the index 1\d+, but there are \d+ observed agents; copy it"),
    ({"sense": _wrong_index}, r"sense writes for observer \d+: the index \d+, which is not in range; write ~\d+ for a false"),
    ({"sense": _descending}, r"sense writes for observer \d+: the index -?\d+ after .*; they must ascend"),
    ({"sense": _itself}, r"sense writes for observer 0: the observer itself, index \d+; leave out view\.own \+ i"),
    ({"sense": _writes_view}, r".*: sense writes into view\.heading, which is read-only; copy"),
    ({"sense": _third_parameter}, r".*: sense uses index 9 of parameters, whose number of parameters is 7; add .*`parameters`"),
    ({"sense": _by_index}, r"sense writes something else if the observed agents have other row numbers; .*view\.everyone\[index\]"),
    ({"sense": _by_row}, r"sense writes something else if the observers have other row numbers; .*view\.member\[i\]"),
    ({"sense": _remembers}, r"sense writes different sensed after a call with too little room; do not depend"),
    ({"sense": _misspelt}, r".*test_check\.py:\d+: View has no field 'headings'; it has tick, "),
    ({"parameters": np.array([np.nan])}, r"parameters=.*: must be finite numbers in 1 dimension"),
    ({"parameters": "wide"}, r"parameters=.wide.: must be finite numbers in 1 dimension"),
]  # fmt: skip


@pytest.mark.parametrize(("members", "message"), WRONG, ids=[f"{n}-{'-'.join(case[0])}" for n, case in enumerate(WRONG)])
def test_what_breaks_the_contract_is_named(members: dict[str, Any], message: str) -> None:
    sensor = type("Changed", (Nearest,), members)()
    with pytest.raises((TypeError, ValueError)) as raised:
        check_sensor(sensor)
    assert re.match(rf"(Changed(: |\.))?{message}", str(raised.value)), str(raised.value)
    assert len(str(raised.value)) < 400
    assert "\n" not in str(raised.value)
    rule = members.get("sense")
    mark = f"# {rule.__name__[1:]}" if rule else "no mark"
    for number, line in enumerate(Path(__file__).read_text().splitlines(), 1):
        assert not line.endswith(mark) or f"{Path(__file__).name}:{number}: " in str(raised.value)


@kernel
def _behind_others(view: Any, parameters: Any, sensed: Any) -> int:
    """Leave out what another observer is nearer to; or, with a parameter, count all observers."""
    at = 0
    for i in range(view.heading.shape[0]):
        sensed.start[i] = at
        for k in range(view.in_range.start[i], view.in_range.start[i + 1]):
            x = view.position[i, 0] + view.in_range.offset[k, 0]
            nearer = False
            for j in range(view.heading.shape[0]):
                nearer = nearer or (j != i and abs(view.position[j, 0] - x) < 0.1)
            if parameters[0] > 0.0:
                nearer = view.heading.shape[0] % 2 == 0
            if not nearer:
                if at < sensed.distance.shape[0]:
                    _put(view, sensed, at, k, 1.0)
                at += 1
    sensed.start[view.heading.shape[0]] = at
    return at


def test_a_sensor_may_read_observers_nearby_and_no_others() -> None:
    def made(value: float) -> Sensor:
        return type("Shaded", (Sensor,), {"sense": _behind_others, "parameters": np.array([value])})()  # type: ignore[no-any-return]

    check_sensor(made(0.0))
    with pytest.raises(ValueError, match="Shaded: sense writes something else if there is one observer more, far from"):
        check_sensor(made(1.0))


def test_something_else_than_a_sensor_is_refused() -> None:
    with pytest.raises(TypeError, match=r"2.0: must be an object of a subclass of Sensor"):
        check_sensor(2.0)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"Sensor: is a class; give an object, such as Sensor"):
        check_sensor(Sensor)  # type: ignore[arg-type]
