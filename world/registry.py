"""The components of worlds that have a name; each is imported when it is first used."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from teamsight.core.registry import Registry

if TYPE_CHECKING:
    from teamsight.world.contact import Contact
    from teamsight.world.drive import Drive

ContactName = Literal["pass", "stop", "slide"]
#: What happens when bodies that have a radius meet, by name.
CONTACTS: Registry[type[Contact]] = Registry(
    {
        "pass": "teamsight.world.contact:Pass",
        "stop": "teamsight.world.contact:Stop",
        "slide": "teamsight.world.contact:Slide",
    },
    group="teamsight.contacts",
    by_reference="contact",
)

DriveName = Literal["free", "differential", "car"]
#: How the bodies of a group carry out their actions, by name.
DRIVES: Registry[type[Drive]] = Registry(
    {
        "free": "teamsight.world.drive:Free",
        "differential": "teamsight.world.drive:DifferentialDrive",
        "car": "teamsight.world.drive:Car",
    },
    group="teamsight.drives",
    by_reference="drive",
)
