"""One run of a shard, by value."""

from __future__ import annotations

from typing import NamedTuple


class ShardRun(NamedTuple):
    """One run of a shard.

    Attributes
    ----------
    setting : str
        The setting's id, 16 hexadecimal digits.
    replicate : int
        The number of the replicate.
    seed : int
        The seed of the world.
    parameters : dict of str to object
        Values of the model's parameters as a study file writes them; components are texts or tables.
    """

    setting: str
    replicate: int
    seed: int
    parameters: dict[str, object]

    @property
    def id(self) -> str:
        """The run's id: the setting's id and the replicate."""
        return f"{self.setting}-{self.replicate}"
