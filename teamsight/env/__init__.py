"""Environments for reinforcement learning: one world for PettingZoo, or many worlds in one compiled call."""
