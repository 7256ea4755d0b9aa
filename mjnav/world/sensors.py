"""What the robot measures: exact values from the engine plus every channel's noise."""

from math import floor, pi

import numpy as np

from mjnav.geometry.angles import wrap
from mjnav.messages import Array, Reading
from mjnav.motion.unicycle import integrate
from mjnav.scene.spec import Scenario
from mjnav.world.draws import NEVER, Draws
from mjnav.world.engine import Engine
from mjnav.world.lidar import scanner

_ROBOT_CHANNELS = ("odometry.v", "odometry.omega", "gyro", "pose.x", "pose.y", "pose.theta")


class NoisySensors:
    """All sensors, read together. Each reading draws equally often from every stream, whatever there is to see."""

    def __init__(self, scenario: Scenario, seed: int, *, lidar: bool = True):
        """Without `lidar` no rays are cast."""
        distributions = scenario.noise.distributions()
        people = [f"person{i}" for i in range(len(scenario.people))]
        columns = [(channel, "robot") for channel in _ROBOT_CHANNELS]
        columns += [(f"detection.{axis}", person) for person in people for axis in "xy"]
        self._draws = Draws(scenario.noise, columns, seed, 1.0 / scenario.sensors.rate)
        self._is_exact = all(distributions[f"detection.{axis}"].std == 0.0 for axis in "xy")
        self._range = scenario.sensors.detection_range
        self._radius = np.array([person.radius for person in scenario.people])
        self._robot_radius, self._drive = scenario.robot.radius, scenario.robot.drive
        base = scenario.robot.base
        self._tick = 0.0 if base is None or not base.encoder_ticks else 2.0 * pi / base.encoder_ticks  # [rad]
        self._lidar = scanner(scenario, seed) if lidar else None
        self._odometry_pose = np.zeros(3)
        self._before: tuple[float, tuple[float, float], float] | None = None  # time, wheel angles, yaw

    @property
    def next_packet(self) -> int:
        """The step at which the lidar takes its next beams between readings."""
        return NEVER if self._lidar is None else self._lidar.next

    def take_packet(self, engine: Engine, step: int) -> None:
        """Takes the lidar's beams that are due at the present step."""
        if self._lidar is not None:
            self._lidar.take(engine, step)

    def read(self, engine: Engine, time: float, radius: Array | None = None) -> Reading:
        """A reading of the present moment.

        Odometry is the mean twist since the reading before by the encoders, the gyro's value the mean yaw rate: its
        exact integral, as a rate-integrating gyro gives it. In the first reading both are noise alone. The odometry's
        pose is integrated from what odometry says, from (0, 0, 0) on. `radius` (P,) is the people's, where it changes
        in the run.
        """
        noise = self._draws.row()
        wheels, yaw, pose = engine.wheel_angles(), engine.yaw(), engine.robot_pose()
        if self._tick:
            wheels = (self._tick * floor(wheels[0] / self._tick), self._tick * floor(wheels[1] / self._tick))
        interval, odometry, turn_rate = 0.0, np.zeros(2), 0.0
        if self._before is not None:
            time_before, (left, right), yaw_before = self._before
            interval = time - time_before
            odometry[:] = self._drive.twist((wheels[0] - left) / interval, (wheels[1] - right) / interval)
            turn_rate = (yaw - yaw_before) / interval
        self._before = time, wheels, yaw
        odometry += noise[:2]
        self._odometry_pose = integrate(self._odometry_pose, odometry[0], odometry[1], interval)
        people = engine.people_position()
        if self._range is not None:
            gaps = np.hypot(*(people - pose[:2]).T) - self._robot_radius - (self._radius if radius is None else radius)
            people[gaps > self._range] = np.nan
        pose += noise[3:6]
        pose[2] = wrap(pose[2])
        scan, scan_times = self._lidar.scan(engine) if self._lidar is not None else (np.zeros(0), np.zeros(0))
        return Reading(
            time=time,
            interval=interval,
            odometry=odometry,
            gyro=float(turn_rate + noise[2]),
            pose=pose,
            detections=people + noise[6:].reshape(-1, 2),
            scan=scan,
            odometry_pose=self._odometry_pose,
            scan_times=scan_times,
            people_radius=radius,
            people_velocity=None if radius is None or not self._is_exact else engine.people_velocity(),
        )
