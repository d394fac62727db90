"""teamsight: teams of mobile robots, and how much each robot must know of its teammates.

The public names are defined in the packages ``teamsight.agents``, ``teamsight.world``, ``teamsight.policies`` and
``teamsight.analysis``; those that most scripts need can be imported from here. They are imported on first use, so that
``import teamsight`` (and ``teamsight --help``) is fast.
"""

from __future__ import annotations

import os

from teamsight.core.lazy_names import lazy_names
from teamsight.core.version import __version__

# Nothing slow is imported, because `teamsight.__main__` should handle Ctrl-C soon.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from teamsight.agents.awareness.check import check_awareness
    from teamsight.agents.body import Body, Robot, Target
    from teamsight.agents.cmommt import CMOMMT
    from teamsight.agents.components.arrivals import Arrivals, Departures
    from teamsight.agents.components.batteries import Batteries, ChargingPlaces
    from teamsight.agents.components.bumps import Bumps
    from teamsight.agents.components.durations import Constant, Exponential, Times, Weibull
    from teamsight.agents.components.failures import Failures, SensorDropouts
    from teamsight.agents.components.unreliable_awareness import UnreliableAwareness
    from teamsight.agents.controller import Controller, Detections, Relayed
    from teamsight.agents.decisions import Cycle
    from teamsight.agents.events.sources import EventSource
    from teamsight.agents.sensing.check import check_sensor
    from teamsight.agents.sensing.lidar import Lidar
    from teamsight.agents.sensing.sensor import Sensor
    from teamsight.agents.world import World
    from teamsight.analysis.runs.run_many import run_many
    from teamsight.analysis.studies.results import open_study
    from teamsight.analysis.studies.study import Study
    from teamsight.core.component import Allowed, Component
    from teamsight.policies.check import check_policy
    from teamsight.tasks.check import check_task
    from teamsight.tasks.registry import TASKS
    from teamsight.tasks.task import Objective, Task
    from teamsight.world.arena import Box, Disc, Obstructed, Torus
    from teamsight.world.check import check_arena, check_contact, check_drive, check_interaction
    from teamsight.world.contact import Contact
    from teamsight.world.drive import Car, DifferentialDrive, Drive
    from teamsight.world.interaction import Interaction
    from teamsight.world.shapes import Circle, Polygon

_HOMES = {
    "Allowed": "teamsight.core.component",
    "Component": "teamsight.core.component",
    "Body": "teamsight.agents.body",
    "CMOMMT": "teamsight.agents.cmommt",
    "Arrivals": "teamsight.agents.components.arrivals",
    "Batteries": "teamsight.agents.components.batteries",
    "Bumps": "teamsight.agents.components.bumps",
    "ChargingPlaces": "teamsight.agents.components.batteries",
    "Constant": "teamsight.agents.components.durations",
    "Departures": "teamsight.agents.components.arrivals",
    "EventSource": "teamsight.agents.events.sources",
    "Exponential": "teamsight.agents.components.durations",
    "Failures": "teamsight.agents.components.failures",
    "SensorDropouts": "teamsight.agents.components.failures",
    "Times": "teamsight.agents.components.durations",
    "UnreliableAwareness": "teamsight.agents.components.unreliable_awareness",
    "Weibull": "teamsight.agents.components.durations",
    "Controller": "teamsight.agents.controller",
    "Relayed": "teamsight.agents.controller",
    "Detections": "teamsight.agents.controller",
    "Cycle": "teamsight.agents.decisions",
    "World": "teamsight.agents.world",
    "Robot": "teamsight.agents.body",
    "Lidar": "teamsight.agents.sensing.lidar",
    "Sensor": "teamsight.agents.sensing.sensor",
    "Target": "teamsight.agents.body",
    "Disc": "teamsight.world.arena",
    "Box": "teamsight.world.arena",
    "Torus": "teamsight.world.arena",
    "Circle": "teamsight.world.shapes",
    "Obstructed": "teamsight.world.arena",
    "Car": "teamsight.world.drive",
    "Contact": "teamsight.world.contact",
    "DifferentialDrive": "teamsight.world.drive",
    "Drive": "teamsight.world.drive",
    "Interaction": "teamsight.world.interaction",
    "Polygon": "teamsight.world.shapes",
    "check_arena": "teamsight.world.check",
    "check_awareness": "teamsight.agents.awareness.check",
    "check_contact": "teamsight.world.check",
    "check_drive": "teamsight.world.check",
    "check_interaction": "teamsight.world.check",
    "check_policy": "teamsight.policies.check",
    "check_sensor": "teamsight.agents.sensing.check",
    "check_task": "teamsight.tasks.check",
    "Objective": "teamsight.tasks.task",
    "TASKS": "teamsight.tasks.registry",
    "Task": "teamsight.tasks.task",
    "open_study": "teamsight.analysis.studies.results",
    "run_many": "teamsight.analysis.runs.run_many",
    "Study": "teamsight.analysis.studies.study",
}

__all__ = [
    "CMOMMT", "TASKS", "Allowed", "Arrivals", "Batteries", "Body", "Box", "Bumps", "Car", "ChargingPlaces", "Circle",
    "Component", "Constant", "Contact", "Controller", "Cycle", "Departures", "Detections", "DifferentialDrive", "Disc",
    "Drive", "EventSource", "Exponential", "Failures", "Interaction", "Lidar", "Objective", "Obstructed", "Polygon",
    "Relayed", "Robot", "Sensor", "SensorDropouts", "Study", "Target", "Task", "Times", "Torus", "UnreliableAwareness",
    "Weibull", "World", "__version__", "check_arena", "check_awareness", "check_contact", "check_drive",
    "check_interaction", "check_policy", "check_sensor", "check_task", "open_study", "run_many",
]  # fmt: skip

# In a checkout without symbolic links, as under Windows, the four packages are at the top of the repository only.
_HERE = os.path.dirname(os.path.realpath(__file__))
_ROOT = os.path.dirname(_HERE)
if not os.path.isdir(os.path.join(_HERE, "agents")) and os.path.isfile(os.path.join(_ROOT, "agents", "cmommt.py")):
    __path__.insert(0, _ROOT)

__getattr__ = lazy_names(__name__, _HOMES, globals())
