"""Counter-based noise: every random number is a pure function of (key, stream, identity, tick, channel).

So it does not depend on how a run is divided into calls, on the other agents in the world, or on their order.

Notes
-----
*Source:* J. K. Salmon, M. A. Moraes, R. O. Dror and D. E. Shaw, "Parallel random numbers: as easy as 1, 2, 3",
SC 2011 (Philox 4×32-10). One block of four words serves four consecutive ticks of one channel: the counter is
(tick // 4, identity, channel, stream), and word ``tick % 4`` of the block becomes the number (word + ½) / 2³².
"""

from __future__ import annotations

import hashlib
from enum import IntEnum
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, Record, inlined, kernel

_LOW = np.uint64(0xFFFFFFFF)
_SHIFT = np.uint64(32)
_MULTIPLIER_0 = np.uint64(0xD2511F53)
_MULTIPLIER_1 = np.uint64(0xCD9E8D57)
_WEYL_0 = np.uint64(0x9E3779B9)
_WEYL_1 = np.uint64(0xBB67AE85)

TICKS_A_BLOCK = 4
#: The number of ticks after which noise repeats: the counter of blocks has 32 bits.
PERIOD = TICKS_A_BLOCK << 32
LANES = 8


class Block(NamedTuple):
    """The record of a call of `fill_block`."""

    block: Annotated[npt.NDArray[np.float64], TICKS_A_BLOCK, "channels", "n"]
    key: Annotated[npt.NDArray[np.uint64], 2]
    stream: int
    tick: int
    identity: Annotated[npt.NDArray[np.int64], "n"]


BLOCK = Record(Block)
block_at = BLOCK.at


class Stream(IntEnum):
    """The uses of noise. A group of agents has one stream of each kind; see `stream_number`."""

    PLACEMENT = 0
    POLICY = 1
    CALLABLE = 2
    SENSOR = 3
    CYCLE = 4
    EVENTS = 5
    INTERACTION = 6


def stream_number(stream: Stream, group: int) -> int:
    """Return the number of a stream of a group; it differs between kinds and between groups."""
    return int(stream) | group << 8


def key_of(seed: int) -> npt.NDArray[np.uint64]:
    """Return the key of a seed: two 32-bit words, as an array of shape (2,)."""
    return _key_of_text(str(seed), b"teamsight")


def key_within(key: npt.NDArray[np.uint64], name: str) -> npt.NDArray[np.uint64]:
    """Return the key that belongs to a name within a world with this key, as an array of shape (2,)."""
    return _key_of_text(f"{int(key[0])} {int(key[1])} {name}", b"teamsight source")


def _key_of_text(text: str, use: bytes) -> npt.NDArray[np.uint64]:
    word = hashlib.blake2b(text.encode(), digest_size=8, person=use).digest()
    return np.frombuffer(word, "<u4").astype(np.uint64)


@inlined
def _round(c0: Any, c1: Any, c2: Any, c3: Any, k0: Any, k1: Any) -> tuple[Any, Any, Any, Any]:
    product_0 = _MULTIPLIER_0 * c0
    product_1 = _MULTIPLIER_1 * c2
    return (product_1 >> _SHIFT) ^ c1 ^ k0, product_1 & _LOW, (product_0 >> _SHIFT) ^ c3 ^ k1, product_0 & _LOW


@inlined
def philox(
    counter_0: np.uint64, counter_1: np.uint64, counter_2: np.uint64, counter_3: np.uint64, k0: np.uint64, k1: np.uint64
) -> tuple[np.uint64, np.uint64, np.uint64, np.uint64]:
    """Return the block of Philox 4×32-10 at this counter: four 32-bit words, each held in 64 bits."""
    # The masks change nothing, but show the compiler that factors have 32 bits, so that it uses SIMD lanes.
    c0 = counter_0 & _LOW
    c1 = counter_1 & _LOW
    c2 = counter_2 & _LOW
    c3 = counter_3 & _LOW
    k0 = k0 & _LOW
    k1 = k1 & _LOW
    # Written out, because the compiler uses SIMD lanes only for loops that have no loop inside.
    c0, c1, c2, c3 = _round(c0, c1, c2, c3, k0, k1)
    c0, c1, c2, c3 = _round(c0, c1, c2, c3, (k0 + np.uint64(1) * _WEYL_0) & _LOW, (k1 + np.uint64(1) * _WEYL_1) & _LOW)
    c0, c1, c2, c3 = _round(c0, c1, c2, c3, (k0 + np.uint64(2) * _WEYL_0) & _LOW, (k1 + np.uint64(2) * _WEYL_1) & _LOW)
    c0, c1, c2, c3 = _round(c0, c1, c2, c3, (k0 + np.uint64(3) * _WEYL_0) & _LOW, (k1 + np.uint64(3) * _WEYL_1) & _LOW)
    c0, c1, c2, c3 = _round(c0, c1, c2, c3, (k0 + np.uint64(4) * _WEYL_0) & _LOW, (k1 + np.uint64(4) * _WEYL_1) & _LOW)
    c0, c1, c2, c3 = _round(c0, c1, c2, c3, (k0 + np.uint64(5) * _WEYL_0) & _LOW, (k1 + np.uint64(5) * _WEYL_1) & _LOW)
    c0, c1, c2, c3 = _round(c0, c1, c2, c3, (k0 + np.uint64(6) * _WEYL_0) & _LOW, (k1 + np.uint64(6) * _WEYL_1) & _LOW)
    c0, c1, c2, c3 = _round(c0, c1, c2, c3, (k0 + np.uint64(7) * _WEYL_0) & _LOW, (k1 + np.uint64(7) * _WEYL_1) & _LOW)
    c0, c1, c2, c3 = _round(c0, c1, c2, c3, (k0 + np.uint64(8) * _WEYL_0) & _LOW, (k1 + np.uint64(8) * _WEYL_1) & _LOW)
    c0, c1, c2, c3 = _round(c0, c1, c2, c3, (k0 + np.uint64(9) * _WEYL_0) & _LOW, (k1 + np.uint64(9) * _WEYL_1) & _LOW)
    return c0, c1, c2, c3


@kernel
def fill_block(block: Any, key: Any, stream: int, tick: int, identity: Any) -> None:
    """Write the numbers of the four ticks around `tick`.

    Parameters
    ----------
    block : ndarray, shape (4, channels, n), float64
        Written: axis 0 is ``tick % 4``. SIMD lanes are eight wide, so `n` is best a multiple of `LANES`.
    key : ndarray, shape (2,), uint64
        From `key_of`.
    stream, tick : int
        The stream's number and any tick of the block.
    identity : ndarray, shape (n,), int64
        The agents.
    """
    four = np.uint64(tick // TICKS_A_BLOCK)
    k0 = key[0]
    k1 = key[1]
    for channel in range(block.shape[1]):
        for i in range(identity.shape[0]):
            a, b, c, d = philox(four, np.uint64(identity[i]), np.uint64(channel), np.uint64(stream), k0, k1)
            block[0, channel, i] = (np.float64(np.int64(a)) + 0.5) * 2.0**-32
            block[1, channel, i] = (np.float64(np.int64(b)) + 0.5) * 2.0**-32
            block[2, channel, i] = (np.float64(np.int64(c)) + 0.5) * 2.0**-32
            block[3, channel, i] = (np.float64(np.int64(d)) + 0.5) * 2.0**-32


def _fill(address: int) -> int:
    block = block_at(address)
    fill_block(block.block, block.key, block.stream, block.tick, block.identity)
    return 0


_FILL = Entry(_fill)


def uniforms(
    key: npt.NDArray[np.uint64], stream: int, tick: int, identity: npt.NDArray[np.int64], channels: int
) -> npt.NDArray[np.float64]:
    """Return uniform numbers in (0, 1), one row per channel.

    Parameters
    ----------
    key : ndarray, shape (2,), uint64
        From `key_of`.
    stream, tick : int
        The stream's number and the tick.
    identity : ndarray, shape (n,), int64
        The agents.
    channels : int
        The number of values for each agent.

    Returns
    -------
    ndarray, shape (channels, n), float64
    """
    return np.asarray(uniforms_of_block(key, stream, tick, identity, channels)[tick % TICKS_A_BLOCK])


def uniforms_of_block(
    key: npt.NDArray[np.uint64], stream: int, tick: int, identity: npt.NDArray[np.int64], channels: int
) -> npt.NDArray[np.float64]:
    """Return the numbers of `uniforms` of the four ticks around `tick`, shape (4, channels, n), at the cost of one."""
    identity = np.ascontiguousarray(identity, np.int64)
    block = np.empty((TICKS_A_BLOCK, channels, len(identity)))
    _FILL(BLOCK.pack(Block(block, key, stream, tick, identity)))
    return block


def generator(key: npt.NDArray[np.uint64], stream: int, tick: int, identity: int) -> np.random.Generator:
    """Return the generator of one agent at one tick, for policies that are callables for one robot."""
    words = int(key[0]) | int(key[1]) << 32
    return np.random.Generator(np.random.Philox(key=words, counter=[0, tick, identity, stream]))
