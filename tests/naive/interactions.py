"""A slow twin of the capture of `tests/interactions.py`, written like its sentence."""

from __future__ import annotations

from typing import Any

import numpy as np

from teamsight.world.noise import Stream, key_within, stream_number, uniforms


def capture(world: Any, moved: dict[str, np.ndarray], tick: int, name: str) -> dict[str, Any]:
    """Return what follows from the places to which all have moved: places of prey, speeds, rewards and captures."""
    hunters, prey = world.groups
    reach, side = world.interactions[0].reach, world.interactions[0].side
    key = key_within(world._data.key, f"interaction {name} 0")
    noise = uniforms(key, stream_number(Stream.INTERACTION, 1), tick, prey.bodies.member, 2)
    place, speed = moved["prey"].copy(), prey.bodies.speed.copy()
    reward, captured = np.full(len(hunters), -0.1), 0
    for j in range(len(prey)):
        near = [i for i in range(len(hunters)) if np.sum((moved["hunters"][i] - place[j]) ** 2) <= reach**2]
        for i in near:
            reward[i] += 1.0
        if near:
            captured += 1
            speed[j] = 0.5 * speed[j] + 0.05
            place[j] = (noise[:, j] - 0.5) * side
    return {"place": place, "speed": speed, "reward": reward, "captured": captured}
