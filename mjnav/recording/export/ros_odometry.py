"""Who moves how, as nav_msgs/Odometry: the robot by its wheels, and each person as it is and as it is believed to be.

Every ROS 2 has this type, and RViz draws it; messages for people (people_msgs, derived_object_msgs) have to be built. A
twist is in the frame of its child, which faces the way it moves: linear.x is a person's speed.
"""

from collections.abc import Mapping
from math import atan2, cos, hypot, sin
from typing import Any

import numpy as np
from rosbags.typesys.stores import ros2_humble as ros

from mjnav.messages import Array
from mjnav.recording.encode.geometry import ODOMETRY_FRAME, ROBOT_FRAME, time_ns
from mjnav.recording.export.ros_messages import floats, header, planar_covariance, planar_pose, vector
from mjnav.scenarios.spec import Scenario


class WheelOdometry:
    """/odom: the pose that the wheels' twists lead to from the start, and the last twist.

    The twist's covariance is that of the noise of its channels. The pose's is what this adds up to, to first order and
    for independent readings: P' = F P F^T + G Q G^T, with the Jacobians F and G of one step along an arc by the pose
    and by (v, omega). Noise with a mean, a bias, is not in them.
    """

    def __init__(self, scenario: Scenario):
        channels = scenario.noise.distributions()
        self._noise = np.diag([channels["odometry.v"].std ** 2, channels["odometry.omega"].std ** 2])
        self._covariance = np.zeros((3, 3))

    def __call__(self, document: Mapping, _: int) -> ros.nav_msgs__msg__Odometry | None:
        """Of mjnav.Odometry; None where an older log does not have the pose."""
        if "odometry_pose" not in document:
            return None
        x, y, heading = floats(document["odometry_pose"])
        interval, v, omega = floats([document["interval"], document["v"], document["omega"]])
        self._covariance = moved_covariance(self._covariance, self._noise, heading, v, omega, interval)
        twist = np.zeros((3, 3))
        twist[np.ix_((0, 2), (0, 2))] = self._noise
        return _odometry(
            header(time_ns(document["time"]), ODOMETRY_FRAME),
            ROBOT_FRAME,
            (x, y, heading),
            self._covariance,
            (v, omega),
            twist,
        )


def moved_covariance(before: Array, noise: Array, heading: float, v: float, omega: float, interval: float) -> Array:
    """The pose's covariance (3, 3) after a step that ends at `heading`; `noise` is that of (v, omega), (2, 2).

    The step is taken along its chord: x' = x + v T cos(m), y' = y + v T sin(m), with m = heading - omega T / 2.
    """
    middle = heading - 0.5 * omega * interval
    c, s, way = cos(middle), sin(middle), v * interval
    by_pose = np.array([[1.0, 0.0, -way * s], [0.0, 1.0, way * c], [0.0, 0.0, 1.0]])
    by_twist = interval * np.array([[c, -0.5 * way * s], [s, 0.5 * way * c], [0.0, 1.0]])
    return by_pose @ before @ by_pose.T + by_twist @ noise @ by_twist.T


def person(document: Mapping, now: int, *, name: str) -> ros.nav_msgs__msg__Odometry | None:
    """One person of mjnav.People, whose heading is that of the velocity; None where it is not there."""
    found = next((one for one in document["people"] if one["name"] == name), None)
    if found is None or found["position"][0] is None:
        return None
    (x, y), (vx, vy) = floats(found["position"]), floats(found["velocity"])
    heading = atan2(vy, vx)
    place, motion = np.zeros((3, 3)), np.zeros((3, 3))
    if "covariance" in found:
        covariance = np.array(found["covariance"], float)
        turn = np.array([[cos(heading), sin(heading)], [-sin(heading), cos(heading)]])
        place[:2, :2] = covariance[:2, :2]
        motion[:2, :2] = turn @ covariance[2:, 2:] @ turn.T
    return _odometry(header(now), name, (x, y, heading), place, (hypot(vx, vy), 0.0), motion)


def _odometry(header_: Any, child: str, at: tuple, place: Array, twist: tuple, motion: Array) -> Any:
    v, omega = twist
    return ros.nav_msgs__msg__Odometry(
        header_,
        child,
        ros.geometry_msgs__msg__PoseWithCovariance(planar_pose(*at), planar_covariance(place)),
        ros.geometry_msgs__msg__TwistWithCovariance(
            ros.geometry_msgs__msg__Twist(vector(x=v), vector(z=omega)), planar_covariance(motion)
        ),
    )
