"""What the layers pass to one another: one frozen dataclass for each arrow of the data flow.

    world -> Reading -> estimation -> RobotBelief, Track -> loop -> Observation -> control -> Decision -> loop -> world
    loop -> TickRecord, TickTiming -> recording;  loop or a log -> Trajectory -> metrics

SI units, right-handed world frame, headings counter-clockwise from +x in (-pi, pi]. Arrays are float64 and are not
changed after they were handed over; those of an observation cannot be.
"""

from dataclasses import dataclass, field
from enum import StrEnum
from functools import lru_cache
from math import inf, isfinite
from sys import float_info
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjnav.errors import InvalidValue
from mjnav.short_repr import ShortRepr

Array = NDArray[np.float64]

LARGEST = 1e12  # of the numbers in beliefs and draws: beyond it, neighbouring doubles are more than 0.1 mm apart


def number(key: str, value: object, unit: str = "") -> float:
    """`value` as a finite number. Raises InvalidValue."""
    return value if isinstance(value, float) and isfinite(value) else float(finite(key, value, unit=unit))


def finite(key: str, value: object, *shape: Any, unit: str = "", most: float = inf) -> Array:
    """`value` as an array of finite numbers, of magnitudes up to `most`. Raises InvalidValue.

    In its `shape` None is any length but 0, and `...`, at the front, any number of axes.
    """
    try:
        numbers = real(value)
    except (TypeError, ValueError, OverflowError):  # no numbers, rows of unequal length, or beyond the largest float
        numbers = np.array(np.nan)
    axes = shape[1:] if shape[:1] == (...,) else shape
    fits = numbers.ndim == len(axes) or (numbers.ndim > len(axes) and axes != shape)
    lengths = zip(numbers.shape[::-1], axes[::-1], strict=False)  # from the last axis on
    fits = fits and all(found > 0 if wanted is None else found == wanted for found, wanted in lengths)
    if not (fits and (np.abs(numbers) <= min(most, float_info.max)).all()):
        text = str(shape).replace("Ellipsis", "...").replace("None", "n")
        allowed = f"finite numbers, an array of shape {text}" if shape else "a finite number"
        allowed += f", up to {most:g}" if most < inf else ""
        raise InvalidValue(key, value, f"{allowed} [{unit}]" if unit else allowed)
    return numbers


def real(value: object) -> Array:
    """A copy of `value` as an array of floats. Raises TypeError for text, truth values and complex numbers."""
    given = np.asarray(value)
    if given.dtype.kind not in "iufO":
        raise TypeError(f"{given.dtype} in place of real numbers")
    return given.astype(float)


# ---------------------------------------------------------------------------------------------- world


@dataclass(frozen=True, slots=True)
class Contact:
    """The robot touches something: `kind` is person, table, wall or pillar; `name` the body ("person3")."""

    kind: str
    name: str
    force: float  # [N], the largest normal force seen; 0 in the kinematic engine
    time: float  # [s], when it was first seen


@dataclass(frozen=True, slots=True, repr=False)
class WorldState(ShortRepr):
    """The truth at one moment. Only the world, the log and the metrics see it.

    People who are not there, not yet or no more, have NaN.
    """

    time: float  # [s]
    robot_pose: Array  # (3,) x, y [m], heading [rad]
    robot_twist: Array  # (2,) v [m/s], omega [rad/s]
    people_position: Array  # (P, 2) [m]
    people_velocity: Array  # (P, 2) [m/s]
    contacts: tuple[Contact, ...] = ()  # those seen since the state before
    people_radius: Array | None = None  # (P,) [m] where it changes in the run; else it is the scenario's


@dataclass(frozen=True, slots=True, repr=False)
class Reading(ShortRepr):
    """What all sensors measured at one moment; every value carries its channel's noise."""

    time: float  # [s]
    interval: float  # [s] since the reading before; odometry and gyro are means over it, 0 in the first reading
    odometry: Array  # (2,) v [m/s], omega [rad/s], from the wheel encoders
    gyro: float  # [rad/s]
    pose: Array  # (3,) from the pose sensor
    detections: Array  # (P, 2) [m] position of each person; NaN for who is not there
    scan: Array  # (B,) [m] ranges; inf where a beam met nothing. (0,) without a lidar, or where no new turn is complete
    odometry_pose: Array = field(default_factory=lambda: np.zeros(3))  # (3,) where odometry since the start leads
    scan_times: Array = field(
        default_factory=lambda: np.zeros(0)
    )  # (B,) [s] of each beam; (0,) where all are at `time`
    # Of odometry, gyro, pose, detections and scan those that did not arrive: their values are NaN. Estimators find here
    # all that cannot be used, with the last usable value in its place and no beams in place of a scan.
    dropped: tuple[str, ...] = ()
    ages: tuple[tuple[str, float], ...] = ()  # of these [s], where it was measured that long before `time`
    people_radius: Array | None = None  # (P,) [m] where it changes in the run; else it is the scenario's
    people_velocity: Array | None = None  # (P, 2) [m/s], told by published crowds where detections have no noise


# ----------------------------------------------------------------------------------------- estimation


@dataclass(frozen=True, slots=True, repr=False)
class RobotBelief(ShortRepr):
    """Weighted particles of the robot's pose after a reading."""

    time: float  # [s]
    particles: Array  # (n, 3) x, y, heading
    weights: Array  # (n,), sum 1
    mean: Array  # (3,), the heading's mean is circular
    covariance: Array  # (3, 3)
    ess: float  # effective sample size, before any resampling
    recovered: bool = False  # the likelihood had collapsed and the filter was spread again


@dataclass(frozen=True, slots=True, repr=False)
class Detection(ShortRepr):
    """What a scan shows of one body that the map does not explain."""

    time: float  # [s], mean of its beams
    position: Array  # (2,) [m] of its centre
    covariance: Array  # (2, 2) of its position, with the robot's uncertainty
    radius: float  # [m]
    num_beams: int


@dataclass(frozen=True, slots=True, repr=False)
class Track(ShortRepr):
    """Weighted particles of one person's position and velocity after a reading."""

    name: str  # "person3" where detections come with identity, else "track7"
    time: float  # [s]
    particles: Array  # (n, 4) x, y, vx, vy
    weights: Array  # (n,), sum 1
    mean: Array  # (4,)
    covariance: Array  # (4, 4)
    ess: float
    radius: float  # [m]
    recovered: bool = False
    age: float = 0.0  # [s] since it began
    unseen: float = 0.0  # [s] since the last detection that belongs to it


@dataclass(frozen=True, slots=True, repr=False)
class Beliefs(ShortRepr):
    """What is believed after the latest reading."""

    robot: RobotBelief
    people: tuple[Track, ...]
    detections: tuple[Detection, ...] = ()  # of the latest scan, where people are tracked by it


# -------------------------------------------------------------------------------------------- control


TRACK_WIDTH = 0.34  # [m] between the wheels' contact points of mjnav's own robot


@dataclass(frozen=True, slots=True)
class RobotLimits:
    """What the robot can do; SI units."""

    max_speed: float = 1.0
    min_speed: float = 0.0
    max_turn_rate: float = 1.5
    max_acceleration: float = 1.0
    max_turn_acceleration: float = 3.0
    radius: float = 0.22
    track_width: float = TRACK_WIDTH  # between the wheels' contact points, which in turns may skid
    cover: tuple[tuple[float, float], ...] = ()  # discs of a long body: [m] ahead of the centre, radius [m]; () is one

    def __post_init__(self):
        for name in (name for name in self.__slots__ if name not in ("min_speed", "cover")):
            if not number(name, getattr(self, name)) > 0.0:
                raise InvalidValue(name, getattr(self, name), "a finite number > 0")
        if not number("min_speed", self.min_speed) < self.max_speed:
            raise InvalidValue("min_speed", self.min_speed, f"a number below max_speed ({self.max_speed})")
        if self.cover and not (finite("cover", self.cover, None, 2)[:, 1] > 0.0).all():
            raise InvalidValue("cover", self.cover, "radii > 0")

    @property
    def discs(self) -> tuple[tuple[float, float], ...]:
        """The discs that the body is, each how far ahead of the centre [m], and its radius [m]."""
        return self.cover or ((0.0, self.radius),)

    @property
    def half_width(self) -> float:
        """What fits through a gap along its axis [m]: the radius of the widest of the discs."""
        return max(radius for _, radius in self.discs)


@dataclass(frozen=True, slots=True, repr=False)
class ObstacleSamples(ShortRepr):
    """Samples of one disc's state at the moment of the decision; M may differ between obstacles."""

    position: Array  # (M, 2) [m]
    velocity: Array  # (M, 2) [m/s]
    radius: float  # [m]
    future: Array | None = None  # (M, H, 2) [m] after `step`, 2 `step`, ... H `step`; None: straight on at `velocity`
    step: float = 0.0  # [s] of `future`


@dataclass(frozen=True, slots=True, repr=False)
class Lanes(ShortRepr):
    """Two lines a x + b y + c = 0: the left one keeps d <= 0, the right one d >= 0."""

    left: tuple[float, float, float]
    right: tuple[float, float, float]
    left_offset: Array  # (N,) [m] samples of the boundary's noise
    right_offset: Array  # (N,) [m]


@dataclass(frozen=True, slots=True, repr=False)
class Scan(ShortRepr):
    """What the lidar measured last, at a time of its own: a scan is not carried forward."""

    time: float  # [s]
    angles: Array  # (B,) [rad] of each beam against the heading of the mount when the beam was taken
    ranges: Array  # (B,) [m]; inf where a beam met nothing
    times: Array = field(default_factory=lambda: np.zeros(0))  # (B,) [s] of each beam; (0,) where all are at `time`
    mount: Array = field(default_factory=lambda: np.zeros(3))  # (3,) pose of the lidar on the body


MOST_STANDING = 128  # discs, and walls, of the known map in an observation: the nearest


@dataclass(frozen=True, slots=True, repr=False)
class KnownMap(ShortRepr):
    """What stands still and is known from the start."""

    walls: Array  # (W, 2, 2) [m] start and end of each wall's middle line
    wall_thickness: Array  # (W,) [m]
    discs: Array  # (D, 3) x, y, radius [m] of legs of tables, then of pillars
    left_lane: tuple[float, float, float] | None = None  # a x + b y + c = 0, as in `Lanes`
    right_lane: tuple[float, float, float] | None = None


@dataclass(frozen=True, slots=True, repr=False)
class Way(ShortRepr):
    """The way left to the route's next point from everywhere, as the robot plans it (`geometry.way_field`)."""

    number: int  # of the plan: another one is another way
    point: Array  # (2,) [m] of the route, to which it leads
    detour: Array  # (rows along y, columns along x) [m] that the way is longer than the straight one, at the nodes
    corner: Array  # (2,) [m] of the node [0, 0]
    cell: float  # [m] between neighbouring nodes
    line: Array  # (n, 2) [m] the way from where the robot was when it was planned


@dataclass(frozen=True, slots=True, repr=False)
class Observation(ShortRepr):
    """All that a controller may know, carried forward to the moment at which its decision takes effect."""

    robot_pose: Array  # (N, 3)
    control_noise: Array  # (N, 2) samples of (dv, domega)
    twist: Array  # (2,) the command decided last
    obstacles: tuple[ObstacleSamples, ...]
    goal: Array  # (2,) where to drive: with a way, a point ahead on it
    walls: Array = field(default_factory=lambda: np.zeros((0, 2, 2)))  # (W, 2, 2) start and end of each
    lanes: Lanes | None = None
    time: float = 0.0
    scan: Scan | None = None  # None before the first reading, and without a lidar
    map: KnownMap | None = None
    way: Way | None = None  # None where no way is planned (`[route]`)


@dataclass(frozen=True, slots=True, repr=False)
class CandidateCosts(ShortRepr):
    """The cost of each of K candidates, term by term; `cone` and `lane` are the method's unweighted risk.

    Column j of `cone` belongs to obstacle j, the walls follow; a column is zero where that obstacle is out of range.
    """

    v: Array  # (K,)
    omega: Array  # (K,)
    goal: Array  # (K,)
    cone: Array  # (K, J)
    lane: Array  # (K, 2) left, right
    total: Array  # (K,)
    nominal: int


class Status(StrEnum):
    """How a decision came about; `advice` says what to do about it."""

    OK = "ok"
    INFEASIBLE_NOMINAL = "infeasible_nominal"
    INFEASIBLE = "infeasible"
    STOPPED = "stopped"

    @property
    def advice(self) -> str:
        """One line for the log."""
        return _ADVICE[self.value]


_ADVICE = {
    "ok": "",
    "infeasible_nominal": "no candidate meets the constraints at the mean: the least violation was taken; a longer "
    "horizon or sensing range, or a lower preferred speed, leaves more room",
    "infeasible": "no candidate meets the method's own constraint: the least violation was taken; a lower risk level "
    "or more samples may help",
    "stopped": "the robot stands still and the best it can do is to stay",
}


@dataclass(frozen=True, slots=True, repr=False)
class PlanShown(ShortRepr):
    """What a method that plans ahead weighed, for the log; positions [m] in the world, at the end of every step."""

    step: float  # [s] between the positions of a path
    path: Array  # (T, 2) of the plan that is followed
    fan: Array  # (F, T, 2) of some of the rollouts, cheapest first
    fan_cost: Array  # (F,)
    # (S,) h of each joint sample under the plan: 0 where nothing comes near, 1 at a contact; (0,) of a method without.
    violation: Array
    feasible: bool


@dataclass(frozen=True, slots=True, repr=False)
class Decision(ShortRepr):
    """The chosen control."""

    v: float
    omega: float
    status: Status
    costs: CandidateCosts | None = None
    # Set by the loop: (v, omega) that the controller chose, where the command is another one; what the robot does not
    # know enough of, or the recovery under way on its planned way, where that is the reason and not its limits.
    wish: tuple[float, float] | None = None
    caution: str = ""
    plan: PlanShown | None = None
    recovery: str = ""

    @property
    def clipped(self) -> bool:
        """Whether the choice was beyond the robot's limits, and nothing else changed it."""
        return self.wish is not None and not (self.caution or self.recovery)


@dataclass(frozen=True, slots=True, repr=False)
class ConeDistribution(ShortRepr):
    """The constraint's samples for the closest obstacle at the chosen control, beside those desired."""

    obstacle: str
    samples: Array  # (n,) f at the chosen control, as the controller compares it (safe where <= 0)
    desired: Array  # (m,) the desired samples; empty for a method that has none
    safe_share: float


# ----------------------------------------------------------------------------------------------- loop


@dataclass(frozen=True, slots=True)
class Event:
    """Something worth a line in the log. `level` is info, warning or error."""

    level: str
    name: str  # contact, infeasible, recovery, fault, ...
    text: str


@dataclass(frozen=True, slots=True, repr=False)
class TickRecord(ShortRepr):
    """Everything that one tick saw and did."""

    tick: int
    truth: WorldState
    reading: Reading | None  # None where no sensor was due since the tick before
    belief: RobotBelief | None  # None in a run that is stepped without estimators
    tracks: tuple[Track, ...]
    observation: Observation | None  # None without a belief
    decision: Decision
    command: Array  # (2,) what is in force from now on
    cone: ConeDistribution | None
    events: tuple[Event, ...] = ()
    readings_before: tuple[Reading, ...] = ()  # since the tick before, where sensors are quicker than the loop
    detections: tuple[Detection, ...] = ()

    @property
    def seen(self) -> Observation:
        """The observation. Raises ValueError in a tick that has none."""
        if self.observation is None:
            raise ValueError(f"tick {self.tick} has no observation: it was stepped without estimators")
        return self.observation


PHASES = ("sense", "estimate", "control", "record", "advance")


@dataclass(frozen=True, slots=True)
class TickTiming:
    """Wall-clock figures of one tick; they take no part in the simulation. All in nanoseconds."""

    tick: int
    phases: tuple[int, ...]  # in the order of PHASES
    lateness: int  # the tick's start behind its deadline; 0 without a pacer
    deadline_missed: bool


@dataclass(frozen=True, slots=True, repr=False)
class Trajectory(ShortRepr):
    """A whole run as arrays, the same from memory and from a log. T ticks, P people.

    The truth has one row more than there were ticks: the state in which the run ended.
    """

    time: Array  # (T + 1,)
    robot_pose: Array  # (T + 1, 3) truth
    robot_twist: Array  # (T + 1, 2) truth
    people_position: Array  # (T + 1, P, 2) truth; NaN where a person is not there
    people_velocity: Array  # (T + 1, P, 2) truth
    estimate: Array  # (T, 3) the robot's believed mean
    estimate_triangle: Array  # (T, 6) `triangle` of its covariance
    tracks: Array  # (T, P, 4) the people's believed means; NaN where a person has no track. `assignment` says whose
    track_triangle: Array  # (T, P, 10) of their covariances
    robot_ess: Array  # (T,) effective sample size of the robot's belief; NaN without one
    robot_particles: Array  # (T,) how many particles it has; NaN without one, and in logs that do not say it
    people_ess: Array  # (T, P) of the people's tracks; NaN where a person has no track
    command: Array  # (T, 2) in force from the tick on
    decision: Array  # (T, 2)
    nominal: Array  # (T, 2) the nominal control; NaN where the method has none
    status: tuple[str, ...]  # (T,)
    contacts: tuple[Contact, ...]
    timing: NDArray[np.int64]  # (T', 7): tick, PHASES, lateness; ns. T' may be less than T where messages were lost
    deadline_misses: int
    clipped_ticks: int = 0  # whose decision was beyond the robot's limits
    cautious_ticks: int = 0  # in which the robot drove more slowly than decided, as it did not know enough
    recoveries: int = 0  # of filters that were spread again
    track_states: Array = field(
        default_factory=lambda: np.zeros((0, 7))
    )  # (n, 7) row of `time`, track's number, x, y, vx, vy, time unseen of every track that carries no person's name
    people_radius: Array | None = None  # (T + 1, P) [m] where it changes in the run; else it is the scenario's

    @property
    def estimate_covariance(self) -> Array:
        """(T, 3, 3), computed anew at each use."""
        return symmetric(self.estimate_triangle, 3)

    @property
    def track_covariance(self) -> Array:
        """(T, P, 4, 4), computed anew at each use."""
        return symmetric(self.track_triangle, 4)


def triangle(matrices: Array) -> Array:
    """The upper triangles of symmetric matrices (..., n, n), row by row: (..., n (n + 1) / 2)."""
    return matrices[..., *_upper(matrices.shape[-1])]


@lru_cache(maxsize=8)  # twice a tick
def _upper(n: int) -> tuple[NDArray[np.intp], ...]:
    return np.triu_indices(n)


def symmetric(triangles: Array, n: int) -> Array:
    """The matrices (..., n, n) of which `triangle` gives `triangles`."""
    i, j = np.triu_indices(n)
    place = np.empty((n, n), int)
    place[i, j] = place[j, i] = np.arange(len(i))
    return np.take(triangles, place, axis=-1)
