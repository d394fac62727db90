"""Policies whose kernels use what they did not declare; run as a script, since without a check they end the process."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np

from teamsight.core.kernel import array_at, inlined, kernel, scratch
from teamsight.policies import CompiledPolicy, PolicyState, check_policy


@kernel
def stay(percept: Any, action: Any) -> None:
    action.heading[:] = 0.0
    action.distance[:] = 0.0


@kernel
def slot_100(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    stay(percept, action)
    for i in range(percept.heading.shape[0]):
        arrays.state.floats[i, 100, 0] = 1.0  # slot_100


@kernel
def far_slot_of_a_view(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    stay(percept, action)
    for i in range(percept.heading.shape[0]):
        rows = arrays.state.ints[i]
        rows[5][1] = 7  # far_slot_of_a_view


@inlined
def put(table: Any, i: int, slot: int) -> None:
    table[i, slot, 0] = 1.0  # nested


@kernel
def nested(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    stay(percept, action)
    for i in range(percept.heading.shape[0]):
        put(arrays.state.floats, i, 100_000)


@kernel
def after_a_while(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    stay(percept, action)
    for i in range(percept.heading.shape[0]):
        arrays.state.floats[i, arrays.state.ints[i, 0, 0], 0] = 1.0  # after_a_while
        arrays.state.ints[i, 0, 0] += 1


@kernel
def slot_for_each_target(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    stay(percept, action)
    for i in range(percept.heading.shape[0]):
        for slot in range(percept.targets.start[i + 1] - percept.targets.start[i]):
            arrays.state.floats[i, slot, 1] = 1.0  # slot_for_each_target


@kernel
def slot_by_identity(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    stay(percept, action)
    for i in range(percept.heading.shape[0]):
        for k in range(percept.teammates.start[i], percept.teammates.start[i + 1]):
            arrays.state.floats[i, percept.teammates.identity[k] % 3 - 2, 0] += 1.0  # slot_by_identity


@kernel
def negative(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    stay(percept, action)
    arrays.state.floats[-1, 0, 0] = 1.0  # negative


@kernel
def undeclared_draw(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    stay(percept, action)
    for i in range(percept.heading.shape[0]):
        action.distance[i] = noise[1, i]  # undeclared_draw


@kernel
def noise_of_nobody(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    stay(percept, action)
    for i in range(noise.shape[1]):
        action.distance[0] += noise[0, i]  # noise_of_nobody


@kernel
def noise_as_a_whole(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    stay(percept, action)
    for number in noise[0]:  # noise_as_a_whole
        action.distance[0] += number


@kernel
def noise_into_memory(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    stay(percept, action)
    row = noise[0, :]
    arrays.state.floats[0, 0, 0] = row[percept.heading.shape[0]]


@kernel
def undeclared_parameter(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    stay(percept, action)
    action.distance[0] = arrays.parameters[2]  # undeclared_parameter


@kernel
def robot_of_nobody(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    stay(percept, action)
    for i in range(percept.heading.shape[0] + 1):
        action.distance[i] = 0.0  # robot_of_nobody


@kernel
def robot_left_out(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    for i in range(1, percept.heading.shape[0]):
        action.heading[i, 0] = 0.0
        action.heading[i, 1] = 0.0
    action.distance[:] = 0.0


@kernel
def sighting_beyond(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    stay(percept, action)
    last = percept.targets.start[percept.heading.shape[0]]
    action.distance[0] = percept.targets.offset[last, 0]  # sighting_beyond


@kernel
def writes_percept(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    stay(percept, action)
    percept.speed[0] = 9.0  # writes_percept


@kernel
def writes_parameters(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    stay(percept, action)
    arrays.parameters[:] = 9.0  # writes_parameters


@kernel
def writes_noise(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    stay(percept, action)
    noise[0, 0] = 9.0  # writes_noise


@kernel
def beyond_scratch(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    stay(percept, action)
    room = scratch(4, np.float64)
    for j in range(5):
        room[j] = 1.0  # beyond_scratch


@kernel
def behind_its_memory(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    stay(percept, action)
    rows = array_at(arrays.state.floats.ctypes.data, arrays.state.floats.size + 1, np.float64)
    rows[arrays.state.floats.size] = 1.0


@kernel
def raises(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    stay(percept, action)
    pair = (1.0, 2.0)
    action.distance[0] = pair[percept.heading.shape[0] + 1]  # raises


@kernel
def raises_itself(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    stay(percept, action)
    if percept.heading.shape[0] > 0:
        raise ValueError("too many")  # raises_itself


@kernel
def whole_of_nan(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    stay(percept, action)
    slot = int(math.sqrt(-1.0 - percept.speed[0]))
    arrays.state.floats[0, slot, 0] = 1.0  # whole_of_nan


KERNELS = [
    slot_100, far_slot_of_a_view, nested, after_a_while, slot_for_each_target, slot_by_identity, negative,
    undeclared_draw, noise_of_nobody, noise_as_a_whole, noise_into_memory,
    undeclared_parameter, robot_of_nobody, robot_left_out, sighting_beyond,
    writes_percept, writes_parameters, writes_noise, beyond_scratch, behind_its_memory, raises,
    raises_itself, whole_of_nan,
]  # fmt: skip


def policy_with(rule: Any) -> CompiledPolicy:
    """Return a policy with two slots of memory, two parameters and one draw."""

    class Overrun(CompiledPolicy):
        kernel = rule
        draws = 1
        parameters = (1.0, 2.0)

        def start(self, size: int) -> PolicyState:
            return PolicyState(np.zeros((size, 2, 3)), np.zeros((size, 2, 3), np.int64))

    return Overrun()


def refusal(rule: Any) -> str:
    """Return what `check_policy` says of a policy with this kernel."""
    try:
        check_policy(policy_with(rule))
    except (TypeError, ValueError) as error:
        return f"{type(error).__name__}: {error}"
    return "passed"


if __name__ == "__main__":
    for rule in KERNELS:
        print(json.dumps([rule.__name__, refusal(rule)]), flush=True)
