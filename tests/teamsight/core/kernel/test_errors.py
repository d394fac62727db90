"""What a kernel says that cannot be compiled: the user's line first, then one line of reasonable length."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numba.core.errors import NumbaError

from teamsight.core.kernel import kernel
from teamsight.core.kernel.errors import explained
from teamsight.policies import CompiledPolicy

HERE = Path(__file__).name


def helper(x: float) -> float:
    return x + 1.0


class Thing:
    value = 1.0


THING = Thing()


@kernel
def add(a: float, b: float) -> float:
    return a + b


@kernel
def typo(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    for i in range(percept.heading.shape[0]):
        action.distance[i] = percpt.speed[i]  # type: ignore[name-defined]  # noqa: F821  # typo


@kernel
def no_field(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    action.distance[0] = percept.foo[0]  # no_field


@kernel
def no_memory_field(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    action.distance[0] = arrays.state.reel[0, 0, 0]  # no_memory_field


@kernel
def no_array_field(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    action.distance[0] = percept.heading.shap[0]  # no_array_field


@kernel
def replaced(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    action.heading = percept.heading  # replaced


@kernel
def unsupported(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    action.distance[0] = np.gradient(percept.speed)[0]  # unsupported


@kernel
def no_function(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    action.distance[0] = math.sqroot(percept.speed[0])  # type: ignore[attr-defined]  # no_function


@kernel
def own_randomness(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    action.distance[0] = np.random.default_rng().random()  # own_randomness


@kernel
def allocates(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    way = np.zeros(2)  # allocates
    action.distance[0] = way[0]


@kernel
def computes_array(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    action.distance[:] = percept.speed * 2.0  # computes_array


@kernel
def three(percept: Any, arrays: Any, noise: Any) -> None:  # three is named by the line of its decorator
    pass


@kernel
def too_few(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    action.distance[0] = add(1.0)  # type: ignore[call-arg]  # too_few


@kernel
def one_or_two(x: float) -> Any:
    if x > 0:
        return 1.0, 2.0  # varying
    return 1.0


@kernel
def varying(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    one_or_two(percept.speed[0])


@kernel
def two_indices(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    action.distance[0] = percept.speed[0, 1]  # two_indices


@kernel
def row_as_number(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    action.distance[0] = percept.heading[0]  # row_as_number


@kernel
def fraction_as_index(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    action.distance[0] = percept.speed[0.5]  # fraction_as_index


@kernel
def plain_helper(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    action.distance[0] = helper(percept.speed[0])  # plain_helper


@kernel
def foreign(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    action.distance[0] = THING.value  # foreign


@kernel
def too_early(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    action.distance[0] = later  # type: ignore[has-type]  # noqa: F821  # too_early
    later = 1.0  # noqa: F841


@kernel  # with_statement
def with_statement(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    with open("x") as _:
        pass


@kernel
def inner(percept: Any) -> Any:
    return percept.speeed[0]  # nested


@kernel
def nested(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    action.distance[0] = inner(percept)


def closure_over(share: float) -> Any:
    @kernel
    def closure(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
        action.distance[0] = share * percpt.speed[0]  # type: ignore[name-defined]  # noqa: F821  # closure

    return closure


def undecorated(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    pass


closure = closure_over(2.0)

MISTAKES = [
    (typo, "typo", r"name 'percpt' is not defined; did you mean 'percept'\?"),
    (closure, "closure", r"name 'percpt' is not defined; did you mean 'percept'\?"),
    (no_field, "no_field", r"Percept has no field 'foo'; it has heading, moved, .*, situation"),
    (nested, "nested", r"Percept has no field 'speeed'; it has .*speed"),
    (no_memory_field, "no_memory_field", "PolicyState has no field 'reel'; it has floats, ints"),
    (no_array_field, "no_array_field", r"no attribute 'shap'; did you mean 'shape'\?"),
    (replaced, "replaced", r"Action\.heading cannot be replaced; write its elements"),
    (unsupported, "unsupported", r"cannot compile numpy\.gradient; write it with"),
    (no_function, "no_function", r"'math' has no attribute 'sqroot'; did you mean 'sqrt'\?"),
    (own_randomness, "own_randomness", r"numpy\.random\.default_rng; take random numbers from noise"),
    (allocates, "allocates", "makes or copies an array.*write numbers one by one"),
    (computes_array, "computes_array", "makes or copies an array.*write numbers one by one"),
    (too_few, "too_few", r"add\(a, b\) .*missing a required argument: 'b'"),
    (varying, "varying", r"different types \(float64, tuple\); return one type"),
    (two_indices, "two_indices", r"array\(float64, 1d\) is given 2 indices"),
    (row_as_number, "row_as_number", r"array\(float64, 1d\) cannot be written .* write one number"),
    (fraction_as_index, "fraction_as_index", "float64.*must be a whole number"),
    (plain_helper, "plain_helper", "'helper' is a plain Python function; decorate it with @kernel or @inlined"),
    (foreign, "foreign", r"'THING' is of the type .*Thing; kernels can use numbers"),
    (too_early, "too_early", "'later' is used before it has a value"),
    (with_statement, "with_statement", "cannot be compiled: The 'with"),
]


def refused(rule: Any) -> TypeError:
    """Return the error with which a policy with this kernel is refused."""
    policy = type("Mistaken", (CompiledPolicy,), {"kernel": rule, "parameters": (1.0,)})
    with pytest.raises(TypeError) as caught:
        policy().entry().address  # noqa: B018
    return caught.value


@pytest.mark.parametrize(("rule", "mark", "message"), MISTAKES, ids=[case[1] for case in MISTAKES])
def test_a_mistake_is_named_with_the_users_line_first(rule: Any, mark: str, message: str) -> None:
    lines = Path(__file__).read_text().splitlines()
    line = next(number for number, text in enumerate(lines, 1) if text.endswith(f"# {mark}"))
    error = refused(rule)
    place, _, what = str(error).partition(": ")
    assert place.endswith(f"{HERE}:{line}"), error
    assert re.search(message, what), error
    assert len(what) <= 250
    assert "\n" not in str(error)
    assert error.__cause__ is not None


def test_a_kernel_with_other_parameters_is_named() -> None:
    assert re.search(
        rf"{HERE}:\d+: .*three\(percept, arrays, noise\) is called as three\(percept, arrays, noise, action\); give",
        str(refused(three)),
    )


def test_a_plain_function_in_place_of_a_kernel_is_named() -> None:
    assert re.search(rf"{HERE}:\d+: .*decorate it with @kernel", str(refused(undecorated)))


def test_a_kernel_without_a_source_file_is_named_as_well() -> None:
    names: dict[str, Any] = {"kernel": kernel}
    exec("@kernel\ndef made(percept, arrays, noise, action):\n    action.distance[0] = percpt.speed[0]\n", names)
    assert re.search(r"<string>:3: name 'percpt' is not defined", str(refused(names["made"])))


def test_the_colours_of_numba_hide_nothing() -> None:
    coloured = NumbaError("\x1b[1m\x1b[31mcannot index array(float64, \x1b[0m1d, C) with 2 indices\x1b[0m")
    assert explained(helper, coloured).endswith(": an array(float64, 1d) is given 2 indices")
