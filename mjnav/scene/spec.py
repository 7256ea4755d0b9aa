"""A run file as frozen dataclasses. Each checks its own values; `check` checks what lies between them.

Field names are the run file's keys, but `start` and `end` of a wall, which the file calls `from` and `to`.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from math import hypot
from types import MappingProxyType
from typing import Annotated, Any

import numpy as np

from mjnav.constant import Constant
from mjnav.errors import InvalidValue
from mjnav.messages import TRACK_WIDTH, RobotLimits
from mjnav.motion.unicycle import Drive
from mjnav.noise import CHANNELS, TIMED_CHANNELS, Distribution, NamedDistribution, made, profile, profile_names

# Users of scenarios find all parts of one here.
from mjnav.scene.bodies import KnownBodies, LaneSpec, MapDifference, Pillar, Table, Wall
from mjnav.scene.crowd import Crowd
from mjnav.scene.draws import Draft, Layout
from mjnav.scene.faults import Faults
from mjnav.scene.map_file import MapFile
from mjnav.scene.people import BEHAVIOURS, ConstantVelocity, Orca, Person, SocialForce, StopAndGo, Waypoints  # noqa: F401
from mjnav.scene.prediction import Prediction
from mjnav.scene.published import Published
from mjnav.scene.ranges import MAX_BODIES, MAX_POINTS, MAX_TIME, MAX_WALLS, Angle, Coordinate, Point, Rate, Seed, Size
from mjnav.scene.robot import OWN, Base, covering
from mjnav.scene.route import Route
from mjnav.scene.sensors import Sensors
from mjnav.settings import Beside, Choice, Length, Named, Range, Settled, Text, below, settle
from mjnav.settings.plugins import LocalizerPlugin, MetricPlugin, TrackerPlugin, placed

_PREFERRED_SPEED = 0.8  # [m/s]
Discs = Annotated[int, Range(1, 20)]
_ROUNDED = 1e-3  # [m] by which a footprint may be longer than the round body, as radii are given to a millimetre
OWN_RADIUS = 0.2  # [m]
ENGINES: Mapping[str, str] = MappingProxyType(
    {
        "mujoco": "MuJoCo physics: wheels that slip, forces of contact, people who can be pushed.",
        "kinematic": "A unicycle and discs that stop at what they touch: several times as fast.",
    }
)
_PARTICLES = Range(2, 1_000_000)
MAX_METRICS = 100
Name = Annotated[
    str,
    Text(
        r"[^/]*[^/. ][^/]*",
        100,
        'up to 100 printable characters without "/", not dots alone: logs are named after it',
    ),
]


@dataclass(frozen=True, slots=True)
class Robot(Settled):
    """Where the robot starts, where it goes and what it can do."""

    start: Annotated[tuple[Coordinate, Coordinate, Angle], "x, y and heading of the first moment"]
    goal: Annotated[Point | None, "where the run ends; or give waypoints"] = None
    waypoints: Annotated[
        tuple[Point, ...], Length(0, MAX_POINTS), "points to drive through, the last of them the goal"
    ] = ()
    goal_tolerance: Annotated[Size, "distance within which the goal is reached"] = 0.3
    preferred_speed: Annotated[float, Range(0.01, 10.0, "m/s"), "speed on a free way, at most max_speed"] = (
        _PREFERRED_SPEED
    )
    max_speed: Annotated[float, Range(0.01, 10.0, "m/s"), "highest speed forwards"] = 1.0
    min_speed: Annotated[float, Range(-10.0, 10.0, "m/s"), "lowest speed; below 0 the robot may reverse"] = 0.0
    max_turn_rate: Annotated[float, Range(0.01, 100.0, "rad/s"), "in both directions"] = 1.5
    max_acceleration: Annotated[float, Range(0.01, 100.0, "m/s²"), "of commands, also to brake"] = 1.0
    max_turn_acceleration: Annotated[float, Range(0.01, 1000.0, "rad/s²"), "of commands"] = 3.0
    radius: Annotated[float, Range(0.1, 0.5, "m"), "of the round body; from 0.2 m on for mjnav's own"] = 0.22
    footprint: Annotated[tuple[Size, Size] | None, "length and width of a box that is within the round body"] = None
    discs: Annotated[Discs | None, "in a row, that cover the footprint and are the body; else it is round"] = None
    model: Annotated[str, "a robot that `mjnav list robots` prints, or the path of a robot's file, .toml"] = OWN
    base: Annotated[Base | None, "of a robot that is not mjnav's own; loading the file puts it here"] = None

    def _check(self):
        if self.goal is None and not self.waypoints:
            raise InvalidValue("goal", None, "goal = [x, y] or waypoints = [[x, y], ...]: one of the two is required")
        if self.goal is not None and self.waypoints:
            raise InvalidValue("waypoints", self.waypoints, "goal or waypoints, not both")
        if self.base is None and self.radius < OWN_RADIUS:
            raise InvalidValue("radius", self.radius, f"at least {OWN_RADIUS:g} m: mjnav's robot has its wheels inside")
        if self.footprint is not None and self.base is None:
            raise InvalidValue("footprint", self.footprint, "nothing: mjnav's own robot is round")
        if self.discs is not None and self.footprint is None:
            raise InvalidValue("discs", self.discs, "nothing without a footprint = [length, width] to cover")
        if self.footprint is not None and hypot(*self.footprint) > 2.0 * self.radius + _ROUNDED:
            allowed = f"a box within the round body, at most {2.0 * self.radius:g} m from corner to corner"
            raise InvalidValue("footprint", self.footprint, allowed)
        limits = self.limits  # checks what lies between them
        Range(0.01, limits.max_speed, "m/s").check("preferred_speed", self.preferred_speed)

    @staticmethod
    def dependent_defaults(arguments: Mapping[str, Any]) -> dict[str, Any]:
        """A robot that is slower than the default of preferred_speed prefers its full speed."""
        return {"preferred_speed": min(_PREFERRED_SPEED, arguments.get("max_speed", _PREFERRED_SPEED))}

    @property
    def route(self) -> tuple[Point, ...]:
        """The points to reach, the last of which is the goal."""
        return (self.goal,) if self.goal is not None else self.waypoints

    def route_key(self, place: int) -> str:
        """The run file's key of a point of the route."""
        return "robot.goal" if self.goal is not None else f"robot.waypoints.{place}"

    @property
    def drive(self) -> Drive:
        """Wheel speeds and twists."""
        return Drive() if self.base is None else self.base.drive

    @property
    def track_width(self) -> float:
        """Between the wheels' contact points [m]."""
        return TRACK_WIDTH if self.base is None else self.base.track_width

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
            track_width=self.track_width,
            cover=covering(*self.footprint, self.discs) if self.footprint and self.discs else (),
        )


@dataclass(frozen=True, slots=True)
class Noise(Settled):
    """A profile for all channels, and distributions of single channels in place of the profile's."""

    profile: Annotated[str, Choice(profile_names()), "noise of all channels"] = "pearson"
    channels: Annotated[
        Mapping[str, NamedDistribution],
        Named(CHANNELS, "CHANNEL"),
        Beside(),
        "noise of one channel in place of the profile's",
    ] = field(default_factory=dict)
    correlation_time: Annotated[
        Mapping[str, Annotated[float, Range(0.001, 1e4, "s")]],
        Named(TIMED_CHANNELS, "CHANNEL"),
        "of the channel's errors: exp(-1) is left of a correlation after it; particles of the pose know theirs",
    ] = field(default_factory=dict)

    def distributions(self) -> dict[str, Distribution]:
        """The distribution of every channel. One of a user's own is imported here, and checked."""
        return {**profile(self.profile), **{name: made(channel) for name, channel in self.channels.items()}}


@dataclass(frozen=True, slots=True)
class RobotEstimation:
    """How the robot's pose is estimated."""

    source: Annotated[
        str,
        Choice(("pose", "lidar", "direct")),
        "pose: filtered readings of the pose sensor; lidar: filtered scans, odometry and gyro; direct: one reading of "
        "the pose sensor minus draws of its noise",
    ] = "pose"
    filter: Annotated[str, Choice(("particle", "ekf")), "of the pose; none where source is direct"] = "particle"
    particles: Annotated[
        int, _PARTICLES, "number of particles or draws; where source is lidar the most that the particle filter takes"
    ] = 500
    start: Annotated[
        Annotated[str, Choice(("known", "global"))] | None,
        "where source is lidar: known, about robot.start, or global, anywhere on the map's floor; by default known",
    ] = None
    localizer: Annotated[
        str | LocalizerPlugin | None, "package.module:Class or file.py:Class, in place of source and filter"
    ] = None

    def __post_init__(self):
        with below("localizer"):
            object.__setattr__(self, "localizer", LocalizerPlugin.of(self.localizer))
        settle(self)


@dataclass(frozen=True, slots=True)
class ObstacleEstimation:
    """How each person's position and velocity are estimated."""

    source: Annotated[
        str,
        Choice(("detections", "lidar", "direct")),
        "detections: filtered, with identity; lidar: found in scans and filtered; direct: one detection minus draws of "
        "its noise",
    ] = "detections"
    filter: Annotated[
        str,
        Choice(("particle", "rao-blackwell", "kalman")),
        "of each person; particle: each particle is a history of walks, turns and stops with a Kalman filter of its "
        "own; rao-blackwell: the same; none where source is direct",
    ] = "particle"
    particles: Annotated[int, _PARTICLES, "number of particles or draws of each person"] = 200
    tracker: Annotated[
        str | TrackerPlugin | None, "package.module:Class or file.py:Class, in place of source and filter"
    ] = None

    def __post_init__(self):
        with below("tracker"):
            object.__setattr__(self, "tracker", TrackerPlugin.of(self.tracker))
        settle(self)


@dataclass(frozen=True, slots=True)
class Estimation(Settled):
    """The estimators; with `assumed_profile` they believe in that noise, and take its errors for independent."""

    robot: RobotEstimation = RobotEstimation()
    obstacles: ObstacleEstimation = ObstacleEstimation()
    assumed_profile: Annotated[
        Annotated[str, Choice(profile_names())] | None, "noise that the estimators believe in; the world's by default"
    ] = None
    map: Annotated[
        MapDifference | None, "of the map that estimators and controller have; by default it is the world's"
    ] = None


Delay = Annotated[float, Range(0.0, 1000.0, "s")]  # up to a hundred periods of the slowest loop, as control.delay
MAX_PENDING = 1000  # commands that are decided but not yet in force


@dataclass(frozen=True, slots=True)
class Latency(Settled):
    """A decision takes effect when it has been computed, at the next physics step; in place of `delay`.

    `sampled` takes that time from a trace: drawn from it, or in the order in which it was recorded, over and over.
    `measured` takes the time that this machine needed: such a run cannot be repeated, but its log holds a scenario that
    does repeat it.
    """

    model: Annotated[str, Choice(("sampled", "measured")), "sampled: from the trace; measured: this machine's"] = (
        "sampled"
    )
    trace: Annotated[tuple[Delay, ...], "compute times, or in a file the path of a text file of them"] = ()
    order: Annotated[str, Choice(("drawn", "recorded")), "in which a trace's times are taken"] = "drawn"
    planned: Annotated[Delay | None, "what the prediction counts on: else the trace's median, or half a period"] = None

    def _check(self):
        if self.model == "sampled" and not self.trace:
            raise InvalidValue("trace", None, "compute times [s], or the path of a text file of them")
        if self.model == "measured" and self.trace:
            raise InvalidValue("trace", self.trace, 'a trace for model "sampled" only')

    def expected(self, period: float) -> float:
        """What the prediction counts on where the control period is `period`, both [s]."""
        if self.planned is not None:
            return self.planned
        return float(np.median(self.trace)) if self.trace else 0.5 * period

    def check_expected(self, period: float) -> None:
        """Refuses to carry beliefs through more than MAX_PENDING commands at every tick."""
        if self.expected(period) > MAX_PENDING * period:
            found = f"{self.expected(period):g} s at a period of {period:g} s"
            raise InvalidValue(
                "planned", found, f"at most {MAX_PENDING} periods: every tick predicts through all of them"
            )


@dataclass(frozen=True, slots=True)
class Control(Settled):
    """The controller by name, its own parameters, and when its decisions take effect."""

    method: Annotated[str, "a name that `mjnav list` prints, package.module:Class or file.py:Class"] = "rkhs"
    rate: Annotated[Rate, "decisions a second"] = 10.0
    delay: Annotated[int, Range(0, 100, "periods"), "number of periods after which a decision takes effect"] = 1
    latency: Annotated[Latency | None, "when a decision takes effect, in place of delay"] = None
    prediction: Annotated[bool, "carry beliefs to the moment at which the decision takes effect"] = True
    parameters: Annotated[Mapping[str, object], Beside()] = field(default_factory=dict)

    def _check(self):
        object.__setattr__(self, "method", placed(self.method))
        if self.latency is not None:
            with below("latency"):
                self.latency.check_expected(self.period)

    @property
    def period(self) -> float:
        """[s]"""
        return 1.0 / self.rate

    @property
    def expected_delay(self) -> float:
        """[s] from a tick to the moment that its observation is of: when the decision is expected to take effect."""
        if not self.prediction:
            return 0.0
        return self.delay * self.period if self.latency is None else self.latency.expected(self.period)


@dataclass(frozen=True, slots=True)
class Physics(Settled):
    """The engine and its step."""

    engine: Annotated[str, Choice(ENGINES), "mujoco: wheels and contacts; kinematic: a unicycle and discs, quicker"] = (
        "mujoco"
    )
    timestep: Annotated[float, Range(1e-5, 0.02, "s"), "of the physics"] = 0.002


@dataclass(frozen=True, slots=True)
class Scenario(Constant):
    """One run: everything but the code that decides what happens."""

    name: Annotated[Name, "of the scene, in results and in the names of logs"]
    robot: Robot
    schema: Annotated[int, Range(1, 1), "version of this format"] = 1
    description: Annotated[str, "one line that `mjnav list` prints"] = ""
    seed: Annotated[Seed, "of all random streams of the run"] = 0
    time_limit: Annotated[float, Range(0.0, MAX_TIME, "s", open_low=True), "simulated time at which the run ends"] = (
        60.0
    )
    stop_on_collision: Annotated[bool, "end the run at the first contact"] = True
    walls: Annotated[tuple[Wall, ...], Length(0, MAX_WALLS)] = ()
    tables: Annotated[tuple[Table, ...], Length(0, MAX_BODIES)] = ()
    pillars: Annotated[tuple[Pillar, ...], Length(0, MAX_BODIES)] = ()
    lanes: LaneSpec | None = None
    people: Annotated[tuple[Person, ...], Length(0, MAX_BODIES)] = ()
    map: Annotated[MapFile | None, "a map of the floor; loading the file puts its walls behind `walls`"] = None
    crowd: Annotated[Crowd | None, "people from a recording; loading the file puts them behind `people`"] = None
    noise: Noise = Noise()
    sensors: Sensors = Sensors()  # noqa: RUF009 - it is frozen
    estimation: Estimation = Estimation()
    control: Control = Control()
    physics: Physics = Physics()
    # These are not in a dump unless they were given: the names of a study's cells are made of those.
    people_see_robot: Annotated[bool | None, "in place of sees_robot of every person, for the whole scene at once"] = (
        None
    )
    route: Route | None = None
    layout: Layout | None = None
    published: Published | None = None
    prediction: Prediction | None = None
    faults: Faults | None = None
    metrics: Annotated[
        Annotated[tuple[str | MetricPlugin, ...], Length(0, MAX_METRICS)] | None,
        "of one's own, each package.module:Class or file.py:Class",
    ] = None
    source: str = field(default="", compare=False)  # the file it came from, for messages
    draft: Draft | None = field(default=None, compare=False, repr=False)  # of a random scene, what it was drawn from

    def __post_init__(self):
        if isinstance(self.metrics, list | tuple):
            object.__setattr__(self, "metrics", tuple(_metrics(self.metrics)))
        settle(self)
        if self.people_see_robot is not None:
            people = tuple(replace(person, sees_robot=self.people_see_robot) for person in self.people)
            object.__setattr__(self, "people", people)
        for key, rate in (("control.rate", self.control.rate), ("sensors.rate", self.sensors.rate)):
            steps = 1.0 / (rate * self.physics.timestep)
            if round(steps) < 1 or abs(steps - round(steps)) > 1e-6 * steps:
                raise InvalidValue(
                    key,
                    rate,
                    f"a rate whose period is a whole number of steps of physics.timestep ({self.physics.timestep:g} s)",
                )

        with below("estimation"), below("map"):
            _ = self.known_bodies

    @property
    def draws_map(self) -> bool:
        """Whether the robot draws a map by its lidar, alone or beside the one it has."""
        return self.estimation.map is not None and self.estimation.map.source != "world"

    @property
    def known_bodies(self) -> KnownBodies:
        """What stands on the map that estimators and controller have."""
        world = KnownBodies.of(self.walls, self.tables, self.pillars)
        return world if self.estimation.map is None else self.estimation.map.applied(world)

    def __repr__(self) -> str:
        counts = ((len(getattr(self, f"{kind}s")), kind) for kind in ("wall", "table", "pillar"))
        parts = [f"{n} {kind}{'s' * (n > 1)}" for n, kind in counts if n]
        parts += ["lanes"] * (self.lanes is not None)
        if self.people:
            parts.append(f"{len(self.people)} {'people' if len(self.people) > 1 else 'person'}")
        holds = ", ".join(parts) or "nothing but the robot"
        return f"Scenario({self.name!r}, {self.control.method}, seed {self.seed}: {holds}; noise {self.noise.profile})"


def _metrics(given: Iterable[Any]) -> Iterator[Any]:
    """Each metric by its name, class or object as a plug-in."""
    for i, metric in enumerate(given):
        with below("metrics"), below(str(i)):
            yield MetricPlugin.of(metric)
