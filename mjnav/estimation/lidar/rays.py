"""The beams of a scan as rays in the world, as the detector's kernels take them."""

from typing import NamedTuple

import numpy as np

from mjnav.geometry.kernel_types import Matrix, Vector


class Rays(NamedTuple):
    """B beams in the order in which they were taken, in the world by the mean of the robot's belief."""

    origins: Matrix  # (B, 2) [m] of the lidar when the beam was taken
    directions: Matrix  # (B, 2) unit vectors
    ranges: Vector  # (B,) [m]; inf where nothing returned, NaN for a beam that says nothing
    spread: Vector  # (B,) [m] standard deviation of the range
    times: Vector  # (B,) [s]
    step: float  # [rad] between neighbouring beams
    width: float  # [rad] of a beam
    closed: bool  # whether the last beam is a neighbour of the first one
    min_range: float  # [m]
    max_range: float  # [m]

    @property
    def points(self) -> np.ndarray:
        """Where the beams end, (B, 2) [m]; not finite where nothing returned."""
        return self.origins + self.ranges[:, None] * self.directions
