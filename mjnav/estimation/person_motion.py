"""Motion models of people for the trackers: constant velocity with changes, and walking and standing as two modes.

The model of two modes is for the trackers whose particles are Gaussians: people walk or stand, and change between the
two.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mjnav.constant import Constant
from mjnav.geometry.compiled import Cube, Flags, Matrix, Vector, kernel
from mjnav.messages import Array
from mjnav.sealed import sealed

# -------------------------------------------------------------------- model of the bootstrap filter


@dataclass(frozen=True, slots=True)
class PersonMotion:
    """Constant velocity with small changes always, and now and then another velocity altogether.

    Within an interval T the velocity v becomes

        v + N(0, sway^2 T I)          with probability 1 - q,  q = 1 - exp(-turn_rate T)
        N(0, walking_speed^2 I)       with probability q (1 - stop_share): a start or a turn
        0                             with probability q stop_share: a stop

    and the position moves by the mean of the old and the new velocity times T. A single Gaussian wide enough for turns
    would be useless between them: constant-velocity errors of recorded people have kurtosis 6 to 19.

    walking_speed [m/s]     std of a velocity component of which nothing is known; people walk at 1 to 1.5 m/s
    sway          [m/s/√s]  of a straight walk; also lets a few hundred particles follow a turn that none of them made
    turn_rate     [1/s]     of stops, starts and turns; more often than people do, for the same reason
    stop_share              of them that are stops: every other one, as a walk that stops goes on again
    """

    walking_speed: float = 1.0
    sway: float = 0.2
    turn_rate: float = 0.5
    stop_share: float = 0.5

    def turn_probability(self, interval: float) -> float:
        """q: that the velocity is another one after `interval` [s]."""
        return float(-np.expm1(-self.turn_rate * interval))

    def predict(self, state: Array, interval: float, uniform: ArrayLike, normal: ArrayLike) -> Array:
        """States (..., 4) after `interval` [s], by draws uniform (...) from [0, 1) and normal (..., 2) from N(0, 1)."""
        q = self.turn_probability(interval)
        state = np.asarray(state, float)
        filters = state.reshape(-1, *state.shape[-2:]) if state.ndim > 1 else state.reshape(1, 1, 4)
        shape = filters.shape[:2]
        moved = _predict(
            filters,
            np.ascontiguousarray(np.reshape(uniform, shape)),
            np.ascontiguousarray(np.reshape(normal, (*shape, 2))),
            interval,
            self.sway * sqrt(interval),
            self.walking_speed,
            q,
            q * self.stop_share,
        )
        return moved.reshape(state.shape)

    def gaussian(self, interval: float) -> tuple[Array, Array]:
        """Transition matrix and covariance (4, 4) of a constant-velocity model with a Gaussian change of velocity.

        Its variance is the mixture's for a person whose own velocity is N(0, walking_speed^2 I):
        (1 - q) sway^2 T + q (2 - stop_share) walking_speed^2 in each component.
        """
        q = self.turn_probability(interval)
        variance = (1.0 - q) * self.sway**2 * interval + q * (2.0 - self.stop_share) * self.walking_speed**2
        transition, gain = np.eye(4), np.zeros((4, 2))
        transition[:2, 2:] = interval * np.eye(2)
        gain[:2], gain[2:] = 0.5 * interval * np.eye(2), np.eye(2)
        return transition, variance * gain @ gain.T


@kernel
def _predict(
    state: Cube,
    uniform: Matrix,
    normal: Cube,
    interval: float,
    sway: float,
    walking_speed: float,
    turn: float,
    stop: float,
):
    """`PersonMotion.predict` of P x n states (P, n, 4); a velocity changes where uniform < turn, to 0 where < stop."""
    moved = np.empty(state.shape)
    for p in range(state.shape[0]):
        for i in range(state.shape[1]):
            u = uniform[p, i]
            std = sway if u >= turn else walking_speed if u >= stop else 0.0
            for axis in range(2):
                before = state[p, i, 2 + axis]
                after = std * normal[p, i, axis] + (before if u >= turn else 0.0)
                moved[p, i, axis] = state[p, i, axis] + 0.5 * interval * (before + after)
                moved[p, i, 2 + axis] = after
    return moved


# ----------------------------------------------------------------------------- walking and standing


WALKS, STANDS = True, False
MOST_WAYS = 3  # in which a particle may go on
LEAST_CHANGE = 1e-12  # least probability of a change, of `modes`


@dataclass(frozen=True, slots=True)
class StopAndGo(Constant):
    """Two modes. Within an interval T somebody who walks at v goes on, turns or stops, and who stands stays or starts:

        goes on        v + N(0, sway^2 T I)         turns, starts   N(0, walking_speed^2 I)
        stops, stays   N(0, unrest^2 I)

    is the new velocity. The position moves by the mean of the old and the new one times T and, as bodies sway about
    their way, by N(0, shuffle^2 T I). Turns, stops and starts are events of constant rates, at most one within T.

    Somebody who walks for 10 s turns twice and stops once, and stands for about 3 s. These are round numbers, but they
    were chosen after the errors of tracks in shipped scenes had been seen: with half of the rates, people who walk
    straight are tracked more smoothly still, and those who avoid one another in a crowd are lost more often. With half
    of the sway, the velocities of people who curve around others lag, and their belief does not know it.

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
    sway: float = 0.2
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

    def modes(self, interval: float) -> tuple[Array, Array, Array]:
        """Chain (3, 3), transition matrices and covariances (3, 4, 4) of standing, walking on and turning.

        Row i of the chain says where mode i goes within the interval; who stands goes on by a start, which is a turn.
        No mode is impossible altogether: a filter that nothing leads to would have no mixture to begin with.
        """
        return _modes(self, interval)

    def gaussian(self, interval: float) -> tuple[Array, Array]:
        """Transition matrix and covariance (4, 4) of constant velocity with a Gaussian change of it.

        Its variance is the mixture's, of somebody who walks as often as the rates make people do in the long run, at a
        velocity of his own ~ N(0, walking_speed^2 I).
        """
        turns, stops, starts = self.changes(interval)
        lasting = self.start_rate + self.stop_rate
        walking = self.start_rate / lasting if lasting > 0.0 else self.walking
        square = self.walking_speed**2
        walker = (1.0 - turns - stops) * self.sway**2 * interval + turns * 2.0 * square + stops * square
        walk, _, unit = _linear(interval)
        return walk, (walking * walker + (1.0 - walking) * starts * square) * unit + self.drift(interval)

    def changes(self, interval: float) -> tuple[float, float, float]:
        """Within an interval [s] the probabilities of a turn and of a stop of who walks, of a start of who stands."""
        rate = self.turn_rate + self.stop_rate
        ends = float(-np.expm1(-rate * interval))
        turns = ends * self.turn_rate / rate if rate > 0.0 else 0.0
        return turns, ends - turns, float(-np.expm1(-self.start_rate * interval))

    def drift(self, interval: float) -> Array:
        """Covariance (4, 4) of the position's sway within an interval [s]."""
        return self.shuffle**2 * interval * np.diag([1.0, 1.0, 0.0, 0.0])


@lru_cache(maxsize=8)  # asked for by every track at every reading
def _modes(motion: StopAndGo, interval: float) -> tuple[Array, Array, Array]:
    """See `StopAndGo.modes`."""
    turns, stops, starts = (max(p, LEAST_CHANGE) for p in motion.changes(interval))
    walk, anew, unit = _linear(interval)
    variances = (motion.unrest**2, motion.sway**2 * interval, motion.walking_speed**2)
    drift = motion.drift(interval)
    walker = [stops, 1.0 - turns - stops, turns]
    return (
        sealed(np.array([[1.0 - starts, 0.0, starts], walker, walker])),
        sealed(np.stack([anew, walk, anew])),
        sealed(np.stack([variance * unit + drift for variance in variances])),
    )


def _linear(interval: float) -> tuple[Array, Array, Array]:
    """Transition matrices (4, 4) of a velocity that stays and of a new one, and the covariance of a unit change."""
    walk, anew, gain = np.eye(4), np.zeros((4, 4)), np.zeros((4, 2))
    walk[:2, 2:] = interval * np.eye(2)
    anew[:2, :2], anew[:2, 2:] = np.eye(2), 0.5 * interval * np.eye(2)
    gain[:2], gain[2:] = 0.5 * interval * np.eye(2), np.eye(2)
    return walk, anew, gain @ gain.T


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
