"""``teamsight warm``: compile the kernels of a new machine, or for an image, before they are needed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import product
from typing import Any

from teamsight.cli.options import Options


def worlds() -> Iterator[Callable[[], Any]]:
    """Yield functions that make the worlds of commands: policies with degrees, sensors, bodies, drives, tasks, records.

    What each makes has ``run(steps)`` and ``step()``.
    """
    from teamsight.agents.awareness import AWARENESS, RelayedAwareness
    from teamsight.agents.cmommt import CMOMMT
    from teamsight.agents.sensing import Lidar, Sensor
    from teamsight.policies.registry import POLICIES, policy_named
    from teamsight.tasks import TASKS
    from teamsight.world.registry import CONTACTS, DRIVES

    small: dict[str, Any] = {"robots": 3, "targets": 3, "seed": 1}
    for policy in POLICIES:
        degree, needs = policy_named(policy).degree, set(policy_named(policy).needs)
        fitting = [name for name, kind in AWARENESS.items() if needs <= set(kind.delivers)]
        for awareness in fitting if degree is None else (degree,):
            yield partial(CMOMMT, **small, policy=policy, awareness=awareness)
    yield partial(CMOMMT, **small, sensor=Sensor(field_of_view=2.0), lidar=Lidar(), robot_radius=0.1)
    yield partial(CMOMMT, **small, awareness=RelayedAwareness(loss=0.1))
    for drive, contact in product(DRIVES, CONTACTS):
        bodies: dict[str, Any] = {"drive": drive, "contact": contact, "robot_radius": 0.1}
        yield partial(CMOMMT, **small, **bodies)
    for task in TASKS.values():
        for treatment in ("explore", "skilled"):
            yield partial(task.build, treatment, rng=1)


def use_all(progress: Callable[[int, int], None]) -> None:
    """Make all these worlds and run each for a few steps.

    Parameters
    ----------
    progress : callable
        Called with the number of worlds that are done, and of all.
    """
    every = [*worlds()]
    for number, make in enumerate(every):
        progress(number, len(every))
        world = make()
        with world.record():
            world.run(2)
        world.step()


def warm(settings: Options) -> None:
    """Compile the kernels of commands and tasks, which are kept.

    Without it, each is compiled when it is first needed, which takes seconds. Call it once on a machine, or for the
    image of a container. The folder of the cache, TEAMSIGHT_CACHE_DIR, must belong to the user who runs teamsight.

    \b
    Example:
      TEAMSIGHT_CACHE_DIR=/opt/kernels teamsight warm
    """
    from teamsight.cli.show import Watch, say
    from teamsight.core.kernel.cache import cache_folder
    from teamsight.core.kernel.entry import READY
    from teamsight.core.kernel.report import listening

    compiled: list[str] = []
    with Watch() as watch, listening(compiled.append):
        use_all(lambda done, total: watch("compiling", done, total))
        taken = watch.passed()
    lost = sum(not entry.is_kept() for entry in READY)
    if lost:
        raise OSError(f"{lost} of {len(READY)} kernels could not be kept in {cache_folder()}; is there room?")
    say(f"{len(READY)} kernels are ready, {len(compiled)} of them compiled in {taken}; the cache is {cache_folder()}")
