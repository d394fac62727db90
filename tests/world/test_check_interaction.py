"""`check_interaction` accepts good interactions, and names what is wrong with others."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from interactions import Capture, CaptureInTurn

from teamsight import Disc, Interaction, check_interaction
from teamsight.core.kernel import kernel
from teamsight.world import InteractionState


def test_good_interactions_pass() -> None:
    check_interaction(Capture())
    check_interaction(CaptureInTurn(side=4.0), Disc(3.0))


@kernel
def _many(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    one, two = bodies.one, bodies.two
    what = parameters[0]
    if what == 0.0:
        for i in range(two.position.shape[0]):
            one.reward[i] = 1.0
    elif what == 2.0:
        state.floats[0, 2] = 1.0
    elif what == 3.0:
        scores[turn] = 1.0
    elif what == 4.0:
        one.reward[0] = noise.one[0, one.position.shape[0]]
    elif what == 5.0:
        one.reward[0] = noise.two[1, 0]
    elif what == 6.0:
        one.position[0, 0] += 11.0
    elif what == 7.0:
        one.heading[0, 0] = 5.0
    elif what == 8.0:
        two.speed[0] = -1.0
    elif what == 9.0:
        scores[0] = 1.0 / (one.load[0] - one.load[0])
    elif what == 10.0:
        one.load[one.load.shape[0]] = 3
    elif what == 11.0:
        one.reward[0] = parameters[1]
    elif what == 13.0:
        # A mean.
        scores[0] = two.reward.sum() / two.reward.shape[0]


@dataclass(frozen=True)
class Many(Interaction):
    roles = ("one", "two")
    scores = ("score",)
    draws = 1
    columns = (("one", "load", 2),)
    what: float = -1.0
    kernel = _many

    def start(self, sizes: Any) -> InteractionState:
        return InteractionState(np.zeros((1, 2)), np.zeros((0, 0), np.int64))


MISTAKES = [
    (0, r"index . of bodies.one.reward, whose number of bodies is .; one are 0 to n − 1, and n is bodies.one.position"),
    (2, r"index 2 of state.floats, whose number of fields is 2; start\(sizes\) determines"),
    (3, r"index -1 of scores, whose number of scores is 1; indices count from 0"),
    (4, r"of noise.one, whose number of bodies is .; rows of noise can be longer than there are one"),
    (5, r"index 1 of noise.two, whose number of draws is 1; declare as many as it needs as `draws`"),
    (6, r"leaves one 0 with a position outside Torus.*the arena for which it is made"),
    (7, r"leaves one 0 with a heading that is no unit vector, \[5.0"),
    (8, r"with a speed that is not finite or negative, -1.0"),
    (9, r"leaves the score 'score' at (inf|nan)"),
    (10, r"of bodies.one.load, whose number of bodies is"),
    (11, r"index 1 of parameters, whose number of parameters is 1; add what it needs to `parameters`"),
    (13, r"leaves the score 'score' at nan; .* \(with 0 bodies in the role 'two', as when all have left\)"),
]


@pytest.mark.parametrize(("what", "error"), MISTAKES)
def test_mistakes_are_named(what: int, error: str) -> None:
    with pytest.raises(ValueError, match=f"Many: .*{error}"):
        check_interaction(Many(float(what)))


def test_what_is_no_interaction_is_refused() -> None:
    with pytest.raises(TypeError, match=r"Capture: is a class; give an object, such as Capture"):
        check_interaction(Capture)  # type: ignore[arg-type]
