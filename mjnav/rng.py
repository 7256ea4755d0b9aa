"""Named random streams: every random draw of a run comes from one of them.

A stream belongs to a channel and a body ("pose.x" of "robot", "detection.y" of "person3"). Streams of different names
are independent, and adding one changes no other, so one seed gives every method the same world.
"""

import hashlib
from struct import unpack
from typing import Any

import numpy as np


class Stream(np.random.Generator):
    """NumPy's generator on PCG64, with a deep copy in a third of the time; both go on with the same draws."""

    def __deepcopy__(self, memo: dict[int, Any]) -> "Stream":
        bits = np.random.PCG64(0)
        bits.state = self.bit_generator.state  # type: ignore[assignment] - the dictionary that it takes
        return Stream(bits)


def stream(seed: int, channel: str, body: str = "robot") -> np.random.Generator:
    """The generator of one (channel, body) under a run's seed; the same triple gives the same draws."""
    digest = hashlib.sha256(f"{channel}\0{body}".encode()).digest()
    return Stream(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=unpack("<4I", digest[:16]))))
