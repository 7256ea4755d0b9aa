"""Time grids of a simulation, and random numbers drawn in blocks from several streams.

A `Grid` holds regular moments of simulated time, counted in steps: noise windows, sensor readings, people's decisions.

`Rows` are draws by rows, one of each of several streams. Many are drawn at once: a call costs as much for 64 as for 1.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from math import ceil

import numpy as np

from mjnav.errors import InvalidValue
from mjnav.messages import Array
from mjnav.noise.correlated import Correlated
from mjnav.rng import stream
from mjnav.scene.spec import Noise

NEVER = 2**62  # a step that no run reaches
_ROUNDING = 1e-6  # of a step: below it two moments are the same


def whole_steps(key: str, duration: float, timestep: float) -> int:
    """How many steps `duration` [s] lasts; raises InvalidValue where that is no whole number."""
    steps = duration / timestep
    whole = round(steps)
    if whole < 0 or abs(steps - whole) > _ROUNDING * max(1.0, steps):
        raise InvalidValue(key, duration, f"a whole number of steps of {timestep:g} s")
    return whole


class Grid:
    """The moments 0, T, 2 T, ...; `next` is the step at which the next one falls, the first step not before it."""

    def __init__(self, period: float, timestep: float):
        self._steps_each = max(1.0, period / timestep)
        self._index = 0
        self.next = 0

    def due(self, step: int) -> bool:
        """Whether a moment falls on `step`; each is due once."""
        if step < self.next:
            return False
        self._index += 1
        self.next = self.step_of(self._index)
        return True

    def step_of(self, index: int) -> int:
        """The step at which the moment `index` T falls."""
        return ceil(index * self._steps_each - _ROUNDING)

    def first_from(self, step: int) -> int:
        """The step of the first moment that does not fall before `step`."""
        index = max(int(step / self._steps_each) - 1, 0)
        while self.step_of(index) < step:
            index += 1
        return self.step_of(index)


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

    def __init__(self, noise: Noise, columns: Sequence[tuple[str, str]], seed: int, period: float):
        """`columns` names (channel, body) of each column; `period` [s] lies between two rows."""
        super().__init__([stream(seed, channel, body) for channel, body in columns])
        laws, times = noise.distributions(), noise.correlation_time
        self._laws = [
            Correlated(laws[channel], period, times[channel]) if channel in times else laws[channel]
            for channel, _ in columns
        ]

    def _drawn(self, column: int) -> Array:
        return self._laws[column].sample(self._streams[column], _BLOCK)


class Uniform(Rows):
    """Numbers in [0, 1), (streams,)."""

    def _drawn(self, column: int) -> Array:
        return self._streams[column].random(_BLOCK)


class Normal(Rows):
    """Points (streams, 2) with two standard normal numbers."""

    def _drawn(self, column: int) -> Array:
        return self._streams[column].standard_normal((_BLOCK, 2))
