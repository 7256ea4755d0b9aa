"""Where the beams of a planar lidar begin, and where they point to."""

from math import cos, sin

import numpy as np

from mjnav.messages import Array

WHOLE_TURN = 2.0 * np.pi  # [rad]


def beam_angles(num_beams: int, field_of_view: float = WHOLE_TURN) -> Array:
    """Of each beam against the lidar's heading, (B,) [rad], counter-clockwise.

    2 pi i / B - pi over a whole turn; over a smaller field of view F from -F/2 to F/2, both ends included.
    """
    if field_of_view >= WHOLE_TURN:
        return WHOLE_TURN * np.arange(num_beams) / num_beams - np.pi
    return np.linspace(-0.5 * field_of_view, 0.5 * field_of_view, num_beams)


def placed(pose: Array, mount: Array) -> Array:
    """The pose (3,) in the world of what is mounted at `mount` (3,) on a body at `pose` (3,)."""
    (x, y, heading), (ahead, left, yaw) = pose.tolist(), mount.tolist()
    c, s = cos(heading), sin(heading)
    return np.array([x + c * ahead - s * left, y + s * ahead + c * left, heading + yaw])
