"""`constant_velocity`: every sample walks straight on, x(t) = x + t v."""

from mjnav.messages import Array
from mjnav.prediction.base import Crowd, Futures


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
