"""What the commands cost, and how long the robot had to give way."""

import numpy as np

from mjnav.geometry.angles import wrap
from mjnav.messages import Array, Trajectory
from mjnav.metrics.progress import targets
from mjnav.motion.diff_drive import TRACK_WIDTH
from mjnav.motion.unicycle import integrate
from mjnav.scenarios.spec import Scenario

PREVIEW = 1.0  # [s] that a nominal control is followed
LEAVING_ANGLE = 0.2  # [rad] between where it leads and where the goal is: 11 degrees, above what noise turns it by


def control_cost(command: Array, period: float) -> float:
    """Sum of (dv^2 + (b/2)^2 domega^2) / dt over commands (T, 2) from rest, b the track width [m^2/s^3].

    (b/2) domega is the change of the wheels' speeds by turning, so both terms are speeds.
    """
    change = np.diff(command, axis=0, prepend=np.zeros((1, 2)))
    return float((change**2 @ [1.0, (0.5 * TRACK_WIDTH) ** 2]).sum() / period)


def time_to_avoid(trajectory: Trajectory, scenario: Scenario) -> float | None:
    """From the first tick at which the nominal control leaves the way to the goal until the last [s].

    It leaves the way where PREVIEW seconds of it, from the estimated pose, end more than LEAVING_ANGLE to the side of
    the next waypoint, as seen from that pose. The turn from the start towards the goal does not count: ticks before the
    first that keeps the way are left out. 0 where it never leaves, None without nominal controls.
    """
    given = np.isfinite(trajectory.nominal).all(-1)
    if not given.any():
        return None
    pose, (v, omega) = trajectory.estimate, trajectory.nominal.T
    ahead = integrate(pose, v, omega, PREVIEW)
    target = np.array(scenario.robot.route)[targets(trajectory, scenario)[:-1]] - pose[:, :2]
    standing = np.hypot(*(ahead - pose)[:, :2].T) < 1e-3  # a stopped robot leads where it looks
    step = np.where(standing[:, None], np.stack([np.cos(ahead[:, 2]), np.sin(ahead[:, 2])], -1), (ahead - pose)[:, :2])
    angle = np.abs(wrap(np.arctan2(step[:, 1], step[:, 0]) - np.arctan2(target[:, 1], target[:, 0])))
    keeps = given & (angle <= LEAVING_ANGLE)
    leaves = np.flatnonzero(given & ~keeps & (np.cumsum(keeps) > 0))
    return float((leaves[-1] - leaves[0] + 1) * scenario.control.period) if leaves.size else 0.0
