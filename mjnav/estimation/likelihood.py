"""Likelihood of one sensor channel, with a floor, and the least noise that a filter believes in."""

from dataclasses import dataclass

import numpy as np

from mjnav.messages import Array
from mjnav.noise import Distribution, make_distribution

# Least standard deviations. A channel without noise would ask of a particle what no finite number of them can meet.
LEAST_STD = {
    "pose.x": 1e-3,  # [m]
    "pose.y": 1e-3,  # [m]
    "pose.theta": 1e-3,  # [rad]
    "detection.x": 1e-2,  # [m]: people's velocity is uncertain by 0.1 m/s and more, 1 cm within a period of 0.1 s
    "detection.y": 1e-2,  # [m]
    "odometry.v": 5e-3,  # [m/s]: to which wheels track on the floor
    "odometry.omega": 5e-3,  # [rad/s]
}

# Width of the floor's uniform density: a room, a full turn.
FLOOR_WIDTH = {
    "pose.x": 10.0,  # [m]
    "pose.y": 10.0,  # [m]
    "pose.theta": 2.0 * np.pi,  # [rad]
    "detection.x": 10.0,  # [m]
    "detection.y": 10.0,  # [m]
}

MAX_LOG_DENSITY = 30.0  # of an edge where a density is infinite; it keeps the weights finite


def widened(channel: str, noise: Distribution) -> Distribution:
    """The channel's noise, or a Gaussian of its mean and the least std where it is narrower than that."""
    least = LEAST_STD[channel]
    return make_distribution("gaussian", mean=noise.mean, std=least) if noise.std < least else noise


@dataclass(frozen=True, slots=True)
class Likelihood:
    """p(z | x) = (1 - epsilon) p(z - x) + epsilon / width, p the density of the noise with its mean.

    A reading is truth plus noise, so the noise that a particle implies is z - x. The floor is constant everywhere,
    also beyond its width: several noises have bounded support, and no reading may kill every particle.
    """

    noise: Distribution
    epsilon: float
    width: float

    @classmethod
    def of(cls, channel: str, noise: Distribution, epsilon: float) -> "Likelihood":
        """The likelihood of a channel, its noise widened where it has nearly none."""
        return cls(widened(channel, noise), epsilon, FLOOR_WIDTH[channel])

    @property
    def floor(self) -> float:
        """The floor's density."""
        return self.epsilon / self.width

    def density(self, error: Array) -> Array:
        """p(z | x) for errors z - x of any shape; never below the floor, never infinite."""
        density = np.exp(np.minimum(self.noise.logpdf(error), MAX_LOG_DENSITY))
        return (1.0 - self.epsilon) * density + self.floor
