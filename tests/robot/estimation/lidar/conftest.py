"""A room with three pillars, and scans of it."""

from collections.abc import Callable

import numpy as np
import pytest

from mjnav.geometry.beams import cast
from mjnav.geometry.distances import beam_angles
from mjnav.geometry.floor import Floor

NUM_BEAMS = 360


def walls(*rows):
    """Walls of 0.1 m, each from x0, y0 to x1, y1."""
    x0, y0, x1, y1 = np.array(rows, float).T
    length = np.hypot(x1 - x0, y1 - y0)
    return np.column_stack(
        [0.5 * (x0 + x1), 0.5 * (y0 + y1), (x1 - x0) / length, (y1 - y0) / length, 0.5 * length, 0.05 + 0.0 * length]
    )


@pytest.fixture(scope="session")
def room() -> Floor:
    """6 m x 4 m, without a symmetry."""
    boxes = walls((0, 0, 6, 0), (6, 0, 6, 4), (6, 4, 0, 4), (0, 4, 0, 0), (4, 4, 4, 3))
    return Floor(np.array([[1.5, 1.0, 0.2], [4.5, 1.5, 0.15], [2.5, 3.2, 0.3]]), boxes)


@pytest.fixture(scope="session")
def corridor() -> Floor:
    """Two walls along x that go on beyond what a lidar sees."""
    return Floor(np.zeros((0, 3)), walls((-50, 0, 50, 0), (-50, 2, 50, 2)))


@pytest.fixture(scope="session")
def ranges() -> Callable[..., np.ndarray]:
    """ranges(floor, pose) -> exact ranges of all beams to 10 m, (B,)."""

    def measure(floor, pose):
        angles = beam_angles(NUM_BEAMS) + pose[2]
        return cast(np.array(pose[:2], float), angles, floor.discs, floor.boxes, 10.0)

    return measure
