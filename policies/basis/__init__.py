"""Basis behaviours: robots that choose among a few behaviours by a few conditions, and learn which suits which."""

from teamsight.policies.basis.basis_behaviours import CLEAR_ROWS, CORRECT, BasisBehaviours, share_correct

__all__ = ["CLEAR_ROWS", "CORRECT", "BasisBehaviours", "share_correct"]
