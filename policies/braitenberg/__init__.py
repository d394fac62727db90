"""Braitenberg vehicles: behaviours that lead from two sensors to two wheels, and arbiters between them."""

from teamsight.policies.braitenberg.adaptive_network import AdaptiveNetwork
from teamsight.policies.braitenberg.vehicle import FixedPriority

__all__ = ["AdaptiveNetwork", "FixedPriority"]
