"""`mixture`: every sample goes on, stops, or turns left or right; the person's motion so far says how likely each is.

A sample's velocity v follows a target u within the relaxation time tau,

    v' = (u - v) / tau,   so that   x(t) = x + u t + (v - u) tau (1 - exp(-t / tau)),

(the driving force of Helbing & Molnár 1995, "Social force model for pedestrian dynamics", which has tau = 0.5 s). The
mode decides the target:

    goes on       u = v, its own velocity; of a person who stands, the velocity of before the stop
    stops         u = 0
    turns         u = the velocity of going on, turned by an angle from U(0, turn_angle), left or right

Modes change as a Markov chain does: going on ends at the rates `stop_rate` and `turn_rate`, a stop at `go_rate`, a turn
after about 2 tau. A sample that goes on or stands changes at most once within the horizon, at an exponential time.

Nobody walks quite straight: each sample that does not stand is x(t) + sway sqrt(t^3 / 3) z besides, z one draw of
N(0, I) for all t, which is the spread at every time t of a velocity that diffuses by sway sqrt(t).

The weights w of a person's modes are those of an interacting multiple model (Blom & Bar-Shalom 1988): a Kalman filter
of the velocity in each mode, with every new track's mean velocity z as its measurement,

    v_k  <-  v_k, exp(-T / tau) v_k, or v_k turned by +-w T        after T, with variance P_k + SWAY^2 T
    w_k  <-  c ((1 - epsilon) N(z; v_k, (P_k + velocity_noise^2) I) + floor) sum_j P(j -> k, T) w_j

so that an outlier among the tracks moves no weight far. `velocity_noise` is what the default tracker does at 10 Hz to
somebody who walks straight on in `crossing1`. The rates are round assumptions, not fitted to anything: somebody who
walks for 10 s turns once and stops every other time, and stands for about 3 s. `sway` is no such assumption: the term
and its value were chosen after the errors of constant velocity on two recordings (ETH hotel, UCY zara01) had been seen,
so the spread that it gives is not tested by figures on those.
"""

from dataclasses import dataclass
from math import exp

import numpy as np

from mjnav.compile.compiled import Cube, Matrix, Vector, kernel
from mjnav.messages import Array, Track
from mjnav.rng import stream
from mjnav.robot.prediction.base import Crowd, Futures
from mjnav.scene.prediction import MixtureModel, Prediction

MODES = ("goes_on", "stops", "turns_left", "turns_right")
GOES_ON, STOPS, LEFT, RIGHT = range(len(MODES))
STANDS = 0.2  # [m/s] mean speed below which somebody stands
CRUISE_TIME = 1.0  # [s] over which the velocity of going on is averaged
SWAY = 0.2  # [m/s/√s] that the filter allows for, as `estimation.walk_filter` does
EPSILON, FASTEST = 0.01, 2.0  # share of outliers among the tracks, of any velocity up to that [m/s]
TINY = 1e-300


@dataclass(frozen=True, slots=True)
class ModeBelief:
    """How one person goes on."""

    time: float  # [s] of the track
    weights: Array  # (4,) of MODES, sum 1
    velocities: Array  # (4, 2) [m/s] v_k
    variances: Array  # (4,) [m^2/s^2] P_k, of each component
    cruise: Array  # (2,) [m/s] averaged while the person did not stop

    @property
    def velocity(self) -> Array:
        """The mean over the modes, (2,) [m/s]."""
        return self.weights @ self.velocities

    @property
    def stands(self) -> bool:
        """Whether the person hardly moves."""
        return bool(np.hypot(*self.velocity) < STANDS)


class Mixture:
    """The modes' weights of every person who has a track; a person who comes anew begins anew."""

    def __init__(self, prediction: Prediction, model: MixtureModel, seed: int):
        self._step, self._num, self._model, self._seed = prediction.step, prediction.num_steps, model, seed
        self._streams: dict[str, np.random.Generator] = {}
        self.modes: dict[str, ModeBelief] = {}  # by the person's name

    def predict(self, crowd: Crowd) -> Futures:
        """See `Predictor`."""
        chains: dict[float, Array] = {}  # by the interval: it is the same for nearly everybody
        self.modes = {track.name: self._follow(track, chains) for track in crowd.tracks}
        num_people, num = crowd.samples.shape[:2]
        state = np.array(crowd.samples, order="C").reshape(-1, 4)
        first, second, change, sway = self._targets(crowd)
        paths, velocity = np.empty((len(state), self._num + 1, 2)), np.empty((len(state), 2))
        follow_targets(
            paths, velocity, state, first.reshape(-1, 2), second.reshape(-1, 2), change.ravel(), sway.reshape(-1, 2),
            np.repeat(crowd.elapsed.ravel(), num), self._step, self._model.relaxation_time,
        )  # fmt: skip
        paths = paths.reshape(num_people, num, self._num + 1, 2)
        return Futures(paths[:, :, 0], velocity.reshape(num_people, num, 2), paths[:, :, 1:], self._step)

    def _follow(self, track: Track, chains: dict[float, Array]) -> ModeBelief:
        """The belief of a person's modes after a track."""
        before, measured, model = self.modes.get(track.name), np.array(track.mean[2:], order="C"), self._model
        if before is None or track.recovered or track.time < before.time:
            num, noise = len(MODES), model.velocity_noise**2
            weights, velocities = np.eye(num)[GOES_ON], np.tile(measured, (num, 1))
            return ModeBelief(track.time, weights, velocities, np.full(num, noise), measured)
        interval = track.time - before.time
        if interval == 0.0:
            return before
        if interval not in chains:
            chains[interval] = transition(model, interval)
        angle = 0.25 * model.turn_angle / model.relaxation_time * interval  # the mean turn takes about 2 tau
        weights, velocities, variances = expect(
            before.weights, before.velocities, before.variances, before.cruise, before.stands, chains[interval],
            exp(-interval / model.relaxation_time), angle, SWAY**2 * interval,
        )  # fmt: skip
        correct(weights, velocities, variances, measured, model.velocity_noise**2)
        follows = (1.0 - weights[STOPS]) * (1.0 - exp(-interval / CRUISE_TIME))
        cruise = before.cruise + follows * (weights @ velocities - before.cruise)
        return ModeBelief(track.time, weights, velocities, variances, cruise)

    def _targets(self, crowd: Crowd) -> tuple[Array, Array, Array, Array]:
        """Of all samples: the targets at first and later, (P, M, 2) each, when they change [s] (P, M), and sway z."""
        model, (num_people, num) = self._model, crowd.samples.shape[:2]
        mode, draws = np.empty((num_people, num), int), np.empty((3, num_people, num))
        walk, sway = np.array(crowd.samples[..., 2:]), np.empty((num_people, num, 2))
        cruise = np.empty((num_people, 1, 2))
        for p, track in enumerate(crowd.tracks):
            belief, rng = self.modes[track.name], self._stream(track.name)
            # As many samples of each mode as its weight says, in random order.
            shares = (np.arange(num) + rng.random()) / num
            mode[p] = np.searchsorted(np.cumsum(belief.weights), shares)[rng.permutation(num)]
            rng.random(out=draws[0, p])
            rng.random(out=draws[1, p])
            rng.random(out=draws[2, p])
            rng.standard_normal(out=sway[p])
            cruise[p] = belief.cruise
            if belief.stands:
                walk[p] = belief.cruise
                sway[p] = 0.0
        when, what, share = draws
        turns, stands = _turn_share(model), (mode == STOPS)[..., None]
        goes_on = mode == GOES_ON
        to_right = (mode >= RIGHT) | (goes_on & (what > 1.0 - 0.5 * turns))
        beside = turned(walk, np.where(to_right, -model.turn_angle, model.turn_angle) * share)
        after_walk = np.where((what > 1.0 - turns)[..., None], beside, 0.0)
        first = np.where(goes_on[..., None], walk, np.where(stands, 0.0, beside))
        second = np.where(goes_on[..., None], after_walk, np.where(stands, cruise, beside))
        rate = np.where(goes_on, model.stop_rate + model.turn_rate, np.where(stands[..., 0], model.go_rate, 0.0))
        change = np.full(rate.shape, np.inf)
        np.divide(-np.log1p(-when), rate, out=change, where=rate > 0.0)
        return first, second, change, np.where(stands, 0.0, model.sway * sway)

    def _stream(self, name: str) -> np.random.Generator:
        if name not in self._streams:
            self._streams[name] = stream(self._seed, "prediction.modes", name)
        return self._streams[name]


def _turn_share(model: MixtureModel) -> float:
    """The share of turns among what ends a straight walk."""
    return model.turn_rate / max(model.stop_rate + model.turn_rate, TINY)


def transition(model: MixtureModel, interval: float) -> Array:
    """P(j -> k) of the modes within an interval [s], (4, 4), rows j; at most one change."""
    out = np.eye(len(MODES))
    ends = -np.expm1(-(model.stop_rate + model.turn_rate) * interval)
    turns = ends * _turn_share(model)
    out[GOES_ON] = 1.0 - ends, ends - turns, 0.5 * turns, 0.5 * turns
    for mode, rate in (
        (STOPS, model.go_rate),
        (LEFT, 0.5 / model.relaxation_time),
        (RIGHT, 0.5 / model.relaxation_time),
    ):
        over = -np.expm1(-rate * interval)
        out[mode, [mode, GOES_ON]] = 1.0 - over, over
    return out


def turned(vectors: Array, angle: Array | float) -> Array:
    """Vectors (..., 2) turned counter-clockwise by angles (...) [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


@kernel
def expect(
    weights: Vector,
    velocities: Matrix,
    variances: Vector,
    cruise: Vector,
    stands: bool,
    chain: Matrix,
    rest: float,
    angle: float,
    sway: float,
):
    """Weights (4,), velocities (4, 2) and variances (4,) of the modes after an interval without a track: new arrays.

    chain[j, k] is P(j -> k), `rest` what is left of a difference of velocities, `sway` the growth of variance. Each
    mode begins with the moments of the mixture of all that may have led to it.
    """
    num = len(weights)
    after, mean, variance = np.zeros(num), np.zeros((num, 2)), np.zeros(num)
    for k in range(num):
        for j in range(num):
            joint = weights[j] * chain[j, k]
            after[k] += joint
            mean[k, 0] += joint * velocities[j, 0]
            mean[k, 1] += joint * velocities[j, 1]
        mean[k] /= max(after[k], TINY)
        for j in range(num):
            apart = (velocities[j, 0] - mean[k, 0]) ** 2 + (velocities[j, 1] - mean[k, 1]) ** 2
            variance[k] += weights[j] * chain[j, k] * (variances[j] + 0.5 * apart)
        variance[k] = variance[k] / max(after[k], TINY) + sway
    c, s = np.cos(angle), np.sin(angle)
    if stands:
        mean[GOES_ON] = cruise + rest * (mean[GOES_ON] - cruise)
    mean[STOPS] = rest * mean[STOPS]
    for k, sign in ((LEFT, 1.0), (RIGHT, -1.0)):
        x, y = mean[k, 0], mean[k, 1]
        mean[k, 0], mean[k, 1] = c * x - sign * s * y, sign * s * x + c * y
    return after, mean, variance


@kernel
def correct(weights: Vector, velocities: Matrix, variances: Vector, measured: Vector, noise: float):
    """The same after a track of the mean velocity `measured` (2,), in place; `noise` is its variance."""
    total = 0.0
    for k in range(len(weights)):
        dx, dy = measured[0] - velocities[k, 0], measured[1] - velocities[k, 1]
        spread = variances[k] + noise
        density = np.exp(-0.5 * (dx * dx + dy * dy) / spread) / (2.0 * np.pi * spread)
        weights[k] *= (1.0 - EPSILON) * density + EPSILON / (np.pi * FASTEST * FASTEST)
        gain = variances[k] / spread
        velocities[k, 0] += gain * dx
        velocities[k, 1] += gain * dy
        variances[k] *= 1.0 - gain
        total += weights[k]
    for k in range(len(weights)):
        weights[k] /= total


@kernel
def follow_targets(
    paths: Cube,
    velocity: Matrix,
    state: Matrix,
    first: Matrix,
    second: Matrix,
    change: Vector,
    sway: Matrix,
    elapsed: Vector,
    step: float,
    relaxation_time: float,
):
    """x(t) of n states (n, 4) into `paths` (n, H + 1, 2), at `elapsed` (n,) and on in steps; v(t) at first, (n, 2).

    The target is first (n, 2), from `change` (n,) [s] after the state's time on second (n, 2);
    `sway` (n, 2) [m/s/√s] is sway z.
    """
    for i in range(len(state)):
        rest = np.exp(-change[i] / relaxation_time)
        for axis in range(2):
            x, v, u = state[i, axis], state[i, 2 + axis], first[i, axis]
            then = v  # x and v at the change
            there = x
            if change[i] < np.inf:
                there = x + u * change[i] + (v - u) * relaxation_time * (1.0 - rest)
                then = u + (v - u) * rest
            for h in range(paths.shape[1]):
                t = elapsed[i] + h * step
                since, at, fast, target = t, x, v, u
                if t > change[i]:
                    since, at, fast, target = t - change[i], there, then, second[i, axis]
                slow = np.exp(-since / relaxation_time)
                straight = at + target * since + (fast - target) * relaxation_time * (1.0 - slow)
                paths[i, h, axis] = straight + sway[i, axis] * t * np.sqrt(t / 3.0)
                if h == 0:
                    velocity[i, axis] = target + (fast - target) * slow
