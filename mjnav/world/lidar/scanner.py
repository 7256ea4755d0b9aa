"""When a lidar takes its beams: all at a reading's moment, or in packets while it turns.

A turning lidar takes its beams one after the other. Here they are cast in packets, groups of about PACKET seconds, each
from where the robot and everybody else really are at its moment; `times` tells it. So a scan of a robot that moves is
distorted as a real one is.
"""

from typing import Protocol

import numpy as np

from mjnav.messages import Array
from mjnav.scenarios.lidar import Lidar
from mjnav.scenarios.spec import Scenario
from mjnav.world.engine import Engine
from mjnav.world.grid import NEVER, Grid
from mjnav.world.lidar.returns import Returns

PACKET = 0.01  # [s]


class Scanner(Protocol):
    """A lidar on the simulator's clock of steps."""

    @property
    def next(self) -> int:
        """The step at which the next packet is due."""
        ...

    def take(self, engine: Engine, step: int) -> None:
        """Casts the packet that is due at the present step, if one is."""
        ...

    def scan(self, engine: Engine) -> tuple[Array, Array]:
        """For a reading: ranges (B,) [m] and times (B,) [s] of the beams.

        No ranges where nothing new is complete, and no times where all beams are of the reading's moment.
        """
        ...


def scanner(scenario: Scenario, seed: int) -> Scanner:
    """The lidar of a scenario."""
    lidar = scenario.sensors.scanner
    returns = Returns(lidar, scenario.noise.distributions()["lidar.range"], seed)
    return AtOnce(lidar, returns) if lidar.rate is None else Turning(lidar, lidar.rate, returns, scenario)


class AtOnce:
    """All beams at the moment of each reading."""

    next = NEVER

    def __init__(self, lidar: Lidar, returns: Returns):
        self._lidar, self._returns = lidar, returns

    def take(self, engine: Engine, step: int) -> None:
        """See `Scanner`."""

    def scan(self, engine: Engine) -> tuple[Array, Array]:
        """See `Scanner`."""
        return self._returns.measure(_cast(engine, self._lidar, self._returns, 0, len(self._lidar.angles))), np.zeros(0)


class Turning:
    """A turn after the other, in packets; of those turns that no reading brings, none is cast.

    A reading brings the turn that was completed last, once. The first reading, before which nothing was, brings a whole
    turn of its own moment.
    """

    def __init__(self, lidar: Lidar, rate: float, returns: Returns, scenario: Scenario):
        self._lidar, self._returns, self._timestep = lidar, returns, scenario.physics.timestep
        self._slots = max(1, min(round(1.0 / (rate * PACKET)), int(1.0 / (rate * self._timestep))))  # of a turn
        self._moments = Grid(1.0 / (rate * self._slots), self._timestep)
        self._readings = Grid(1.0 / scenario.sensors.rate, self._timestep)
        slot = np.floor(lidar.turn_offsets * rate * self._slots + 1e-9).astype(int)
        slots, starts = np.unique(slot, return_index=True)
        # Of each packet: its slot in the turn, its first beam, the one after its last beam.
        self._packets = list(zip(slots.tolist(), starts.tolist(), [*starts[1:].tolist(), len(slot)], strict=True))
        self._ranges = np.zeros((returns.num_rays, len(slot)))
        self._times = np.zeros(len(slot))
        self._turn, self._packet = -1, 0
        self._complete: tuple[Array, Array] | None = None
        self._is_first = True
        self._begin_turn()

    def _begin_turn(self) -> None:
        """Goes to the next turn that a reading brings: one comes after its last packet and before the next turn's."""
        last = self._packets[-1][0]
        while True:
            self._turn += 1
            completed = self._moments.step_of(self._turn * self._slots + last)
            following = self._moments.step_of((self._turn + 1) * self._slots + last)
            if self._readings.first_from(completed) < following:
                break
        self._packet = 0
        self._schedule()

    def _schedule(self) -> None:
        self.next = self._moments.step_of(self._turn * self._slots + self._packets[self._packet][0])

    def take(self, engine: Engine, step: int) -> None:
        """See `Scanner`."""
        if step < self.next:
            return
        _, start, stop = self._packets[self._packet]
        self._ranges[:, start:stop] = _cast(engine, self._lidar, self._returns, start, stop)
        self._times[start:stop] = step * self._timestep
        self._packet += 1
        if self._packet < len(self._packets):
            self._schedule()
            return
        self._complete = self._returns.measure(self._ranges), self._times.copy()
        self._begin_turn()

    def scan(self, engine: Engine) -> tuple[Array, Array]:
        """See `Scanner`."""
        if self._is_first:
            self._is_first = False
            whole = _cast(engine, self._lidar, self._returns, 0, len(self._times))
            return self._returns.measure(whole), np.zeros(0)
        complete, self._complete = self._complete or (np.zeros(0), np.zeros(0)), None
        return complete


def _cast(engine: Engine, lidar: Lidar, returns: Returns, start: int, stop: int) -> Array:
    """The exact ranges (num_rays, n) of the rays of the beams from `start` to before `stop`."""
    angles = returns.rays(start, stop)
    return engine.cast(lidar.mount, angles.reshape(-1), lidar.max_range).reshape(angles.shape)
