"""The ledger of claims: what the paper states, checked by code against what was simulated."""

from __future__ import annotations

from teamsight.analysis.paper.claims.interface import Claim, Tables, Verdict
from teamsight.analysis.paper.claims.ledger import CLAIMS, Ledger, judge, needed

__all__ = ["CLAIMS", "Claim", "Ledger", "Tables", "Verdict", "judge", "needed"]
