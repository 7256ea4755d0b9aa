"""Prediction of people: the interface between tracker and controller, predictors of a user's own, constant velocity.

    tracks at the time of the latest reading  ->  Predictor  ->  samples of every person from the moment of effect on

A predictor carries M joint samples (x, y, vx, vy) of each of P people to the moment at which the decision takes effect,
and on from that moment in H steps. All samples of a person count the same: a likelier state has more samples.

Predictors of a user's own get copies, and what they return is copied and checked.

`ConstantVelocity`: every sample walks straight on, x(t) = x + t v.
"""

from dataclasses import dataclass, field
from typing import Any, Protocol, Self

import numpy as np

from mjnav.errors import PluginFault
from mjnav.messages import Array, KnownMap, Track
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
    """The default: it has no state, draws nothing, and hands on no future of its own.

    What published predictors are compared with, and hard to beat over a few seconds (Schöller, Aravantinos, Lay & Knoll
    2020, "What the Constant Velocity Model Can Teach Us About Pedestrian Motion Prediction").
    """

    def predict(self, crowd: Crowd) -> Futures:
        """See `Predictor`."""
        return Futures(*carry_people(crowd.samples, crowd.elapsed))


def carry_people(samples: Array, duration: Array | float) -> tuple[Array, Array]:
    """Positions and velocities, (..., 2) each, after `duration` [s] from samples (..., 4) of x, y, vx, vy."""
    return samples[..., :2] + duration * samples[..., 2:], samples[..., 2:]


def make_predictor(scenario: Scenario, seed: int) -> Predictor:
    """The model that the scenario names, under the run's seed."""
    model = None if scenario.prediction is None else scenario.prediction.model
    if isinstance(model, PredictorPlugin):
        return OwnPredictor(model.name, model.make(scenario, seed))
    return ConstantVelocity()
