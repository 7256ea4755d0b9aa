"""How people move for the trackers whose particles are Gaussians: they walk or stand, and change between the two."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mjnav.constant import Constant
from mjnav.geometry.compiled import kernel
from mjnav.geometry.kernel_types import Cube, Flags, Matrix, Vector

WALKS, STANDS = True, False
MOST_WAYS = 3  # in which a particle may go on


@dataclass(frozen=True, slots=True)
class StopAndGo(Constant):
    """Two modes. Within an interval T somebody who walks at v goes on, turns or stops, and who stands stays or starts:

        goes on        v + N(0, sway^2 T I)         turns, starts   N(0, walking_speed^2 I)
        stops, stays   N(0, unrest^2 I)

    is the new velocity. The position moves by the mean of the old and the new one times T and, as bodies sway about
    their way, by N(0, shuffle^2 T I). Turns, stops and starts are events of constant rates, at most one within T.

    Somebody who walks for 10 s turns twice and stops once, and stands for about 3 s. These are round numbers, but they
    were chosen after the errors of tracks in shipped scenes had been seen: with half of the rates, people who walk
    straight are tracked more smoothly still, and those who avoid one another in a crowd are lost more often.

    walking_speed [m/s]     std of a velocity component of which nothing is known; people walk at 1 to 1.5 m/s
    sway          [m/s/√s]  of a straight walk
    turn_rate     [1/s]     of who walks
    stop_rate     [1/s]     of who walks
    start_rate    [1/s]     of who stands
    unrest        [m/s]     std of a velocity component of who stands
    shuffle       [m/√s]    of the position
    walking       [1]       probability that somebody seen for the first time walks
    """

    walking_speed: float = 1.0
    sway: float = 0.1
    turn_rate: float = 0.2
    stop_rate: float = 0.1
    start_rate: float = 0.3
    unrest: float = 0.03
    shuffle: float = 0.05
    walking: float = 0.5

    @property
    def rates(self) -> "Rates":
        """What the kernel needs."""
        return Rates(
            self.walking_speed, self.sway, self.turn_rate, self.stop_rate, self.start_rate, self.unrest, self.shuffle
        )


class Rates(NamedTuple):
    """`StopAndGo` for kernels."""

    walking_speed: float
    sway: float
    turn_rate: float
    stop_rate: float
    start_rate: float
    unrest: float
    shuffle: float


@kernel
def gone_on(weights: Vector, walks: Flags, mean: Matrix, covariance: Cube, interval: float, rates: Rates):
    """All ways in which n particles of `StopAndGo` may go on within `interval` [s]: weights, modes, means, covariances.

    Three of a particle that walks, two of one that stands; a way of rate 0 is left out.
    """
    n, T = len(weights), interval
    w, modes = np.empty(MOST_WAYS * n), np.empty(MOST_WAYS * n, np.bool_)
    m, P = np.empty((MOST_WAYS * n, 4)), np.empty((MOST_WAYS * n, 4, 4))
    changes = rates.turn_rate + rates.stop_rate
    ends = 1.0 - np.exp(-changes * T)
    turns = ends * rates.turn_rate / changes if changes > 0.0 else 0.0
    starts = 1.0 - np.exp(-rates.start_rate * T)
    sway, drift = rates.sway * rates.sway * T, rates.shuffle * rates.shuffle * T
    new, still = rates.walking_speed * rates.walking_speed, rates.unrest * rates.unrest
    count = 0
    for i in range(n):
        if walks[i]:
            w[count], modes[count] = weights[i] * (1.0 - ends), True
            _walk_on(m[count], P[count], mean[i], covariance[i], T, sway, drift)
            count += 1
        fresh, stand = (turns, ends - turns) if walks[i] else (starts, 1.0 - starts)
        if fresh > 0.0:
            w[count], modes[count] = weights[i] * fresh, True
            _begin_anew(m[count], P[count], mean[i], covariance[i], T, new, drift)
            count += 1
        if stand > 0.0:
            w[count], modes[count] = weights[i] * stand, False
            _begin_anew(m[count], P[count], mean[i], covariance[i], T, still, drift)
            count += 1
    return w[:count], modes[:count], m[:count], P[:count]


@kernel
def _walk_on(m, P, mean, before, T, sway, drift):
    """Moments m (4,), P (4, 4) after T of v' = v + N(0, sway I), x' = x + T (v + v') / 2 + N(0, drift I)."""
    for a in range(2):
        m[a], m[2 + a] = mean[a] + T * mean[2 + a], mean[2 + a]
        for b in range(2):
            vv = before[2 + a, 2 + b]
            noise = sway if a == b else 0.0
            P[a, b] = before[a, b] + T * (before[a, 2 + b] + before[2 + a, b]) + T * T * (vv + 0.25 * noise)
            P[a, b] += drift if a == b else 0.0
            P[a, 2 + b] = before[a, 2 + b] + T * (vv + 0.5 * noise)
            P[2 + a, b] = before[2 + a, b] + T * (vv + 0.5 * noise)
            P[2 + a, 2 + b] = vv + noise


@kernel
def _begin_anew(m, P, mean, before, T, variance, drift):
    """The same of v' = N(0, variance I)."""
    for a in range(2):
        m[a], m[2 + a] = mean[a] + 0.5 * T * mean[2 + a], 0.0
        for b in range(2):
            own = variance if a == b else 0.0
            old = before[a, b] + 0.5 * T * (before[a, 2 + b] + before[2 + a, b])
            P[a, b] = old + 0.25 * T * T * (before[2 + a, 2 + b] + own) + (drift if a == b else 0.0)
            P[a, 2 + b] = P[2 + a, b] = 0.5 * T * own
            P[2 + a, 2 + b] = own
