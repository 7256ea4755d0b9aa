"""Likelihood of one sensor channel, with a floor, and the least noise that a filter believes in."""

from dataclasses import dataclass, field

import numpy as np

from mjnav.constant import Constant
from mjnav.geometry.compiled import kernel
from mjnav.geometry.kernel_types import Vector
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
    "gyro": 2e-3,  # [rad/s]: the integral of the yaw rate is exact, its time and the scan's are not
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


# Of the table in place of a density.
CELLS = 128  # a standard deviation
REACH = 64  # standard deviations to each side of the mean
NEGLIGIBLE = 1e-4  # of the floor: what the density may still be where the table ends


@dataclass(frozen=True, slots=True)
class Likelihood(Constant):
    """p(z | x) = (1 - epsilon) p(z - x) + epsilon / width, p the density of the noise with its mean.

    A reading is truth plus noise, so the noise that a particle implies is z - x. The floor is constant everywhere,
    also beyond its width: several noises have bounded support, and no reading may kill every particle.
    """

    noise: Distribution
    epsilon: float
    width: float
    _table: "tuple[float, float, Array] | None" = field(init=False, repr=False, compare=False)

    def __post_init__(self):
        object.__setattr__(self, "_table", self._tabulate())

    @classmethod
    def of(cls, channel: str, noise: Distribution, epsilon: float) -> "Likelihood":
        """The likelihood of a channel, its noise widened where it has nearly none."""
        return cls(widened(channel, noise), epsilon, FLOOR_WIDTH[channel])

    @property
    def floor(self) -> float:
        """The floor's density."""
        return self.epsilon / self.width

    def density(self, error: Array) -> Array:
        """p(z | x) for errors z - x of any shape; never below the floor, never infinite.

        Interpolated in a table where one is fine enough: the result lies between `exact_density` at the two ends of a
        cell of 1/128 standard deviation, so an edge is blurred by no more than that; the relative error over
        the shipped noises averages 1e-5 to 1e-4. Computed exactly are infinite peaks, spikes, tails without end.
        """
        if self._table is None:
            return self.exact_density(error)
        return _interpolated(np.reshape(error, -1), *self._table, self.floor).reshape(np.shape(error))

    def exact_density(self, error: Array) -> Array:
        """`density` without a table."""
        density = np.exp(np.minimum(self.noise.logpdf(error), MAX_LOG_DENSITY))
        return (1.0 - self.epsilon) * density + self.floor

    def _tabulate(self) -> "tuple[float, float, Array] | None":
        """The first error of the table, cells a unit and `exact_density` at the cells' ends; None if too coarse."""
        scale = CELLS / self.noise.std
        error = self.noise.mean + np.arange(-CELLS * REACH, CELLS * REACH + 1) / scale
        values = self.exact_density(error)
        seen = np.flatnonzero(values > self.floor * (1.0 + NEGLIGIBLE))
        whole = (values - self.floor).sum() / scale / (1.0 - self.epsilon)
        if not (seen.size and 0.99 < whole < 1.01) or seen[0] == 0 or seen[-1] == values.size - 1:
            return None
        return float(error[seen[0] - 1]), float(scale), values[seen[0] - 1 : seen[-1] + 2].copy()


@kernel
def _interpolated(error: Vector, first: float, scale: float, values: Vector, outside: float):
    """Linear interpolation at errors (n,) in values at first, first + 1/scale, ...; (n,)."""
    found = np.full(len(error), outside)
    for i in range(len(error)):
        place = (error[i] - first) * scale
        if 0.0 <= place < len(values) - 1:
            cell = int(place)
            found[i] = values[cell] + (place - cell) * (values[cell + 1] - values[cell])
    return found
