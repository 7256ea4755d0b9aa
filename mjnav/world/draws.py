"""Draws by rows, one of each of several streams. Many are drawn at once: a call costs as much for 64 as for 1."""

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np

from mjnav.messages import Array
from mjnav.noise import Distribution
from mjnav.rng import stream

_BLOCK = 64  # rows drawn at once


class Rows(ABC):
    """Rows of draws, one a stream; row k depends on the streams alone, not on when it is drawn."""

    def __init__(self, streams: Sequence[np.random.Generator]):
        self._streams = streams
        self._rows: Array | None = None  # (_BLOCK, streams, ...)
        self._next = 0

    def row(self) -> Array:
        """The next draws, (streams, ...)."""
        if self._rows is None or self._next == _BLOCK:
            self._rows, self._next = np.stack([*map(self._drawn, range(len(self._streams)))], axis=1), 0
        self._next += 1
        return self._rows[self._next - 1].copy()

    @abstractmethod
    def _drawn(self, column: int) -> Array:
        """The next _BLOCK draws of one stream, (_BLOCK, ...)."""


class Draws(Rows):
    """Noise, from one channel's distribution in each column."""

    def __init__(self, distributions: dict[str, Distribution], columns: Sequence[tuple[str, str]], seed: int):
        """`columns` names (channel, body) of each column."""
        super().__init__([stream(seed, channel, body) for channel, body in columns])
        self._distributions = [distributions[channel] for channel, _ in columns]

    def _drawn(self, column: int) -> Array:
        return self._distributions[column].sample(self._streams[column], _BLOCK)


class Uniform(Rows):
    """Numbers in [0, 1), (streams,)."""

    def _drawn(self, column: int) -> Array:
        return self._streams[column].random(_BLOCK)


class Normal(Rows):
    """Points (streams, 2) with two standard normal numbers."""

    def _drawn(self, column: int) -> Array:
        return self._streams[column].standard_normal((_BLOCK, 2))
