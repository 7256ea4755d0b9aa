"""The camera that sees a whole scene."""

# pyright: reportAttributeAccessIssue=false
# mujoco's compiled modules carry no types.

from math import tan

import mujoco
import numpy as np

from mjnav.messages import Array
from mjnav.world.stage import FIELD_OF_VIEW

AZIMUTH, ELEVATION = 90.0, -50.0  # [deg] where the camera looks
_TALLEST = 1.7  # [m] a person's head


def overview(
    floor: Array, aspect: float, *, azimuth: float = AZIMUTH, elevation: float = ELEVATION
) -> mujoco.MjvCamera:
    """A camera just far enough away that everything above the points `floor` (n, 2) [m] is in the picture.

    `aspect` is the picture's width over its height; azimuth and elevation [deg] say where the camera looks.
    """
    low, high = floor.min(0) - 0.3, floor.max(0) + 0.3
    corners = np.array([(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (0.0, _TALLEST)])
    a, e = np.radians(azimuth), np.radians(elevation)
    ahead = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([np.sin(a), -np.cos(a), 0.0])
    up = np.cross(right, ahead)
    tan_y = tan(0.5 * FIELD_OF_VIEW)
    tan_x = tan_y * aspect
    centre, distance = corners.mean(0), 0.0
    # Moving the centre along the picture's height until the room above and below is equal.
    for _ in range(20):
        offset = corners - centre
        depth, x, y = offset @ ahead, offset @ right, offset @ up
        distance = float(np.max(np.maximum(np.abs(x) / tan_x, np.abs(y) / tan_y) - depth))
        seen = y / (distance + depth)
        centre = centre + 0.5 * (seen.max() + seen.min()) * distance * up
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE
    camera.lookat, camera.azimuth, camera.elevation, camera.distance = centre, azimuth, elevation, 1.02 * distance
    return camera
