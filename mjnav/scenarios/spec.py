"""A run file as frozen dataclasses. Each checks its own values; `check` checks what lies between them.

Field names are the run file's keys, but `start` and `end` of a wall, which the file calls `from` and `to`.
"""

from collections.abc import Mapping, Sized
from dataclasses import dataclass, field

from mjnav.errors import InvalidValue, unknown_name
from mjnav.messages import RobotLimits
from mjnav.noise import CHANNELS, Distribution, make_distribution, profile, profile_names
from mjnav.scenarios.bodies import LaneSpec as LaneSpec
from mjnav.scenarios.bodies import Pillar as Pillar
from mjnav.scenarios.bodies import Table as Table
from mjnav.scenarios.bodies import Wall as Wall
from mjnav.scenarios.latency import Latency as Latency
from mjnav.scenarios.people import BEHAVIOURS as BEHAVIOURS
from mjnav.scenarios.people import Behaviour as Behaviour
from mjnav.scenarios.people import ConstantVelocity as ConstantVelocity
from mjnav.scenarios.people import Person as Person
from mjnav.scenarios.people import StopAndGo as StopAndGo
from mjnav.scenarios.people import Waypoints as Waypoints
from mjnav.scenarios.ranges import (
    MAX_BODIES,
    MAX_POINTS,
    MAX_RATE,
    MAX_SAMPLES,
    MAX_SEED,
    MAX_SPREAD,
    MAX_TIME,
    MIN_RATE,
    Point,
    check_coordinates,
    check_count,
    check_range,
    check_size,
)


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
        check_coordinates("start", self.start)
        if self.goal is None and not self.waypoints:
            raise InvalidValue("goal", None, "goal = [x, y] or waypoints = [[x, y], ...]: one of the two is required")
        if self.goal is not None and self.waypoints:
            raise InvalidValue("waypoints", self.waypoints, "goal or waypoints, not both")
        check_count("waypoints", self.waypoints, MAX_POINTS)
        for point in self.route:
            check_coordinates("goal" if self.goal is not None else "waypoints", point)
        check_size("goal_tolerance", self.goal_tolerance)
        check_range("radius", self.radius, 0.2, 0.5)
        check_range("max_speed", self.max_speed, 0.01, 10.0)
        check_range("min_speed", self.min_speed, -10.0, 10.0)
        check_range("max_turn_rate", self.max_turn_rate, 0.01, 100.0)
        check_range("max_acceleration", self.max_acceleration, 0.01, 100.0)
        check_range("max_turn_acceleration", self.max_turn_acceleration, 0.01, 1000.0)
        limits = self.limits  # checks what lies between them
        check_range("preferred_speed", self.preferred_speed, 0.01, limits.max_speed)

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
class ChannelNoise:
    """One channel's distribution by name, and its arguments as the file has them."""

    distribution: str
    arguments: Mapping[str, object] = field(default_factory=dict)

    def __post_init__(self):
        made = self.make()
        for name, value in (("mean", made.mean), ("standard deviation", made.std)):
            if not abs(value) <= MAX_SPREAD:
                raise InvalidValue(
                    "", f"a {name} of {value:g}", f"a mean and a standard deviation up to {MAX_SPREAD:g}"
                )
        for key, argument in self.arguments.items():
            if isinstance(argument, Sized) and not isinstance(argument, str):
                check_count(key, argument, MAX_SAMPLES)

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
        check_range("rate", self.rate, MIN_RATE, MAX_RATE)
        check_range("lidar_beams", self.lidar_beams, 1, 10_000)
        check_range("lidar_range", self.lidar_range, 0.1, 1000.0)


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
    delay: int = 1  # periods
    latency: Latency | None = None  # in place of `delay`
    prediction: bool = True  # beliefs are carried to the moment at which the decision takes effect
    parameters: Mapping[str, object] = field(default_factory=dict)

    def __post_init__(self):
        check_range("rate", self.rate, MIN_RATE, MAX_RATE)
        check_range("delay", self.delay, 0, 100)
        if self.latency is not None:
            try:
                self.latency.check_expected(self.period)
            except InvalidValue as error:
                raise error.within("latency") from None

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
        check_range("timestep", self.timestep, 1e-5, 0.02)


@dataclass(frozen=True, slots=True)
class LogContent:
    """What a log holds beside the data. It changes nothing in the run."""

    drawings: bool = False  # of the data, for programs that draw only what a log holds as shapes


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
    log: LogContent | None = None  # not in a dump unless it was given: the names of a study's cells are made of those
    source: str = field(default="", compare=False)  # the file it came from, for messages

    def __post_init__(self):
        if self.schema != 1:
            raise InvalidValue("schema", self.schema, "1")
        name = self.name
        if not 1 <= len(name) <= 100 or not name.isprintable() or "/" in name or not name.strip(". "):
            allowed = 'up to 100 printable characters without "/", not dots alone: logs are named after it'
            raise InvalidValue("name", name, allowed)
        check_range("seed", self.seed, 0, MAX_SEED)
        check_range("time_limit", self.time_limit, 0.0, MAX_TIME, open_low=True)
        for key in ("walls", "tables", "pillars", "people"):
            check_count(key, getattr(self, key), MAX_BODIES)
        for key, rate in (("control.rate", self.control.rate), ("sensors.rate", self.sensors.rate)):
            steps = 1.0 / (rate * self.physics.timestep)
            if round(steps) < 1 or abs(steps - round(steps)) > 1e-6 * steps:
                raise InvalidValue(
                    key,
                    rate,
                    f"a rate whose period is a whole number of steps of physics.timestep ({self.physics.timestep:g} s)",
                )
