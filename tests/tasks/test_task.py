"""A task: its scenario, teams and metrics, and what `check_task` says of a wrong one."""

from __future__ import annotations

import inspect
import math
import pickle
import warnings
from dataclasses import replace
from typing import Any

import pytest
from toy_tasks import GATHER, LEARN, SOON, Beacon, closeness

from teamsight import CMOMMT, TASKS, Objective, check_task
from teamsight.agents.awareness import RingAwareness
from teamsight.tasks import task_of


@pytest.mark.parametrize("name", TASKS)
def test_every_task_keeps_its_contract(name: str) -> None:
    check_task(name)
    assert TASKS[name].name == name


@pytest.mark.parametrize("task", [GATHER, SOON, LEARN], ids=lambda task: task.name)
def test_toy_tasks_keep_the_contract(task: Any) -> None:
    check_task(task)


def test_cmommt_as_a_task_is_cmommt() -> None:
    world = TASKS["cmommt"].build("explore", rng=5, robots=4, radius=3.0)
    same = CMOMMT(4, radius=3.0, policy="random-walk", rng=5)
    for each in (world, same):
        each.run(50)
    assert TASKS["cmommt"].measure(world) == {"observed_fraction": same.observed_fraction}
    assert world.max_neighbours == same.max_neighbours


@pytest.mark.parametrize("task", [TASKS["cmommt"], LEARN])
def test_worker_processes_get_the_whole_task(task: Any) -> None:
    assert vars(pickle.loads(pickle.dumps(task))) == vars(task)


def test_parameters_are_the_scenario_and_the_team() -> None:
    found = GATHER.parameters("explore", {"walkers": 9}, awareness=RingAwareness(4))
    assert found == {"walkers": 9, "side": 6.0, "policy": "random-walk", "awareness": RingAwareness(4)}
    assert GATHER.parameters({"policy": "stationary"})["policy"] == "stationary"


def test_a_team_that_learns_is_given_scenario_degree_and_seed() -> None:
    given: list[Any] = []

    def train(*arguments: Any) -> dict[str, Any]:
        given.append(arguments)
        return {"policy": "stationary"}

    task = replace(GATHER, skilled=train)
    found = task.parameters("skilled", {"side": 3.0}, awareness="ring", rng=8)
    assert given == [({"walkers": 6, "side": 3.0}, RingAwareness(), 8)]
    assert (found["policy"], found["awareness"]) == ("stationary", "ring")


def test_a_changed_mapping_does_not_change_the_task() -> None:
    scenario = {"walkers": 3, "side": 6.0}
    task = replace(GATHER, scenario=scenario)
    scenario["walkers"] = 8
    assert task.full_scenario() == {"walkers": 3, "side": 6.0}


def test_a_duration_that_did_not_end_counts_as_the_run() -> None:
    soon = SOON.objective
    assert (soon.counted(math.inf, 100), soon.counted(7.0, 100)) == (100.0, 7.0)
    assert soon.is_censored(math.inf)
    assert (soon.sign, GATHER.objective.sign) == (-1.0, 1.0)


def raises(world: Any) -> float:
    raise RuntimeError("no food")


WRONG: list[tuple[dict[str, Any], tuple[str, ...]]] = [
    ({"explore": None}, ("gather has no exploration treatment", "explore={'policy': 'random-walk'}")),
    ({"objective": ("nearness", "more")}, ("objective='nearness'", "did you mean 'closeness'")),
    ({"objective": ("closeness", "max")}, ("better='max'", "known are less, more")),
    ({"objective": "closeness"}, ("objective='closeness'", "Objective('observed_fraction', 'more')")),
    ({"metrics": {"closeness": raises}}, ("the metric 'closeness' of gather raised RuntimeError: no food", "test_task")),
    ({"metrics": {"closeness": lambda world: "near"}}, ("'closeness' of the task returned 'near'", "is no number")),
    ({"metrics": {"closeness": lambda world: math.nan}}, ("returned nan", "math.inf for a duration")),
    ({"metrics": {"closeness": lambda world: math.inf}}, ("more of it is better", "finite")),
    ({"metrics": {"closeness": 3}}, ("metrics: closeness=3", "a function (world) -> float")),
    ({"scenario": {"walkers": 6, "sied": 6.0}}, ("scenario: 'sied'", "did you mean 'side'")),
    ({"scenario": {"walkers": 6, "side": [1]}}, ("side=[1]", "explore and skilled")),
    ({"explore": {"polcy": "random-walk"}}, ("explore: 'polcy'", "did you mean 'policy'")),
    ({"explore": {"walkers": 3}}, ("walkers: is a parameter of the scenario of gather", "leave it out")),
    ({"size": "robots"}, ("size='robots'", "they are walkers, side")),
    ({"size": "side"}, ("size='side'", "team 'walkers' has 6", "parameter that is their number")),
    ({"team": "robots"}, ("team='robots'", "known are walkers")),
    ({"skilled": lambda scenario, awareness, rng: 3}, ("skilled of the task gather returned 3", "mapping")),
    ({"title": ""}, ("title=''", "must be a text")),
    ({"steps": 0}, ("steps=0", "at least 1")),
]  # fmt: skip


@pytest.mark.parametrize(("change", "parts"), WRONG, ids=map(str, range(len(WRONG))))
def test_a_wrong_task_is_named_with_the_cure(change: dict[str, Any], parts: tuple[str, ...]) -> None:
    if change.get("size") == "side":
        change = {**change, "scenario": {"walkers": 6, "side": 7}}
    with pytest.raises((TypeError, ValueError)) as raised:
        check_task(replace(GATHER, **change))
    for part in parts:
        assert part in str(raised.value)


def test_noise_that_is_not_of_the_seed_is_found() -> None:
    numbers = iter(range(100))
    task = replace(GATHER, metrics={"closeness": lambda world: next(numbers)})
    with pytest.raises(ValueError, match=r"explore team of gather: closeness is 0\.0 .* let all noise come from rng"):
        check_task(task)


def test_a_skilled_team_that_is_worse_is_named_with_both_values() -> None:
    worse = replace(GATHER, objective=("closeness", "less"), steps=40)
    with pytest.warns(UserWarning, match=r"gather is worse than the one that explores in 8 of 8 runs of 40 steps: closeness is"):
        check_task(worse)
    # Of two equal teams, and of the better one, nothing is said.
    for skilled in (GATHER.explore, GATHER.skilled):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            check_task(replace(GATHER, skilled=skilled, steps=40))


def test_a_world_without_a_seed_is_refused() -> None:
    def world(walkers: int, side: float, policy: str = "centroid") -> Beacon:
        return Beacon(walkers, side, policy=policy)

    with pytest.raises(TypeError, match="takes no rng; add rng=None"):
        check_task(replace(GATHER, world=world))


def test_unknown_names_are_refused() -> None:
    assert task_of("cmommt") is TASKS["cmommt"]
    with pytest.raises(ValueError, match="wakers: is no parameter of the scenario of gather; did you mean 'walkers'"):
        GATHER.build(wakers=3)
    with pytest.raises(ValueError, match=r"task='cmomt': unknown; did you mean 'cmommt'"):
        task_of("cmomt")
    with pytest.raises(TypeError, match="must be a Task, or the name of one: cmommt"):
        task_of(3)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="treatment='skiled': unknown; did you mean 'skilled'"):
        GATHER.parameters("skiled")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="the task gather has no skilled team"):
        replace(GATHER, skilled=None).parameters("skilled")


def test_a_task_takes_less_than_40_lines() -> None:
    import teamsight.tasks.cmommt as module

    assert len(inspect.getsource(module).splitlines()) <= 40
    assert GATHER.measure(_run(GATHER))["closeness"] == closeness(_run(GATHER))
    assert Objective("closeness").better == "more"


def _run(task: Any) -> Any:
    world = task.build("explore", rng=1)
    world.run(20)
    return world
