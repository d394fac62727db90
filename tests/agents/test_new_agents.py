"""Agents of a user's own: what their __init__ takes, their team, their headings, and groups without a policy."""

from __future__ import annotations

from typing import Any, ClassVar

import mesa
import numpy as np
import pytest

from teamsight import Body, Disc, Robot, Target, World
from teamsight.policies import Stationary

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one", "ignore:no group senses")


def world() -> World:
    return World(Disc(3.0), rng=1)


class Scout(Robot):
    """Takes arguments as mesa's agents do."""

    def __init__(self, model: World, load: Any, tag: Any = None) -> None:
        # All that an agent has is there before mesa knows it.
        self.before = (float(self.position[0]), self.speed, self.group.name)
        super().__init__(model)
        self.load, self.tag = load, tag
        assert self.group.identity[self.row] == self.unique_id


class Plain(mesa.Agent):  # type: ignore[misc]
    """The same in plain mesa."""

    def __init__(self, model: Any, load: Any, tag: Any = None) -> None:
        super().__init__(model)
        self.load, self.tag = load, tag


VALUES: list[Any] = [
    1, [1, 2, 3], (1, 2, 3), np.array([1, 2, 3]), [1, 2], "abc", np.zeros((3, 2)), {"a": 1}, [[1], [2, 3], []],
    np.array([1, 2]), None,
]  # fmt: skip


@pytest.mark.short
@pytest.mark.parametrize("value", VALUES, ids=repr)
def test_arguments_are_divided_as_by_mesa(value: Any) -> None:
    ours = world().add(Scout, 3, policy="stationary", load=value)
    theirs = Plain.create_agents(mesa.Model(), 3, load=value)
    assert [repr(scout.load) for scout in ours] == [repr(agent.load) for agent in theirs]


def test_an_agent_has_its_place_and_abilities_before_it_is_made() -> None:
    (scout,) = world().add(Scout, 1, policy="stationary", load=1, speed=0.4, position=(0.5, 0))
    assert scout.before == (0.5, 0.4, "scouts")


class Fast(Robot):
    """Sets an ability while it is made."""

    def __init__(self, model: World, rate: float) -> None:
        super().__init__(model)
        self.speed = rate


def test_what_init_sets_is_kept_by_a_reset() -> None:
    home = world()
    robots = home.add(Fast, 2, policy="random-walk", rate=[0.3, 0.4])
    robots.speed = 0.1
    home.reset()
    assert robots.speed.tolist() == [0.3, 0.4]


class Shadowing(Robot):
    """Has a parameter of the same name as one of add."""

    def __init__(self, model: World, speed: float = 1.0) -> None:
        super().__init__(model)


class Forgetful(Robot):
    """Does not call the __init__ of its base class."""

    def __init__(self, model: World) -> None:
        pass


@pytest.mark.parametrize(
    ("kind", "arguments", "message"),
    [
        (Scout, {"lod": 1}, r"lod=1: unknown; did you mean 'load'\? Scout.__init__ takes load, tag; add itself takes "),
        (Scout, {"load": 1, "sped": 1}, r"sped=1: unknown; did you mean 'speed'\?"),
        (Scout, {"tag": 1}, r"Scout.__init__ needs load; give it to add, as in add\(…, load=…\)"),
        (Robot, {"charge": 1}, r"charge=1: unknown; .*Robot.__init__ takes no arguments of its own"),
        (Shadowing, {}, "speed: is a parameter of add and of Shadowing.__init__; rename"),
        (Forgetful, {}, r"Forgetful.__init__ must call super\(\).__init__\(model\)"),
    ],
)
def test_an_argument_that_cannot_be_is_named(kind: Any, arguments: dict[str, Any], message: str) -> None:
    home = world()
    with pytest.raises(TypeError, match=message):
        home.add(kind, 2, policy="stationary", **arguments)
    assert not home.groups
    assert not len(home.agents)


def test_an_agent_without_a_group_is_refused_with_the_cure() -> None:
    home = world()
    with pytest.raises(TypeError, match=r"Robot\(…\): agents belong to a group.*world.add\(Robot, 1, policy=…\)"):
        Robot(home)
    assert not len(home.agents)


class Own(Robot):
    """Decides without a policy."""

    def decide(self, percept: Any, rng: Any) -> tuple[float, float]:
        return 0.1, 0.05


class Asking(Robot):
    """Asks the policy."""

    def decide(self, percept: Any, rng: Any) -> tuple[float, float]:
        return super().decide(percept, rng)


def test_a_class_that_decides_needs_no_policy() -> None:
    home = world()
    robots = home.add(Own, 2)
    home.run(3)
    home.reset()
    home.restore(home.state())
    home.run(1)
    assert np.hypot(*robots.bodies.moved.T) == pytest.approx([0.05, 0.05])
    home.add(Asking, 1)
    with pytest.raises(RuntimeError, match=r"super\(\).decide.*Asking was added without a policy; give one"):
        home.step()
    with pytest.raises(TypeError, match=r"policy: is missing, and Robot does not override decide;.* a-cmommt, adaptive-forces, b-cmommt"):
        home.add(Robot, 1)
    with pytest.raises(ValueError, match="policy_options=.*give policy too"):
        home.add(Own, 1, policy_options={"idle": "stay"})


def test_a_body_is_a_role_of_its_own() -> None:
    home = world()
    robots = home.add(Robot, 1, policy=Stationary(), position=(0, 0))
    beacons = home.add(Body, 2, policy="stationary", name="beacons", position=[(0.5, 0), (2, 0)])
    home.senses(beacons, robots)
    home.senses(robots, beacons, as_="beacons")
    assert beacons[0].observed_targets == [robots[0]]
    assert robots[0].observers == [beacons[0]]
    assert robots[0].sensed("beacons") == [beacons[0]]
    assert beacons[0].neighbours == []
    assert beacons[0].situation.shape == (16,)
    assert home.add(Body, 1, policy="stationary").name == "bodies"


class Rival(Robot):
    team: ClassVar[str | None] = "rivals"


def test_the_team_is_that_of_the_class_unless_given() -> None:
    home = world()
    groups = [
        home.add(Robot, 1, policy="stationary"), home.add(Rival, 2, policy="stationary"), home.add(Target, 1, policy="stationary"),
        home.add(Robot, 2, policy="stationary", team="rivals"), home.add(Target, 1, policy="stationary", team="robots"),
        home.add(Rival, 1, policy="stationary", team=None),
    ]  # fmt: skip
    teams = ["robots", "rivals", None, "rivals", "robots", None]
    assert [group.team for group in groups] == teams
    assert [group[0].team for group in groups] == teams
    assert (Robot.team, Rival.team, Target.team) == ("robots", "rivals", None)
    assert home.teammates.sizes.tolist() == [2, 4]
    home.run(2)
    with pytest.raises(AttributeError, match=r"team='robots': the group 'rivals' was added to a team; give the team"):
        groups[1][0].team = "robots"  # type: ignore[misc]
    with pytest.raises(AttributeError):
        groups[1].team = "robots"  # type: ignore[misc]
    for wrong in (3, ""):
        with pytest.raises(TypeError, match=f"team={wrong!r}: must be the name of a team"):
            home.add(Robot, 1, policy="stationary", team=wrong)  # type: ignore[arg-type]


@pytest.mark.short
def test_two_teams_hunt_each_other_on_both_paths() -> None:
    ends = []
    for advance in (lambda home: home.run(20), lambda home: [home.step() for _ in range(20)]):
        home = World(Disc(2.0), rng=3)
        hunters = home.add(Robot, 4, policy="centroid", awareness="pairwise", team="hunters", name="hunters")
        prey = home.add(Robot, 6, policy="evasive", awareness="pairwise", team="prey", name="prey", speed=0.05)
        home.senses(hunters, prey)
        home.senses(prey, hunters, counts=False)
        advance(home)
        ends.append((hunters.position.tolist(), prey.position.tolist(), home.observed_fraction, home.max_neighbours))
        for robot in home.agents:
            assert {mate.team for mate in robot.neighbours} <= {robot.team}
    assert ends[0] == ends[1]
    assert ends[0][2] > 0


def test_headings_and_positions_may_be_given() -> None:
    home = world()
    robots = home.add(Robot, 2, policy="random-walk", heading=[(3, 4), (0, -2)], position=(1, 1))
    assert robots.heading.tolist() == [[0.6, 0.8], [0, -1]]
    assert robots.position.tolist() == [[1, 1], [1, 1]]
    home.run(3)
    home.reset()
    assert robots.heading.tolist() == [[0.6, 0.8], [0, -1]]
    for wrong in ((0, 0), [(1, 0), (0, 0)], (1, float("nan")), [1, 2, 3], "east"):
        with pytest.raises((TypeError, ValueError), match="heading=.*: must be two finite numbers, not both 0"):
            home.add(Robot, 2, policy="random-walk", heading=wrong)
    with pytest.raises(ValueError, match="placement='spread': applies without position"):
        home.add(Robot, 2, policy="random-walk", placement="spread", position=(1, 1))
