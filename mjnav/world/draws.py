"""Noise by rows: one draw of each of several channels, every one from its own stream."""

from collections.abc import Sequence

import numpy as np

from mjnav.messages import Array
from mjnav.noise import Distribution
from mjnav.rng import stream

_BLOCK = 64  # rows drawn at once: one call of `sample` costs as much for 64 values as for 1


class Draws:
    """Rows of draws; row k depends on the seed alone, not on when it is drawn."""

    def __init__(self, distributions: dict[str, Distribution], columns: Sequence[tuple[str, str]], seed: int):
        """`columns` names (channel, body) of each column."""
        self._columns = [(distributions[channel], stream(seed, channel, body)) for channel, body in columns]
        self._block = np.zeros((_BLOCK, len(self._columns)))
        self._row = _BLOCK

    def row(self) -> Array:
        """The next draws, one a column."""
        if self._row == _BLOCK:
            for j, (distribution, rng) in enumerate(self._columns):
                self._block[:, j] = distribution.sample(rng, _BLOCK)
            self._row = 0
        self._row += 1
        return self._block[self._row - 1].copy()
