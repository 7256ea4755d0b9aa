"""Prediction of people: the interface between tracker and controller, predictors of a user's own, and mjnav's two.

    tracks at the time of the latest reading  ->  Predictor  ->  samples of every person from the moment of effect on

A predictor carries M joint samples (x, y, vx, vy) of each of P people to the moment at which the decision takes effect,
and on from that moment in H steps. All samples of a person count the same: a likelier state has more samples.

Predictors of a user's own get copies, and what they return is copied and checked.

`ConstantVelocity`: every sample walks straight on, x(t) = x + t v.

`TurningAtWalls`: so does every sample but for those in whose way a wall of the robot's map stands. Nobody walks through
a wall: where the straight line meets one after t_w, the sample turns before it, along the wall,

    x(t) = x + v min(t, tau) + |v| w [t - tau]+,   tau ~ U(FIRST, 1) [t_w - GAP / |v|]+,

w being the wall's direction, or with probability (1 - v . w / |v|) / 2 the opposite one: who comes at an angle rather
goes on than back. Round a corner people so come towards the robot in half of the samples.
"""

from dataclasses import dataclass, field, replace
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from mjnav.compile.compiled import Cube, Matrix, exact, kernel
from mjnav.errors import PluginFault
from mjnav.messages import Array, KnownMap, Track
from mjnav.rng import stream
from mjnav.scene.prediction import ConstantVelocityModel, Prediction, WallsModel
from mjnav.scene.spec import Scenario
from mjnav.sealed import checked_copy, sealed_message
from mjnav.settings.plugins import PredictorPlugin
from mjnav.short_repr import ShortRepr

# ------------------------------------------------------------------------------------------ interface


@dataclass(frozen=True, slots=True, repr=False)
class RobotNow(ShortRepr):
    """The robot as a body among the people, at the moment of effect."""

    position: Array  # (2,) [m]
    velocity: Array  # (2,) [m/s]
    radius: float  # [m]


@dataclass(frozen=True, slots=True, repr=False)
class Crowd(ShortRepr):
    """What is known of P people and of what stands around them when they are predicted."""

    tracks: tuple[Track, ...]  # (P,) the latest, each with its own time
    samples: Array  # (P, M, 4) x, y, vx, vy [m, m/s] of each, at its track's time; in random order
    effect: float  # [s] the moment at which the decision takes effect
    map: KnownMap | None = None
    robot: RobotNow | None = None

    @property
    def elapsed(self) -> Array:
        """(P, 1, 1) [s] from each track's time to the moment of effect."""
        return np.array([self.effect - track.time for track in self.tracks]).reshape(-1, 1, 1)


@dataclass(frozen=True, slots=True, repr=False)
class Futures(ShortRepr):
    """M samples of each of P people at the moment of effect, and of how they go on."""

    position: Array  # (P, M, 2) [m] at the moment of effect
    velocity: Array  # (P, M, 2) [m/s]
    ahead: Array | None = field(default=None)  # (P, M, H, 2) [m] after step, ... H step; None: straight on
    step: float = 0.0  # [s]
    turns: NDArray[np.bool_] | None = None  # (P,) who has an `ahead` that is not straight; None: whoever has one

    @classmethod
    def along(cls, paths: Array, step: float) -> Self:
        """From paths (P, M, H + 1, 2) [m] of every sample: at the moment of effect, after `step`, ... H `step` [s].

        The velocity is that of the first step.
        """
        return cls(paths[:, :, 0], (paths[:, :, 1] - paths[:, :, 0]) / step, paths[:, :, 1:], step)

    def paths(self, step: float, num: int) -> Array:
        """(P, M, num + 1, 2) [m]: from the moment of effect on in `num` steps; for a model without `ahead` straight on.

        With `ahead`, `step` and `num` are its own.
        """
        if self.ahead is not None:
            return np.concatenate([self.position[:, :, None], self.ahead], axis=2)
        time = step * np.arange(num + 1)[:, None]
        return self.position[:, :, None] + time * self.velocity[:, :, None]


class Predictor(Protocol):
    """A model of how people go on. One whose state is more than its streams' is told apart by people's names."""

    def predict(self, crowd: Crowd) -> Futures:
        """Called once a tick with the latest tracks; ticks between two readings bring the same tracks again."""
        ...


# ------------------------------------------------------------------------- predictors of a user's own


class OwnPredictor:
    """People by a user's predictor."""

    def __init__(self, name: str, predictor: Any):
        self._name, self._own = name, predictor

    def predict(self, crowd: Crowd) -> Futures:
        """The predictor's futures. Raises PluginFault where they are none."""
        with PluginFault.told(self._name, "predict()"):
            return self._futures(crowd, self._own.predict(sealed_message(crowd)))

    def _futures(self, crowd: Crowd, found: Any) -> Futures:
        if not isinstance(found, Futures):
            raise PluginFault(f"{self._name}: predict() returned a {type(found).__name__} in place of Futures")
        shape = (*crowd.samples.shape[:2], 2)
        position = checked_copy(f"{self._name}: position", found.position, shape)
        velocity = checked_copy(f"{self._name}: velocity", found.velocity, shape)
        if found.ahead is None:
            return Futures(position, velocity)
        num = np.shape(found.ahead)[2] if np.ndim(found.ahead) == 4 else 0
        ahead = checked_copy(f"{self._name}: ahead", found.ahead, (*shape[:2], max(num, 1), 2))
        if not 0.0 < float(found.step) < np.inf:
            raise PluginFault(f"{self._name}: step must be a finite number > 0, not {found.step}")
        return Futures(position, velocity, ahead, float(found.step))


# ---------------------------------------------------------------------------------- constant velocity


class ConstantVelocity:
    """The default of methods that hold one control. It has no state, draws nothing, and hands on no future of its own.

    What published predictors are compared with, and hard to beat over a few seconds (Schöller, Aravantinos, Lay & Knoll
    2020, "What the Constant Velocity Model Can Teach Us About Pedestrian Motion Prediction").
    """

    def predict(self, crowd: Crowd) -> Futures:
        """See `Predictor`."""
        return Futures(*carry_people(crowd.samples, crowd.elapsed))


FIRST, GAP = 0.3, 0.4  # of the time to the wall before which nobody turns; [m] from the wall in which everybody has
SLOWEST = 0.25  # [m/s] below which somebody stands, and turns nowhere
FARTHEST = 10.0  # [m] from people of walls that count


class TurningAtWalls:
    """The default of methods that plan in time. Where no wall is near it is `ConstantVelocity` to the last bit."""

    def __init__(self, prediction: Prediction, seed: int):
        self._step, self._num = prediction.step, prediction.num_steps
        self._stream = stream(seed, "prediction")

    def predict(self, crowd: Crowd) -> Futures:
        """See `Predictor`."""
        samples, elapsed = crowd.samples, crowd.elapsed
        walls = _near(crowd.map, samples)
        if not len(walls):
            return Futures(*carry_people(samples, elapsed))
        tau, along = np.full(samples.shape[:2], np.inf), np.zeros((*samples.shape[:2], 2))
        turns_at_walls(tau, along, samples, self._stream.random((2, *samples.shape[:2])), walls)
        time = elapsed[:, 0] + self._step * np.arange(self._num + 1)  # (P, H + 1)
        paths = np.empty((*samples.shape[:2], self._num + 1, 2))
        _walk(paths.reshape(*samples.shape[:2], -1), samples, time, tau, along)
        return replace(Futures.along(paths, self._step), turns=(tau < time[:, -1:]).any(axis=1))


def _near(known: KnownMap | None, samples: Array) -> Array:
    """The walls (W, 2, 2) of a map within FARTHEST of people's samples (P, M, 4)."""
    if known is None or not samples.size:
        return np.zeros((0, 2, 2))
    x, y = samples[..., 0], samples[..., 1]
    low, high = np.array([x.min(), y.min()]) - FARTHEST, np.array([x.max(), y.max()]) + FARTHEST
    beside = (known.walls.max(axis=1) < low) | (known.walls.min(axis=1) > high)
    return known.walls[~beside.any(axis=1)]


@kernel
def turns_at_walls(tau: Matrix, along: Cube, samples: Cube, draws: Cube, walls: Cube):
    """When samples (P, M, 4) turn [s], inf for those without a wall ahead, and how they then walk [m/s], (P, M, 2).

    `draws` (2, P, M) are uniform: of the time, and of the direction.
    """
    for p in range(tau.shape[0]):
        for m in range(tau.shape[1]):
            x, y, vx, vy = samples[p, m, 0], samples[p, m, 1], samples[p, m, 2], samples[p, m, 3]
            speed = np.sqrt(vx * vx + vy * vy)
            if speed < SLOWEST:
                continue
            first, wx, wy = np.inf, 0.0, 0.0
            for w in range(walls.shape[0]):
                ax, ay = walls[w, 0, 0] - x, walls[w, 0, 1] - y
                dx, dy = walls[w, 1, 0] - walls[w, 0, 0], walls[w, 1, 1] - walls[w, 0, 1]
                cross = vx * dy - vy * dx
                if cross == 0.0:
                    continue
                time, share = (ax * dy - ay * dx) / cross, (ax * vy - ay * vx) / cross
                if 0.0 < time < first and 0.0 <= share <= 1.0:
                    first, length = time, np.sqrt(dx * dx + dy * dy)
                    wx, wy = dx / length, dy / length
            if first < np.inf:
                tau[p, m] = (FIRST + (1.0 - FIRST) * draws[0, p, m]) * max(first - GAP / speed, 0.0)
                ahead = 0.5 * (1.0 + (vx * wx + vy * wy) / speed)
                signed = speed if draws[1, p, m] < ahead else -speed
                along[p, m, 0], along[p, m, 1] = signed * wx, signed * wy


@exact
def _walk(paths: Cube, samples: Cube, time: Matrix, tau: Matrix, along: Cube):
    """Fills `paths` (P, M, 2 H + 2) with x, y at `time` (P, H + 1) of samples (P, M, 4) that turn `along` at `tau`."""
    for p, m in np.ndindex(tau.shape):
        for h in range(time.shape[1]):
            until = min(time[p, h], tau[p, m])
            for c in range(2):
                straight = samples[p, m, c] + until * samples[p, m, 2 + c]
                paths[p, m, 2 * h + c] = straight + (time[p, h] - until) * along[p, m, c]


def carry_people(samples: Array, duration: Array | float) -> tuple[Array, Array]:
    """Positions and velocities, (..., 2) each, after `duration` [s] from samples (..., 4) of x, y, vx, vy."""
    return samples[..., :2] + duration * samples[..., 2:], samples[..., 2:]


def make_predictor(scenario: Scenario, seed: int, *, in_time: bool = True) -> Predictor:
    """The model that the scenario names, under the run's seed; by default the one for methods that plan `in_time`."""
    prediction = scenario.prediction or Prediction(WallsModel() if in_time else ConstantVelocityModel())
    match prediction.model:
        case PredictorPlugin() as own:
            return OwnPredictor(own.name, own.make(scenario, seed))
        case ConstantVelocityModel():
            return ConstantVelocity()
        case _:
            return TurningAtWalls(prediction, seed)
