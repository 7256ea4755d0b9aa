"""Learned policies as controllers: what they see, how their actions are scaled, and their base class.

The Gymnasium environments encode by the same code, so a policy sees the same arrays in training and in `mjnav run`.
Nothing here needs Gymnasium. Actions are numbers from -1 to 1, or commands in SI units.

All features come from the samples in an `Observation`, which stand at the moment at which the decision takes effect;
the scan stands at its reading. The robot's frame has its origin at the mean of the robot's samples, x ahead along their
mean heading, y to the left; the goal frame has the same origin and x towards the next point of the route.

    robot   (11,)            distance to the goal; cos and sin of the heading in the goal frame; v and omega decided
                             last; std along and across the way to the goal, and of the heading; their correlations
    people  (max_people, 13) a row a person, nearest first: present (1 or 0); mean position x, y and velocity over
                             ground vx, vy in the robot's frame; radius; clearance; std and correlation of the position,
                             std and correlation of the velocity. Rows without a person are 0
    scan    (beams,)         least range of each sector; sector i begins at heading - pi + 2 pi i / beams. A sector
                             without a beam, or of which nothing returned, has the greatest distance;
                             all have it while no scan has arrived
    grid    (cells, cells)   probability that a cell is occupied, in the robot's frame with the robot in the middle; the
                             first index grows ahead, the second to the left. A person counts by the share of samples
                             that cover the cell, walls, legs and pillars by 1; all are wider by half a cell

Means and covariances are those of the samples, so `control.samples` sets how fine they are. Units are m, m/s, rad and
rad/s. Every value is clipped to its bounds.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjnav.compile.compiled import Cube, exact
from mjnav.control.base import status_of
from mjnav.control.parameters import LoopParameters
from mjnav.geometry.angles import circular_mean, mean_position, rounded
from mjnav.geometry.distances import segment_distance
from mjnav.messages import MOST_STANDING, Array, Decision, Observation, ObstacleSamples, RobotLimits, finite
from mjnav.motion.unicycle import command_bounds
from mjnav.settings import Choice, Length, Range, settle

# --------------------------------------------------------------------------------------------- features


BLOCKS = ("robot", "people", "scan", "grid")

Block = Annotated[str, Choice(BLOCKS)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Features:
    """The blocks that a policy sees, and their sizes. The module says what stands in each.

    Raises InvalidValue for a block that does not exist and a size that is not allowed.
    """

    blocks: Annotated[tuple[Block, ...], Length(1, len(BLOCKS))] = ("robot", "people")
    sight: Annotated[float, Range(0.5, 1000.0, "m"), "distances are clipped to it; people beyond it are not seen"] = (
        10.0
    )
    max_people: Annotated[int, Range(1, 500), "rows of `people`, nearest first"] = 5
    beams: Annotated[int, Range(1, 10_000), "sectors of `scan`"] = 36
    cells: Annotated[int, Range(2, 512), "of `grid` to a side"] = 32
    resolution: Annotated[float, Range(0.01, 10.0, "m"), "side of a cell of `grid`"] = 0.25

    def __post_init__(self):
        settle(self)

    @classmethod
    def of(cls, features: "Features | Sequence[str]") -> "Features":
        """Features as they are, or those of the blocks by name."""
        return features if isinstance(features, Features) else cls(blocks=features)  # type: ignore[arg-type]


MAX_STD = 2.0  # [m], [m/s] and [rad]: far beyond what a filter that works believes
MAX_WALKING_SPEED = 5.0  # [m/s], the fastest person of a run file
MAX_RADIUS = 1.0  # [m], the widest person of a run file
LEAST_STD = 1e-9  # below it a correlation is not defined, and 0

ROBOT = ("distance", "cos_heading", "sin_heading", "v", "omega", "std_along", "std_across", "std_heading",
         "corr_along_across", "corr_along_heading", "corr_across_heading")  # fmt: skip
PERSON = ("present", "x", "y", "vx", "vy", "radius", "clearance", "std_x", "std_y", "corr_xy", "std_vx", "std_vy",
          "corr_vxvy")  # fmt: skip

Bounds = tuple[Array, Array]


@dataclass(frozen=True, slots=True)
class Frame:
    """Where the robot is believed to be: the mean of its samples."""

    origin: Array  # (2,)
    heading: float

    @classmethod
    def of(cls, observation: Observation) -> "Frame":
        """The robot's frame of an observation."""
        pose = observation.robot_pose
        return cls(mean_position(pose), circular_mean(pose[:, 2]))

    def place(self, points: Array) -> Array:
        """World points (..., 2) in this frame."""
        return turned(points - self.origin, -self.heading)


def turned(vectors: Array, angle: float) -> Array:
    """Vectors (..., 2), turned counter-clockwise by `angle` [rad]."""
    cos, sin = np.cos(angle), np.sin(angle)
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)


def _robot_bounds(features: Features, limits: RobotLimits) -> Bounds:
    (v_low, turn_low), (v_high, turn_high) = command_bounds(limits)
    low = [0.0, -1.0, -1.0, v_low, turn_low, 0.0, 0.0, 0.0, -1.0, -1.0, -1.0]
    high = [features.sight, 1.0, 1.0, v_high, turn_high, MAX_STD, MAX_STD, MAX_STD, 1.0, 1.0, 1.0]
    return np.array(low), np.array(high)


def _robot(features: Features, limits: RobotLimits, observation: Observation, frame: Frame) -> Array:
    way = observation.goal - frame.origin
    direction = np.arctan2(way[1], way[0])
    heading = frame.heading - direction
    _, (spread,) = _moments(np.array(observation.robot_pose[None], order="C"), *frame.origin.tolist(), frame.heading,
                            float(np.cos(-direction)), float(np.sin(-direction)))  # fmt: skip
    return np.array([np.hypot(*way), np.cos(heading), np.sin(heading), *observation.twist, *spread])


@exact
def _moments(samples: Cube, x: float, y: float, heading: float, cos: float, sin: float):
    """Means (P, d) of samples (P, n, d), of columns x, y in a frame at (x, y), turned by an angle of `cos` and `sin`.

    A third column is a heading [rad], and taken against `heading`. Also of each body the standard deviations, then the
    correlations row by row: (P, d + d (d - 1) / 2).
    """
    num_bodies, num, columns = samples.shape
    mean, spread = np.zeros((num_bodies, columns)), np.zeros((num_bodies, columns + columns * (columns - 1) // 2))
    errors = np.empty((columns, num))
    for p in range(num_bodies):
        for i in range(num):
            dx, dy = samples[p, i, 0] - x, samples[p, i, 1] - y
            errors[0, i], errors[1, i] = cos * dx - sin * dy, sin * dx + cos * dy
            if columns == 3:
                errors[2, i] = rounded(samples[p, i, 2] - heading)
            for j in range(columns):
                mean[p, j] += errors[j, i]
        place = columns
        for j in range(columns):
            mean[p, j] /= num
            square = 0.0
            for i in range(num):
                errors[j, i] -= mean[p, j]
                square += errors[j, i] * errors[j, i]
            spread[p, j] = np.sqrt(square / num)
        for j in range(columns):
            for k in range(j + 1, columns):
                product = 0.0
                for i in range(num):
                    product += errors[j, i] * errors[k, i]
                both = spread[p, j] * spread[p, k]
                spread[p, place] = product / num / both if both > LEAST_STD**2 else 0.0
                place += 1
    return mean, spread


def _people_bounds(features: Features, limits: RobotLimits) -> Bounds:
    s, v, r = features.sight, MAX_WALKING_SPEED, MAX_RADIUS
    low = [0.0, -s, -s, -v, -v, 0.0, -r - limits.radius, 0.0, 0.0, -1.0, 0.0, 0.0, -1.0]
    high = [1.0, s, s, v, v, r, s, MAX_STD, MAX_STD, 1.0, MAX_STD, MAX_STD, 1.0]
    return np.tile(low, (features.max_people, 1)), np.tile(high, (features.max_people, 1))


def _people(features: Features, limits: RobotLimits, observation: Observation, frame: Frame) -> Array:
    block, found = np.zeros((features.max_people, len(PERSON))), people(observation)
    together = len({person.position.shape for person in found}) == 1  # else they are looked at one by one
    rows = [row for group in ([found] if together else zip(found)) for row in _rows(group, features, limits, frame)]
    for row, values in zip(block, sorted(rows, key=lambda row: row[6]), strict=False):
        row[:] = values
    return block


def people(observation: Observation) -> tuple[ObstacleSamples, ...]:
    """The people among the obstacles, which come before the map's legs and pillars."""
    known, obstacles = observation.map, observation.obstacles
    return obstacles if known is None else obstacles[: len(obstacles) - min(len(known.discs), MOST_STANDING)]


def _rows(
    seen: Sequence[ObstacleSamples], features: Features, limits: RobotLimits, frame: Frame
) -> Iterator[list[float]]:
    """The values of those of some people, with equally many samples, who are in sight."""
    turn = float(np.cos(-frame.heading)), float(np.sin(-frame.heading))
    place, errors = _moments(np.array([one.position for one in seen]), *frame.origin.tolist(), 0.0, *turn)
    velocity, changes = _moments(np.array([one.velocity for one in seen]), 0.0, 0.0, 0.0, *turn)
    parts = (values.tolist() for values in (np.hypot(*place.T), place, velocity, errors, changes))
    for one, distance, at, moves, *spreads in zip(seen, *parts, strict=True):
        if distance <= features.sight:
            clearance = distance - one.radius - limits.radius
            yield [1.0, *at, *moves, one.radius, clearance, *spreads[0], *spreads[1]]


def _scan_bounds(features: Features, limits: RobotLimits) -> Bounds:
    return np.zeros(features.beams), np.full(features.beams, features.sight)


def _scan(features: Features, limits: RobotLimits, observation: Observation, frame: Frame) -> Array:
    least, scan = np.full(features.beams, features.sight), observation.scan
    if scan is None:
        return least
    angles, ranges = scan.angles + scan.mount[2], scan.ranges
    if scan.mount[:2].any():  # seen from the robot's centre
        x, y = scan.mount[:2, None] + np.where(np.isfinite(ranges), ranges, 0.0) * [np.cos(angles), np.sin(angles)]
        met = np.isfinite(ranges)
        angles, ranges = np.where(met, np.arctan2(y, x), angles), np.where(met, np.hypot(x, y), np.inf)
    turn = (angles + np.pi) / (2.0 * np.pi)
    sector = np.floor(turn * features.beams + 1e-9).astype(int) % features.beams
    np.minimum.at(least, sector, ranges)
    return least


def _grid_bounds(features: Features, limits: RobotLimits) -> Bounds:
    shape = (features.cells, features.cells)
    return np.zeros(shape), np.ones(shape)


def _grid(features: Features, limits: RobotLimits, observation: Observation, frame: Frame) -> Array:
    centres, side = cell_centres(features.cells, features.resolution), features.resolution
    free = np.ones(len(centres))
    for disc in observation.obstacles:
        at = frame.place(disc.position)
        squared = (centres**2).sum(-1)[:, None] - 2.0 * centres @ at.T + (at**2).sum(-1)
        free *= (squared > (disc.radius + 0.5 * side) ** 2).mean(axis=1)
    if len(observation.walls):
        start, end = frame.place(observation.walls[:, 0]), frame.place(observation.walls[:, 1])
        free *= (segment_distance(centres[:, None], start, end) > np.sqrt(0.5) * side).all(axis=1)
    return 1.0 - free.reshape(features.cells, features.cells)


@lru_cache(maxsize=8)
def cell_centres(cells: int, resolution: float) -> Array:
    """The centres of a grid's cells in the robot's frame, row by row, (cells², 2) [m]; not to be written to."""
    middle = (np.arange(cells) + 0.5 - 0.5 * cells) * resolution
    x, y = np.meshgrid(middle, middle, indexing="ij")
    return np.column_stack([x.ravel(), y.ravel()]).astype(float)


# Of each block its bounds, low and high in the block's shape, and its values before they are clipped.
KINDS: Mapping[str, tuple[Callable[..., Bounds], Callable[..., Array]]] = MappingProxyType(
    {
        "robot": (_robot_bounds, _robot),
        "people": (_people_bounds, _people),
        "scan": (_scan_bounds, _scan),
        "grid": (_grid_bounds, _grid),
    }
)


# -------------------------------------------------------------------------------------------- actions


class Actions:
    """Actions a in [-1, 1]² of a robot: v = low + (a + 1)/2 (high - low), and omega likewise.

    `low` and `high`, (2,), are the lowest and highest v [m/s] and omega [rad/s] that the base takes. An action beyond
    [-1, 1] is a command beyond the limits, which the loop clips and counts.
    """

    def __init__(self, limits: RobotLimits):
        self.low, self.high = command_bounds(limits)

    def command(self, action: ArrayLike) -> Array:
        """(v [m/s], omega [rad/s]) of a normalised action (2,); that of 1 is exactly `high`."""
        a, span = np.asarray(action, float), self.high - self.low
        command = self.low + 0.5 * (a + 1.0) * span
        return np.where(a < 1.0, np.minimum(command, self.high), self.high + 0.5 * (a - 1.0) * span)

    def action(self, command: ArrayLike) -> Array:
        """The normalised action (2,) of (v [m/s], omega [rad/s]): the inverse of `command`."""
        return 2.0 * (np.asarray(command, float) - self.low) / (self.high - self.low) - 1.0


# --------------------------------------------------------------------------------------- observations


Array32 = NDArray[np.float32]


class Encoder:
    """Turns observations of one robot into the blocks of `features`; it keeps nothing from one to the next."""

    def __init__(self, features: Features, limits: RobotLimits):
        self.features, self._limits = features, limits
        bounds = {name: KINDS[name][0](features, limits) for name in sorted(features.blocks)}
        self.bounds = {name: (low.astype(np.float32), high.astype(np.float32)) for name, (low, high) in bounds.items()}

    def encode(self, observation: Observation) -> dict[str, Array32]:
        """The blocks by name, in the order of their names, each clipped to its bounds and new."""
        frame, blocks = Frame.of(observation), {}
        for name, (low, high) in self.bounds.items():
            values = KINDS[name][1](self.features, self._limits, observation, frame)
            blocks[name] = values.astype(np.float32).clip(low, high)
        return blocks


def flatten(blocks: Mapping[str, Array32]) -> Array32:
    """All blocks as one vector, in the order of their names, as Gymnasium's FlattenObservation gives it."""
    return np.concatenate([blocks[name].ravel() for name in sorted(blocks)])


# ----------------------------------------------------------------------------------------- controller


class PolicyController(ABC):
    """A policy that sees the blocks of `features` and nothing else: a subclass gives `act`.

    `features`, as for the environment, are those that the policy was trained with. The blocks are those that the
    environment gave it, bit for bit, where `control.samples` is the same. It runs as any controller does:

        class Policy(PolicyController):
            features = Features(blocks=("robot",))

            def act(self, blocks):
                distance, cos, sin = blocks["robot"][:3]
                return self.actions.command([2.0 * cos - 1.0, -sin])

        mjnav run hall --controller policy.py:Policy

    `self.actions` scales normalised actions; `limits`, `period` [s] and `parameters` are those of any controller.
    """

    parameters_type: ClassVar[type[LoopParameters]] = LoopParameters
    features: ClassVar[Features | Sequence[str]] = Features()

    def __init__(self, limits: RobotLimits, period: float, parameters: LoopParameters):
        self.limits, self.period, self.parameters = limits, period, parameters
        self.encoder = Encoder(Features.of(self.features), limits)
        self.actions = Actions(limits)

    @abstractmethod
    def act(self, blocks: Mapping[str, Array32]) -> ArrayLike:
        """The command (v [m/s], omega [rad/s]) for what the policy sees."""

    def decide(self, observation: Observation) -> Decision:
        """The policy's command for the observation. Raises InvalidValue where `act` returned none."""
        action = self.act(self.encoder.encode(observation))
        v, omega = finite(f"{type(self).__name__}.act()", action, 2).tolist()
        return Decision(v, omega, status_of(observation, v, omega))

    def closest_cone(self, observation: Observation, decision: Decision) -> tuple[int, Array, Array] | None:
        """None: a policy has no samples of a constraint."""
        return None
