"""Rao-Blackwellised particle filter of a person's position and velocity: `WalkFilter`, by the motion `StopAndGo`.

A particle is a history of walks, turns and stops; given that, position and velocity are Gaussian. The bootstrap filter
(`estimation.particle`) draws positions and velocities, so it needs many changes of velocity among its particles to
follow one, and its mean velocity trembles. Here a particle holds the whole posterior of position and velocity under its
history, and only histories compete (Doucet, de Freitas, Murphy & Russell 2000).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjnav.compile.compiled import Cube, Flags, Matrix, Vector, kernel
from mjnav.filters.mixture_kalman import GaussianSum, corrected, explained, kept, moments, sampled
from mjnav.messages import Array
from mjnav.robot.estimation.base import WALKING_SPEED

# ----------------------------------------------------------------------------- walking and standing


WALKS, STANDS = True, False
MOST_WAYS = 3  # in which a particle may go on


class StopAndGo(NamedTuple):
    """Two modes. Within an interval T somebody who walks at v goes on, turns or stops, and who stands stays or starts:

        goes on        v + N(0, sway^2 T I)         turns, starts   N(0, walking_speed^2 I)
        stops, stays   N(0, unrest^2 I)

    is the new velocity. The position moves by the mean of the old and the new one times T and, as bodies sway about
    their way, by N(0, shuffle^2 T I). Turns, stops and starts are events of constant rates, at most one within T.

    Somebody who walks for 10 s turns twice and stops once, and stands for about 3 s. These are round numbers, but they
    were chosen after the errors of tracks in shipped scenes had been seen: with half of the rates, people who walk
    straight are tracked more smoothly still, and those who avoid one another in a crowd are lost more often. With half
    of the sway, the velocities of people who curve around others lag, and their belief does not know it.

    walking_speed [m/s]     std of a velocity component of which nothing is known
    sway          [m/s/√s]  of a straight walk
    turn_rate     [1/s]     of who walks
    stop_rate     [1/s]     of who walks
    start_rate    [1/s]     of who stands
    unrest        [m/s]     std of a velocity component of who stands
    shuffle       [m/√s]    of the position
    walking       [1]       probability that somebody seen for the first time walks
    """

    walking_speed: float = WALKING_SPEED
    sway: float = 0.2
    turn_rate: float = 0.2
    stop_rate: float = 0.1
    start_rate: float = 0.3
    unrest: float = 0.03
    shuffle: float = 0.05
    walking: float = 0.5

    def variances(self, interval: float) -> tuple[float, float]:
        """Of the changes of a velocity's and a position's component within `interval` [s], by one Gaussian.

        The mixture's, of somebody who walks as often as the rates make people do in the long run, at a velocity of
        their own ~ N(0, walking_speed^2 I).
        """
        rate, lasting = self.turn_rate + self.stop_rate, self.start_rate + self.stop_rate
        ends, starts = float(-np.expm1(-rate * interval)), float(-np.expm1(-self.start_rate * interval))
        turns = ends * self.turn_rate / rate if rate > 0.0 else 0.0
        stops, square = ends - turns, self.walking_speed**2
        walking = self.start_rate / lasting if lasting > 0.0 else self.walking
        walker = (1.0 - turns - stops) * self.sway**2 * interval + turns * 2.0 * square + stops * square
        return walking * walker + (1.0 - walking) * starts * square, self.shuffle**2 * interval


@kernel
def gone_on(weights: Vector, walks: Flags, mean: Matrix, covariance: Cube, interval: float, motion: StopAndGo):
    """All ways in which n particles of `StopAndGo` may go on within `interval` [s]: weights, modes, means, covariances.

    Three of a particle that walks, two of one that stands; a way of rate 0 is left out.
    """
    n, T = len(weights), interval
    w, modes = np.empty(MOST_WAYS * n), np.empty(MOST_WAYS * n, np.bool_)
    m, P = np.empty((MOST_WAYS * n, 4)), np.empty((MOST_WAYS * n, 4, 4))
    changes = motion.turn_rate + motion.stop_rate
    ends = 1.0 - np.exp(-changes * T)
    turns = ends * motion.turn_rate / changes if changes > 0.0 else 0.0
    starts = 1.0 - np.exp(-motion.start_rate * T)
    sway, drift = motion.sway * motion.sway * T, motion.shuffle * motion.shuffle * T
    new, still = motion.walking_speed * motion.walking_speed, motion.unrest * motion.unrest
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


# ----------------------------------------------------------------------------- filter of one person


@kernel
def _predicted(
    weights: Vector, walks: Flags, mean: Matrix, covariance: Cube, num: int, offset: float, interval: float,
    motion: StopAndGo,
):  # fmt: skip
    """`gone_on` of the `num` particles that are `kept`."""
    chosen, new = kept(weights, num, offset)
    return gone_on(new, walks[chosen], mean[chosen], covariance[chosen], interval, motion)


@kernel
def _corrected(
    weights: Vector, walks: Flags, mean: Matrix, covariance: Cube, measured: Vector, age: float, share: Vector,
    bias: Matrix, noise: Cube, floor: float, num: int, offset: float,
):  # fmt: skip
    """The density of the measurement, and of all that is `explained` the `num` kept: weights, modes, moments."""
    joint = explained(weights, mean, covariance, measured, age, share, bias, noise, floor)
    chosen, new = kept(joint, num, offset)
    owner, m, P = corrected(chosen, mean, covariance, measured, age, bias, noise)
    return joint.sum(), new, walks[owner], m, P


JUDGED = 32  # particles by which it is judged whether a body could have been seen
Detectable = Callable[[Array], Array]  # points (n, 2) [m] -> probability that a body there would have been detected


class WalkFilter:
    """The belief about one person's x, y, vx, vy.

    Predict: `StopAndGo` lists the ways in which every particle may go on. Correct: `filters.mixture_kalman`, with the
    measurement's noise as a sum of Gaussians. Start: every component of that noise, with a walk and with a stand.
    """

    def __init__(self, num_particles: int, resampling: np.random.Generator, motion: StopAndGo | None = None):
        """`resampling` gives one number a step, whether it is used or not."""
        self._motion, self._num, self._resampling = motion or StopAndGo(), num_particles, resampling
        self._weights, self._walks = np.ones(0), np.ones(0, bool)
        self._mean, self._covariance = np.zeros((0, 4)), np.zeros((0, 4, 4))
        self._moments: tuple[Array, Array] | None = None

    def start(self, measured: Array, noise: GaussianSum) -> None:
        """Forgets all but a measured position (2,) [m]."""
        motion, num = self._motion, len(noise.weights)
        walks = np.repeat([WALKS, STANDS], num)
        mean, covariance = np.zeros((2 * num, 4)), np.zeros((2 * num, 4, 4))
        mean[:, :2] = measured - np.tile(noise.means, (2, 1))
        covariance[:, :2, :2] = np.tile(noise.covariances, (2, 1, 1))
        speed = np.where(walks, motion.walking_speed, motion.unrest)
        covariance[:, 2, 2] = covariance[:, 3, 3] = speed**2
        share = np.where(walks, motion.walking, 1.0 - motion.walking) * np.tile(noise.weights, 2)
        self._become(share, walks, mean, covariance)

    def predict(self, interval: float) -> None:
        """The belief after `interval` [s] of which nothing is known; one of no length changes nothing."""
        if interval <= 0.0:
            return
        self._become(*_predicted(
            self._weights, self._walks, self._mean, self._covariance, self._num, self._resampling.random(), interval,
            self._motion,
        ))  # fmt: skip

    def correct(self, measured: Array, noise: GaussianSum, *, age: float = 0.0, floor: float = 0.0) -> float:
        """Conditions on the position (2,) [m] that was measured `age` [s] before; returns its density [1/m^2] before.

        `floor` [1/m^2] is the density of a measurement that says nothing, times its probability.
        """
        density, *posterior = _corrected(
            self._weights, self._walks, self._mean, self._covariance, np.ascontiguousarray(measured, float), age,
            noise.weights, noise.means, noise.covariances, floor, self._num, self._resampling.random(),
        )  # fmt: skip
        if density > 0.0:
            self._become(*posterior)
        return density

    def density(self, measured: Array, noise: GaussianSum, *, age: float = 0.0) -> float:
        """Of a position (2,) [m] measured `age` [s] before, [1/m^2]."""
        terms = noise.weights, noise.means, noise.covariances
        measured = np.ascontiguousarray(measured, float)
        return float(explained(self._weights, self._mean, self._covariance, measured, age, *terms, 0.0).sum())

    def missed(self, detectable: Detectable) -> float:
        """Conditions on not having been detected; returns how probable a detection was.

        The JUDGED heaviest particles are weighed by the probability that a body of theirs is missed, the others by the
        mean of that. A particle is judged by the points one std to both sides of its mean, in the widest direction.
        Where a detection was certain nothing changes.
        """
        owner = np.argsort(-self._weights, kind="stable")[:JUDGED]
        values, axes = np.linalg.eigh(self._covariance[owner, :2, :2])
        offset = np.sqrt(np.maximum(values[:, 1:], 0.0)) * axes[:, :, 1]
        centre = self._mean[owner, :2]
        points = np.concatenate([centre - offset, centre + offset])
        factors = 1.0 - detectable(points).reshape(2, -1).mean(axis=0)
        mean = float(self._weights[owner] @ factors / self._weights[owner].sum())
        if mean > 0.0:
            all_factors = np.full(len(self._weights), mean)
            all_factors[owner] = factors
            weights = self._weights * all_factors
            self._become(weights / weights.sum(), self._walks, self._mean, self._covariance)
        return 1.0 - mean

    @property
    def mean(self) -> Array:
        """(4,) of all particles together."""
        return self._all[0]

    @property
    def covariance(self) -> Array:
        """(4, 4) of all particles together."""
        return self._all[1]

    def draw(self, num: int, rng: np.random.Generator) -> Array:
        """Equally weighted states, (num, 4), as many of each particle as its weight says."""
        return sampled(self._weights, rng.random(), self._mean, self._covariance, rng.standard_normal((num, 4)))

    @property
    def _all(self) -> tuple[Array, Array]:
        found = self._moments or moments(self._weights, self._mean, self._covariance)
        self._moments = found
        return found

    def _become(self, weights: Array, walks: NDArray[np.bool_], mean: Array, covariance: Array) -> None:
        self._weights, self._walks, self._mean, self._covariance = weights, walks, mean, covariance
        self._moments = None
