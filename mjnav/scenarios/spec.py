"""A run file as frozen dataclasses. Each checks its own values; `load` checks what lies between them.

Field names are the run file's keys, but `start` and `end` of a wall, which the file calls `from` and `to`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf, isfinite
from types import MappingProxyType

import numpy as np

from mjnav.errors import InvalidValue, unknown_name
from mjnav.messages import Array, RobotLimits
from mjnav.noise import CHANNELS, Distribution, make_distribution, profile, profile_names

Point = tuple[float, float]
MAX_WALKING_SPEED = 5.0  # [m/s]


def check_range(key: str, value: float, low: float, high: float, *, open_low: bool = False) -> None:
    """Refuses a value outside [low, high], or outside (low, high] with `open_low`."""
    if not (low < value if open_low else low <= value) or not value <= high or not isfinite(value):
        sign = ">" if open_low else ">="
        raise InvalidValue(key, value, f"a number {sign} {low:g}" + (f" and <= {high:g}" if isfinite(high) else ""))


def check_finite(key: str, values: tuple[float, ...]) -> None:
    """Refuses a coordinate that is infinite or not a number."""
    if not all(isfinite(value) for value in values):
        raise InvalidValue(key, values, "finite numbers")


@dataclass(frozen=True, slots=True)
class Robot:
    """Where the robot starts, where it goes and what it can do."""

    start: tuple[float, float, float]
    goal: Point | None = None
    waypoints: tuple[Point, ...] = ()
    goal_tolerance: float = 0.3
    preferred_speed: float = 0.8
    max_speed: float = 1.0
    min_speed: float = 0.0
    max_turn_rate: float = 1.5
    max_acceleration: float = 1.0
    max_turn_acceleration: float = 3.0
    radius: float = 0.22

    def __post_init__(self):
        check_finite("start", self.start)
        if self.goal is None and not self.waypoints:
            raise InvalidValue("goal", None, "goal = [x, y] or waypoints = [[x, y], ...]: one of the two is required")
        if self.goal is not None and self.waypoints:
            raise InvalidValue("waypoints", self.waypoints, "goal or waypoints, not both")
        for point in self.route:
            check_finite("goal" if self.goal is not None else "waypoints", point)
        check_range("goal_tolerance", self.goal_tolerance, 0.0, inf, open_low=True)
        check_range("radius", self.radius, 0.2, 0.5)
        limits = self.limits
        check_range("preferred_speed", self.preferred_speed, 0.0, limits.max_speed, open_low=True)

    @property
    def route(self) -> tuple[Point, ...]:
        """The points to reach, the last of which is the goal."""
        return (self.goal,) if self.goal is not None else self.waypoints

    @property
    def limits(self) -> RobotLimits:
        """The limits as controllers take them."""
        return RobotLimits(
            max_speed=self.max_speed,
            min_speed=self.min_speed,
            max_turn_rate=self.max_turn_rate,
            max_acceleration=self.max_acceleration,
            max_turn_acceleration=self.max_turn_acceleration,
            radius=self.radius,
        )


@dataclass(frozen=True, slots=True)
class Wall:
    """A straight wall between two points."""

    start: Point
    end: Point
    thickness: float = 0.1
    height: float = 1.0

    def __post_init__(self):
        check_finite("from", self.start)
        check_finite("to", self.end)
        if self.start == self.end:
            raise InvalidValue("to", self.end, "a point other than `from`")
        check_range("thickness", self.thickness, 0.0, inf, open_low=True)
        check_range("height", self.height, 0.0, inf, open_low=True)


@dataclass(frozen=True, slots=True)
class Table:
    """A table on four legs; `size` is measured between the legs' centres."""

    position: Point
    yaw: float = 0.0
    size: Point = (1.6, 0.8)
    leg_radius: float = 0.03
    height: float = 0.74

    def __post_init__(self):
        check_finite("position", self.position)
        check_finite("yaw", (self.yaw,))
        check_range("leg_radius", self.leg_radius, 0.0, inf, open_low=True)
        for side in self.size:
            check_range("size", side, 2.0 * self.leg_radius, inf, open_low=True)
        check_range("height", self.height, 0.5, inf)

    @property
    def legs(self) -> Array:
        """Centres of the four legs, (4, 2)."""
        corners = 0.5 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * self.size
        c, s = np.cos(self.yaw), np.sin(self.yaw)
        return np.asarray(self.position) + corners @ np.array([[c, s], [-s, c]])


@dataclass(frozen=True, slots=True)
class Pillar:
    """A round pillar."""

    position: Point
    radius: float = 0.2
    height: float = 1.0

    def __post_init__(self):
        check_finite("position", self.position)
        check_range("radius", self.radius, 0.0, inf, open_low=True)
        check_range("height", self.height, 0.0, inf, open_low=True)


@dataclass(frozen=True, slots=True)
class LaneSpec:
    """Two lines a x + b y + c = 0; the left one keeps d <= 0, the right one d >= 0."""

    left: tuple[float, float, float]
    right: tuple[float, float, float]

    def __post_init__(self):
        for key in ("left", "right"):
            line = getattr(self, key)
            check_finite(key, line)
            if line[0] == 0.0 and line[1] == 0.0:
                raise InvalidValue(key, line, "a line a x + b y + c = 0 with a or b other than 0")


# ------------------------------------------------------------------------------------------- people


@dataclass(frozen=True, slots=True)
class ConstantVelocity:
    """Walks straight on."""

    velocity: Point

    def __post_init__(self):
        check_range("velocity", float(np.hypot(*self.velocity)), 0.0, MAX_WALKING_SPEED)


@dataclass(frozen=True, slots=True)
class StopAndGo:
    """Walks straight on for `go_time`, stands for `stop_time`, and so on; seconds."""

    velocity: Point
    go_time: float = 2.0
    stop_time: float = 1.0

    def __post_init__(self):
        check_range("velocity", float(np.hypot(*self.velocity)), 0.0, MAX_WALKING_SPEED)
        check_range("go_time", self.go_time, 0.0, inf, open_low=True)
        check_range("stop_time", self.stop_time, 0.0, inf)


@dataclass(frozen=True, slots=True)
class Waypoints:
    """Walks from point to point; with `loop` from the last back to the first, else stands at the last."""

    waypoints: tuple[Point, ...]
    speed: float = 1.0
    loop: bool = True

    def __post_init__(self):
        if not self.waypoints:
            raise InvalidValue("waypoints", self.waypoints, "at least one point")
        for point in self.waypoints:
            check_finite("waypoints", point)
        check_range("speed", self.speed, 0.0, MAX_WALKING_SPEED)


Behaviour = ConstantVelocity | StopAndGo | Waypoints
BEHAVIOURS: Mapping[str, type[Behaviour]] = MappingProxyType(
    {"constant_velocity": ConstantVelocity, "stop_and_go": StopAndGo, "waypoints": Waypoints}
)


@dataclass(frozen=True, slots=True)
class Person:
    """A walking person; the file has the behaviour's name in `behaviour` and its keys beside it."""

    start: Point
    behaviour: Behaviour
    radius: float = 0.3

    def __post_init__(self):
        check_finite("start", self.start)
        check_range("radius", self.radius, 0.1, 1.0)


# ---------------------------------------------------------------------- noise, estimation, control


@dataclass(frozen=True, slots=True)
class ChannelNoise:
    """One channel's distribution by name, and its arguments as the file has them."""

    distribution: str
    arguments: Mapping[str, object] = field(default_factory=dict)

    def __post_init__(self):
        self.make()

    def make(self) -> Distribution:
        """The distribution."""
        return make_distribution(self.distribution, **self.arguments)


@dataclass(frozen=True, slots=True)
class Noise:
    """A profile for all channels, and channels of one's own in place of the profile's."""

    profile: str = "pearson"
    channels: Mapping[str, ChannelNoise] = field(default_factory=dict)

    def __post_init__(self):
        if self.profile not in profile_names():
            raise unknown_name("profile", self.profile, profile_names())
        for channel in self.channels:
            if channel not in CHANNELS:
                raise unknown_name("", channel, CHANNELS)

    def distributions(self) -> dict[str, Distribution]:
        """The distribution of every channel."""
        own = {channel: noise.make() for channel, noise in self.channels.items()}
        return {**profile(self.profile), **own}


@dataclass(frozen=True, slots=True)
class Sensors:
    """Rates and ranges of the sensors; they do not follow the control rate."""

    rate: float = 10.0
    lidar_beams: int = 360
    lidar_range: float = 10.0

    def __post_init__(self):
        check_range("rate", self.rate, 0.0, 1000.0, open_low=True)
        check_range("lidar_beams", self.lidar_beams, 1, 10_000)
        check_range("lidar_range", self.lidar_range, 0.0, 1000.0, open_low=True)


def _check_choice(key: str, value: str, names: tuple[str, ...]) -> None:
    if value not in names:
        raise unknown_name(key, value, names)


@dataclass(frozen=True, slots=True)
class RobotEstimation:
    """How the robot's pose is estimated."""

    source: str = "pose"
    filter: str = "particle"
    particles: int = 500

    def __post_init__(self):
        _check_choice("source", self.source, ("pose", "direct"))
        _check_choice("filter", self.filter, ("particle", "ekf", "ukf"))
        check_range("particles", self.particles, 2, 1_000_000)


@dataclass(frozen=True, slots=True)
class ObstacleEstimation:
    """How each person's position and velocity are estimated."""

    source: str = "detections"
    filter: str = "particle"
    particles: int = 200

    def __post_init__(self):
        _check_choice("source", self.source, ("detections", "direct"))
        _check_choice("filter", self.filter, ("particle", "kalman"))
        check_range("particles", self.particles, 2, 1_000_000)


@dataclass(frozen=True, slots=True)
class Estimation:
    """The estimators; with `assumed_profile` they believe in another noise than the world's."""

    robot: RobotEstimation = RobotEstimation()
    obstacles: ObstacleEstimation = ObstacleEstimation()
    assumed_profile: str | None = None

    def __post_init__(self):
        if self.assumed_profile is not None and self.assumed_profile not in profile_names():
            raise unknown_name("assumed_profile", self.assumed_profile, profile_names())


@dataclass(frozen=True, slots=True)
class Control:
    """The controller by name, its own parameters, and when its decisions take effect."""

    method: str = "rkhs"
    rate: float = 10.0
    delay: int = 1
    parameters: Mapping[str, object] = field(default_factory=dict)

    def __post_init__(self):
        check_range("rate", self.rate, 0.0, 1000.0, open_low=True)
        check_range("delay", self.delay, 0, 100)

    @property
    def period(self) -> float:
        """[s]"""
        return 1.0 / self.rate


@dataclass(frozen=True, slots=True)
class Physics:
    """The engine and its step [s]."""

    engine: str = "mujoco"
    timestep: float = 0.002

    def __post_init__(self):
        _check_choice("engine", self.engine, ("mujoco", "kinematic"))
        check_range("timestep", self.timestep, 0.0, 0.02, open_low=True)


@dataclass(frozen=True, slots=True)
class Scenario:
    """One run: everything but the code that decides what happens."""

    name: str
    robot: Robot
    schema: int = 1
    description: str = ""
    seed: int = 0
    time_limit: float = 60.0
    stop_on_collision: bool = True
    walls: tuple[Wall, ...] = ()
    tables: tuple[Table, ...] = ()
    pillars: tuple[Pillar, ...] = ()
    lanes: LaneSpec | None = None
    people: tuple[Person, ...] = ()
    noise: Noise = Noise()
    sensors: Sensors = Sensors()
    estimation: Estimation = Estimation()
    control: Control = Control()
    physics: Physics = Physics()
    source: str = field(default="", compare=False)  # the file it came from, for messages

    def __post_init__(self):
        if self.schema != 1:
            raise InvalidValue("schema", self.schema, "1")
        check_range("seed", self.seed, 0, 2**63 - 1)
        check_range("time_limit", self.time_limit, 0.0, inf, open_low=True)
        for key, period in (("control.rate", self.control.period), ("sensors.rate", 1.0 / self.sensors.rate)):
            steps = period / self.physics.timestep
            if round(steps) < 1 or abs(steps - round(steps)) > 1e-6 * steps:
                raise InvalidValue(
                    key,
                    1.0 / period,
                    f"a rate whose period is a whole number of steps of physics.timestep ({self.physics.timestep:g} s)",
                )
