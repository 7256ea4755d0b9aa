"""Control effort and motion of the robot: the cost of commands, time to give way, speed, acceleration and jerk.

The motion is that of the true states at the ticks. The velocity in the plane at tick k is
u_k = v_k (cos theta_k, sin theta_k), with v_k the true speed along the heading. Acceleration and jerk are its first and
second differences over the control period, a_k = (u_{k+1} - u_k) / dt and j_k = (a_{k+1} - a_k) / dt: what happens
within a period is not seen, and turning counts. So the figures of runs at different control rates differ: a slower rate
smooths.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from mjnav.geometry.angles import wrap
from mjnav.messages import TRACK_WIDTH, Array, Trajectory
from mjnav.metrics.definitions import HUNAVSIM, LOWER, TABLE_1, Definition, figures
from mjnav.metrics.progress import jumps, targets
from mjnav.motion.unicycle import integrate
from mjnav.scene.spec import Scenario

# ----------------------------------------------------------------------------------------- commands


PREVIEW = 1.0  # [s] that a nominal control is followed
LEAVING_ANGLE = 0.2  # [rad] between where it leads and where the goal is: 11 degrees, above what noise turns it by


def control_cost(command: Array, period: float, track_width: float = TRACK_WIDTH) -> float:
    """Sum of (dv^2 + (b/2)^2 domega^2) / dt over commands (T, 2) from rest, b the track width [m^2/s^3].

    (b/2) domega is the change of the speed over ground where the wheels are, so both terms are speeds.
    """
    change = np.diff(command, axis=0, prepend=np.zeros((1, 2)))
    return float((change**2 @ [1.0, (0.5 * track_width) ** 2]).sum() / period)


@figures(
    "motion",
    Definition("control_cost", unit="m²/s³", better=LOWER,
               equation=r"\sum_k \left((v_k - v_{k-1})^2 + (b/2)^2 (\omega_k - \omega_{k-1})^2\right)/\Delta t"),
)  # fmt: skip
def command_cost(trajectory: Trajectory, scenario: Scenario) -> float:
    """`control_cost` of a run's commands.

    * control_cost: sum of (dv^2 + (track_width/2)^2 domega^2)/dt over the commands, from rest: both terms are changes
      of speed where the wheels are
    """
    return control_cost(trajectory.command, scenario.control.period, scenario.robot.track_width)


@figures("path", Definition("time_to_avoid_s", better=LOWER, null="no nominal control"))
def time_to_avoid(trajectory: Trajectory, scenario: Scenario) -> float | None:
    """From the first tick at which the nominal control leaves the way to the goal until the last [s].

    It leaves the way where PREVIEW seconds of it, from the estimated pose, end more than LEAVING_ANGLE to the side of
    the next waypoint, as seen from that pose. The turn from the start towards the goal does not count: ticks before the
    first that keeps the way are left out. 0 where it never leaves, None without nominal controls.

    * time_to_avoid_s: from the first to the last tick at which 1 s of the nominal control ends more than 0.2 rad to the
      side of the next waypoint; ticks before the first that keeps the way do not count; 0 where it never leaves
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


# ----------------------------------------------------------------------------- speed and smoothness


# [m/s] below which the robot makes no way. Two standard deviations of the default actuation noise, which also moves a
# robot that is told to stand; Francis et al. (2023) leave the number open.
STALLED_SPEED = 0.1
NOT_MOVING_SPEED = 0.001  # [m/s], NOT_MOVING_TURN_RATE = 0.01 rad/s: Perez-Higueras et al. (2023), HuNavSim
NOT_MOVING_TURN_RATE = 0.01  # [rad/s]


def velocity(trajectory: Trajectory) -> Array:
    """The robot's true velocity u_k in the plane at every state, (T + 1, 2) [m/s]."""
    heading, v = trajectory.robot_pose[:, 2], trajectory.robot_twist[:, 0]
    return np.column_stack([v * np.cos(heading), v * np.sin(heading)])


def acceleration(trajectory: Trajectory) -> Array:
    """a_k = (u_{k+1} - u_k) / dt from tick to tick, (T, 2) [m/s^2]."""
    return np.diff(velocity(trajectory), axis=0) / np.diff(trajectory.time)[:, None]


def jerk(trajectory: Trajectory) -> Array:
    """j_k = (a_{k+1} - a_k) / dt, (max(T - 1, 0), 2) [m/s^3]."""
    return np.diff(acceleration(trajectory), axis=0) / np.diff(trajectory.time)[1:, None]


def extremes(vectors: Array) -> tuple[float | None, float | None, float | None]:
    """Minimum, mean and maximum of the lengths of vectors (n, 2).

    Source: Francis et al., Principles and Guidelines for Evaluating Social Robot Navigation Algorithms (2023), table 1.
    """
    if not len(vectors):
        return None, None, None
    size = np.hypot(vectors[:, 0], vectors[:, 1])
    return float(size.min()), float(size.mean()), float(size.max())


def _definitions(what: str, unit: str, text: str, equation: str, better: str = "") -> Iterator[Definition]:
    """Of minimum, mean and maximum of one quantity over the ticks; `unit` as names have it."""
    for part, word in (("min", "minimum"), ("mean", "mean"), ("max", "maximum")):
        yield Definition(
            f"{part}_{what}_{unit}", f"{text}, {word} over the ticks", better=better if part != "min" else "",
            words=f"{word} {what}", equation=equation, null="too few ticks", source=TABLE_1,
        )  # fmt: skip


@figures(
    "motion",
    *_definitions("speed", "m_s", "the robot's true speed", r"\lvert u_k\rvert"),
    *_definitions(
        "acceleration", "m_s2", "magnitude of the change of the robot's true velocity in the plane from tick to "
        "tick, over the period: turning counts", r"\lvert a_k\rvert,\ a_k = (u_{k+1} - u_k)/\Delta t", LOWER,
    ),
    *_definitions(
        "jerk", "m_s3", "magnitude of the change of that acceleration from tick to tick, over the period",
        r"\lvert a_{k+1} - a_k\rvert/\Delta t", LOWER,
    ),
)  # fmt: skip
def smoothness(trajectory: Trajectory) -> tuple[float | None, ...]:
    """`extremes` of speed, acceleration and jerk."""
    return tuple(value for of in (velocity, acceleration, jerk) for value in extremes(of(trajectory)))


@figures("motion", Definition("stalled_s", better=LOWER, words="time stalled", source=TABLE_1))
def stalled_time(trajectory: Trajectory) -> float:
    """How long the robot was slower than STALLED_SPEED [s]; each tick's speed stands for the period after it.

    Source: Francis et al. (2023), table 1.

    * stalled_s: time with a true speed below 0.1 m/s
    """
    return _time(trajectory, np.abs(trajectory.robot_twist[:, 0]) < STALLED_SPEED)


@figures(
    "motion",
    Definition("not_moving_s", better=LOWER, words="time not moving", source=f"{HUNAVSIM}; Tsoi et al. (2022)"),
)  # fmt: skip
def time_not_moving(trajectory: Trajectory) -> float:
    """How long the robot neither drove nor turned [s]: below NOT_MOVING_SPEED and NOT_MOVING_TURN_RATE.

    Source: HuNavSim, Perez-Higueras et al. (2023), after SEAN 2.0, Tsoi et al. (2022).

    * not_moving_s: time with a true speed below 0.001 m/s and a turn rate below 0.01 rad/s; actuation noise alone moves
      a robot faster
    """
    v, omega = np.abs(trajectory.robot_twist).T
    return _time(trajectory, (v < NOT_MOVING_SPEED) & (omega < NOT_MOVING_TURN_RATE))


@figures(
    "motion",
    Definition("heading_change_rad", better=LOWER, words="cumulative heading change",
               equation=r"\sum_k \lvert \theta_{k+1} - \theta_k\rvert", source="Perez-Higueras et al. (2018)"),
)  # fmt: skip
def heading_change(trajectory: Trajectory, scenario: Scenario) -> float:
    """sum_k |theta_{k+1} - theta_k|, each difference in (-pi, pi] [rad].

    Source: Perez-Higueras, Caballero & Merino, Int. J. of Social Robotics 10 (2018) 235.

    * heading_change_rad: sum of the changes of the heading from tick to tick without signs, but for kidnappings
    """
    return float(np.abs(wrap(np.diff(trajectory.robot_pose[:, 2])))[~jumps(trajectory, scenario)].sum())


def _time(trajectory: Trajectory, there: NDArray[np.bool_]) -> float:
    """For how long a condition held at the ticks (T + 1,) [s]."""
    return float(np.diff(trajectory.time) @ there[:-1])
