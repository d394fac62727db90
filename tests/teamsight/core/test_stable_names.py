"""Seeds, ids of settings and study files hold names of classes: they stay when a class moves or is renamed."""

from __future__ import annotations

import pytest

from teamsight import CMOMMT, Failures, Study
from teamsight.core import references
from teamsight.core.references import load, reference_to, stable_name

pytestmark = pytest.mark.short

# As they were before anything moved. No line changes: for a class that has moved, `references.MOVED` gets a row.
NAMES = ["teamsight.agents.awareness.nearest:NearestAwareness", "teamsight.agents.awareness.none:NoAwareness", "teamsight.agents.awareness.pairwise:PairwiseAwareness", "teamsight.agents.awareness.ring:RingAwareness", "teamsight.agents.awareness.shared:SharedAwareness", "teamsight.agents.cmommt:CMOMMT", "teamsight.agents.components.arrivals:Arrivals", "teamsight.agents.components.arrivals:Departures", "teamsight.agents.components.batteries:Batteries", "teamsight.agents.components.charging_places:ChargingPlaces", "teamsight.agents.components.durations:Constant", "teamsight.agents.components.durations:Exponential", "teamsight.agents.components.durations:Weibull", "teamsight.agents.components.failures:Failures", "teamsight.agents.components.sensor_dropouts:SensorDropouts", "teamsight.agents.components.unreliable_awareness:UnreliableAwareness", "teamsight.agents.decisions.cycle:Cycle", "teamsight.agents.events.contact_log:ContactLog", "teamsight.agents.events.observation_counts:ObservationCounts", "teamsight.agents.events.recurring:Recurring", "teamsight.agents.sensing.sensor:Sensor", "teamsight.policies.basis.basis_behaviours:BasisBehaviours", "teamsight.policies.braitenberg.adaptive_network:AdaptiveNetwork", "teamsight.policies.braitenberg.fixed_priority:FixedPriority", "teamsight.policies.braitenberg.vehicle:Vehicle", "teamsight.policies.eager.linear:LinearQ", "teamsight.policies.eager.tabular:TabularQ", "teamsight.policies.evolved.policy:Evolved", "teamsight.policies.handmade.a_cmommt:ACmommt", "teamsight.policies.handmade.b_cmommt:BCmommt", "teamsight.policies.handmade.centroid:Centroid", "teamsight.policies.handmade.evasive:Evasive", "teamsight.policies.handmade.follow_free:FollowFree", "teamsight.policies.handmade.p_cmommt:PCmommt", "teamsight.policies.handmade.random_walk:RandomWalk", "teamsight.policies.handmade.seek_charger:SeekCharger", "teamsight.policies.handmade.stationary:Stationary", "teamsight.policies.handmade.surround_prey:SurroundPrey", "teamsight.policies.lazy.lazy_q:LazyQ", "teamsight.policies.lazy.lazy_regression:LazyRegression", "teamsight.policies.lazy.pessimistic_lazy_q:PessimisticLazyQ", "teamsight.policies.lazy.sheppard_lazy_q:SheppardLazyQ", "teamsight.policies.online.lattice_walk:LatticeWalk", "teamsight.policies.online.modular_q:ModularQ", "teamsight.policies.online.online_q:OnlineQ", "teamsight.policies.online.prey_q:PreyQ", "teamsight.policies.schemas.forage:ForageSchemas", "teamsight.policies.schemas.graze:GrazeSchemas", "teamsight.tasks.collecting.pucks:Collecting", "teamsight.tasks.collecting.world:PuckCollecting", "teamsight.tasks.foraging.carrying:Carrying", "teamsight.tasks.foraging.consuming:Consuming", "teamsight.tasks.foraging.grazing:Grazing", "teamsight.tasks.foraging.worlds:Consume", "teamsight.tasks.foraging.worlds:Forage", "teamsight.tasks.foraging.worlds:Graze", "teamsight.tasks.pursuit.capture:Capture", "teamsight.tasks.pursuit.surround:Surround", "teamsight.tasks.pursuit.world:Pursuit", "teamsight.tasks.pushing.box_law:Pushing", "teamsight.tasks.pushing.world:BoxPushing", "teamsight.world.arena:Box", "teamsight.world.arena:Disc", "teamsight.world.arena:Torus", "teamsight.world.circle:Circle", "teamsight.world.polygon:Polygon"]


@pytest.mark.parametrize("name", NAMES)
def test_the_name_of_a_component_stays(name: str) -> None:
    found = load(name)
    assert isinstance(found, type)
    assert reference_to(found) == name
    assert stable_name(found) == name.partition(":")[2]


def test_a_class_that_has_moved_is_found_by_its_old_name_and_keeps_seeds_and_ids(
    monkeypatch: pytest.MonkeyPatch
) -> None:
    """As if Failures had another name and place before."""

    def study() -> Study:
        return Study(fixed={"events": Failures(20.0, 5.0)}, pairing="none")

    def table() -> str:
        world = CMOMMT(events=Failures(5.0, 5.0), rng=1)
        world.run(30)
        return world.events[["time", "agent", "what"]].to_csv()

    now, noise = study().plan(), table()
    name = "teamsight.agents.components.failures:Failures"
    monkeypatch.setitem(references.MOVED, "teamsight.agents.faults:Faults", name)
    assert load("teamsight.agents.faults:Faults") is Failures
    assert reference_to(Failures) == "teamsight.agents.faults:Faults"
    assert stable_name(Failures) == "Faults"
    then = study().plan()
    assert then.ids.tolist() != now.ids.tolist()
    assert then.seed(0, 0) != now.seed(0, 0)
    assert table() != noise
    assert Study(**(study().as_dict() | {"path": None})).plan().ids.tolist() == then.ids.tolist()


def test_classes_of_a_user_have_the_name_that_they_have() -> None:
    class Failures(CMOMMT):  # as one of ours, in another module
        pass

    assert stable_name(Failures) == "Failures"
