"""The ledger of claims: statements of the paper, each checked against simulated runs by a rule."""

from __future__ import annotations

from teamsight.analysis.paper.claims.interface import Claim, Tables, Verdict
from teamsight.analysis.paper.claims.ledger import Ledger
from teamsight.analysis.paper.claims.registry import CLAIMS, judge, needed

__all__ = ["CLAIMS", "Claim", "Ledger", "Tables", "Verdict", "judge", "needed"]
