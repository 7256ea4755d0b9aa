"""The map of a scene as an occupancy grid of ROS 2."""

from math import ceil, hypot

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys.stores import ros2_humble as ros

from mjnav.recording.export.ros_messages import header, stamp
from mjnav.scenarios.spec import Scenario

RESOLUTION = 0.05  # [m], the default of slam_toolbox and of nav2's maps; more where a room has more than MAX_CELLS
MARGIN = 1.0  # [m] around what stands in the room and around the way
MAX_CELLS = 2000  # along each axis
OCCUPIED, FREE = 100, 0  # nav_msgs/OccupancyGrid


def occupancy_grid(scenario: Scenario) -> ros.nav_msgs__msg__OccupancyGrid:
    """Walls, legs of tables and pillars in the frame map; people and lanes are not in it.

    A cell is occupied where its centre is at most half a diagonal from an obstacle, so that thin legs are not lost, and
    everything else is free. It is the map that the robot has.
    """
    robot, known = scenario.robot, scenario.known_bodies
    discs = [(*leg, table.leg_radius) for table in known.tables for leg in table.legs.tolist()]
    discs += [(*pillar.position, pillar.radius) for pillar in known.pillars]
    ends = [end for wall in known.walls for end in (wall.start, wall.end)]
    points = np.array([robot.start[:2], *robot.route, *ends, *(disc[:2] for disc in discs)])
    low, high = points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN
    resolution = max(RESOLUTION, float((high - low).max()) / (MAX_CELLS - 1))
    low = np.floor(low / resolution) * resolution
    width, height = (ceil(extent / resolution) for extent in high - low)
    cells = np.full((height, width), FREE, np.int8)
    reach = resolution * hypot(0.5, 0.5)

    def window(corners: NDArray, margin: float) -> tuple[slice, slice, NDArray, NDArray]:
        """The cells around these points: rows, columns, and x (1, w) and y (h, 1) of their centres [m]."""
        first = np.floor((corners.min(axis=0) - margin - low) / resolution).astype(int).clip(0)
        last = np.ceil((corners.max(axis=0) + margin - low) / resolution).astype(int)
        rows, columns = slice(first[1], min(last[1], height)), slice(first[0], min(last[0], width))
        x = low[0] + (np.arange(columns.start, columns.stop) + 0.5) * resolution
        y = low[1] + (np.arange(rows.start, rows.stop) + 0.5) * resolution
        return rows, columns, x[None, :], y[:, None]

    for x0, y0, radius in discs:
        rows, columns, x, y = window(np.array([(x0, y0)]), radius + reach)
        cells[rows, columns][np.hypot(x - x0, y - y0) - radius <= reach] = OCCUPIED
    for wall in known.walls:
        start, end = np.array(wall.start), np.array(wall.end)
        (x0, y0), length = 0.5 * (start + end), hypot(*(end - start))
        ux, uy = (end - start) / length
        rows, columns, x, y = window(np.array([start, end]), 0.5 * wall.thickness + reach)
        dx, dy = x - x0, y - y0
        along = np.maximum(np.abs(dx * ux + dy * uy) - 0.5 * length, 0.0)
        across = np.maximum(np.abs(dy * ux - dx * uy) - 0.5 * wall.thickness, 0.0)
        cells[rows, columns][np.hypot(along, across) <= reach] = OCCUPIED
    origin = ros.geometry_msgs__msg__Pose(
        ros.geometry_msgs__msg__Point(float(low[0]), float(low[1]), 0.0),
        ros.geometry_msgs__msg__Quaternion(0.0, 0.0, 0.0, 1.0),
    )
    info = ros.nav_msgs__msg__MapMetaData(stamp(0), resolution, width, height, origin)
    return ros.nav_msgs__msg__OccupancyGrid(header(0), info, cells.ravel())
