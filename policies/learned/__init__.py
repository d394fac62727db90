"""A policy that evolution found."""
from __future__ import annotations
from dataclasses import dataclass
import numpy as np
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.interface import Memory
from teamsight.policies.learned.layout import beginning
from teamsight.policies.learned.rule import decide
from teamsight.policies.learned.senses import FIELDS, ROWS, TRACKS
from teamsight.policies.tracks import IDENTITY

@dataclass(frozen=True)
class Learned(CompiledPolicy):
    constants: tuple = ()
    kernel = decide

    @property
    def draws(self) -> int:
        return 2

    @property
    def parameters(self):
        return np.asarray(self.constants, float)

    def start(self, size: int) -> Memory:
        whole = np.zeros((size, TRACKS, 3), np.int64)
        whole[:, :, IDENTITY] = -1
        return Memory(np.zeros((size, ROWS, FIELDS)), whole)

def initial(rng): return beginning(0)
