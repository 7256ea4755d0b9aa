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

The weights w of a person's modes are those of an interacting multiple model (Blom & Bar-Shalom 1988): a Kalman filter
of the velocity in each mode, with every new track's mean velocity z as its measurement,

    v_k  <-  v_k, exp(-T / tau) v_k, or v_k turned by +-w T        after T, with variance P_k + sway^2 T
    w_k  <-  c ((1 - epsilon) N(z; v_k, (P_k + velocity_noise^2) I) + floor) sum_j P(j -> k, T) w_j

so that an outlier among the tracks moves no weight far. `velocity_noise` is what the default tracker does at 10 Hz to
somebody who walks straight on in `crossing1`. The rates are round assumptions, not fitted to anything: somebody who
walks for 10 s turns once and stops every other time, and stands for about 3 s.
"""

from dataclasses import dataclass
from math import exp, pi

import numpy as np

from mjnav.geometry.compiled import kernel
from mjnav.geometry.kernel_types import Cube, Matrix, Vector
from mjnav.messages import Array, Track
from mjnav.prediction.base import Crowd, Futures
from mjnav.rng import stream
from mjnav.scenarios.prediction import MixtureModel, Prediction

MODES = ("goes_on", "stops", "turns_left", "turns_right")
GOES_ON, STOPS, LEFT, RIGHT = range(len(MODES))
STANDS = 0.2  # [m/s] mean speed below which somebody stands
CRUISE_TIME = 1.0  # [s] over which the velocity of going on is averaged
SWAY = 0.2  # [m/s/√s] of a straight walk, as in `estimation.person_motion`
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
        self.modes = {track.name: self._follow(track) for track in crowd.tracks}
        num_people, num = crowd.samples.shape[:2]
        state = np.array(crowd.samples, order="C").reshape(-1, 4)
        first, second = np.empty((2, num_people, num, 2))
        change = np.empty((num_people, num))
        for p, track in enumerate(crowd.tracks):
            first[p], second[p], change[p] = self._targets(track.name, crowd.samples[p, :, 2:])
        paths, velocity = np.empty((len(state), self._num + 1, 2)), np.empty((len(state), 2))
        elapsed = np.repeat(crowd.elapsed.ravel(), num)
        follow_targets(
            paths, velocity, state, first.reshape(-1, 2), second.reshape(-1, 2), change.ravel(), elapsed, self._step,
            self._model.relaxation_time,
        )  # fmt: skip
        paths = paths.reshape(num_people, num, self._num + 1, 2)
        return Futures(paths[:, :, 0], velocity.reshape(num_people, num, 2), paths[:, :, 1:], self._step)

    def _follow(self, track: Track) -> ModeBelief:
        """The belief of a person's modes after a track."""
        before, measured = self.modes.get(track.name), track.mean[2:]
        noise = self._model.velocity_noise**2
        if before is None or track.recovered or track.time < before.time:
            num = len(MODES)
            return ModeBelief(
                track.time, np.eye(num)[GOES_ON], np.tile(measured, (num, 1)), np.full(num, noise), measured
            )
        interval = track.time - before.time
        if interval == 0.0:
            return before
        weights, velocities, variances = self._expected(before, interval)
        spread = variances + noise
        miss = ((measured - velocities) ** 2).sum(axis=1)
        density = np.exp(-0.5 * miss / spread) / (2.0 * pi * spread)
        weights = weights * ((1.0 - EPSILON) * density + EPSILON / (pi * FASTEST**2))
        weights = weights / weights.sum()
        gain = (variances / spread)[:, None]
        velocities, variances = velocities + gain * (measured - velocities), (1.0 - gain[:, 0]) * variances
        follows = (1.0 - weights[STOPS]) * (1.0 - exp(-interval / CRUISE_TIME))
        cruise = before.cruise + follows * (weights @ velocities - before.cruise)
        return ModeBelief(track.time, weights, velocities, variances, cruise)

    def _expected(self, before: ModeBelief, interval: float) -> tuple[Array, Array, Array]:
        """Weights, velocities and variances of the modes after an interval [s] without a track."""
        joint = before.weights[:, None] * transition(self._model, interval)  # was in j, is in k
        weights = joint.sum(axis=0)
        shares = joint / np.maximum(weights, TINY)
        mixed = shares.T @ before.velocities
        apart = ((before.velocities[:, None] - mixed) ** 2).sum(axis=2)
        variances = (shares * (before.variances[:, None] + 0.5 * apart)).sum(axis=0) + SWAY**2 * interval
        rest = exp(-interval / self._model.relaxation_time)
        angle = 0.25 * self._model.turn_angle / self._model.relaxation_time * interval  # the mean turn within 2 tau
        going = before.cruise + rest * (mixed[GOES_ON] - before.cruise) if before.stands else mixed[GOES_ON]
        after = (going, rest * mixed[STOPS], turned(mixed[LEFT], angle), turned(mixed[RIGHT], -angle))
        return weights, np.stack(after), variances

    def _targets(self, name: str, velocity: Array) -> tuple[Array, Array, Array]:
        """Of one person's samples with velocities (M, 2): targets at first, later ones, (M, 2), and when [s] (M,)."""
        if name not in self._streams:
            self._streams[name] = stream(self._seed, "prediction.modes", name)
        rng, model, belief, num = self._streams[name], self._model, self.modes[name], len(velocity)
        shares = (np.arange(num) + rng.random()) / num
        mode = np.searchsorted(np.cumsum(belief.weights), shares).clip(max=RIGHT)[rng.permutation(num)]
        when, what, side = rng.random((3, num))
        walk = np.broadcast_to(belief.cruise, (num, 2)) if belief.stands else velocity
        angle = model.turn_angle * side
        sign = np.where((mode == RIGHT) | ((mode != LEFT) & (what > 1.0 - 0.5 * _turn_share(model))), -1.0, 1.0)
        beside, at_rest = turned(walk, sign * angle), np.zeros(2)
        first = np.where((mode == GOES_ON)[:, None], walk, np.where((mode == STOPS)[:, None], at_rest, beside))
        turns = what > 1.0 - _turn_share(model)
        after_walk = np.where(turns[:, None], beside, at_rest)
        second = np.where(
            (mode == GOES_ON)[:, None], after_walk, np.where((mode == STOPS)[:, None], belief.cruise, first)
        )
        rate = np.where(mode == GOES_ON, model.stop_rate + model.turn_rate, np.where(mode == STOPS, model.go_rate, 0.0))
        with np.errstate(divide="ignore"):
            change = -np.log1p(-when) / rate
        return first, second, np.where(rate > 0.0, change, np.inf)


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
def follow_targets(
    paths: Cube,
    velocity: Matrix,
    state: Matrix,
    first: Matrix,
    second: Matrix,
    change: Vector,
    elapsed: Vector,
    step: float,
    relaxation_time: float,
):
    """x(t) of n states (n, 4) into `paths` (n, H + 1, 2), at `elapsed` (n,) and on in steps; v(t) at first, (n, 2).

    The target is first (n, 2), from `change` (n,) [s] after the state's time on second (n, 2).
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
                paths[i, h, axis] = at + target * since + (fast - target) * relaxation_time * (1.0 - slow)
                if h == 0:
                    velocity[i, axis] = target + (fast - target) * slow
