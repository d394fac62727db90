"""Motor schemas: robots that add up the vectors of simple behaviours."""

from teamsight.policies.schemas.forage import ForageSchemas
from teamsight.policies.schemas.graze import GrazeSchemas

__all__ = ["ForageSchemas", "GrazeSchemas"]
