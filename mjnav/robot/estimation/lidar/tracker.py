"""Multi-object tracker by lidar: follows any number of bodies that the map does not have, without identity.

    predict every track -> detect -> assign -> correct, or note a miss -> births -> deaths

Everything that persists is tracked: people, and furniture that the map lacks, which is a track at rest.

Detections are assigned to tracks by global nearest neighbour with a gate and a probability of detection. Source:
Blackman & Popoli 1999, "Design and Analysis of Modern Tracking Systems", chapter 6. The nearest detection is the one
that the belief of a track makes most likely, its turns and stops included: the Gaussian of its first two moments would
lose people who turn round abruptly.

A score decides the birth, confirmation and death of a track: the log-odds that it stands for a body (Sittler 1964;
Musicki, Evans & Stankovic 1994). It begins even, and

    a detection z that belongs to it     adds log(DETECTED p(z) / clutter)
    a scan without one                   adds log(1 - P_D)

with P_D the share of its belief that the scan could see, times DETECTED. So a track that stands behind something, out
of range, or before a lidar that is silent, loses nothing: it coasts until its position is too uncertain.

The error of the robot's pose is common to all tracks: a pose error (dx, dy, dtheta) moves what stands at p from the
robot at p_r by

    J (dx, dy, dtheta),   J = (I, e),   e = (-(y - y_r), x - x_r)

A filter is told of it with every detection as if it were fresh at each scan. It is not: under the pose sensor a tenth
of a second leaves four fifths of it. So the filter averages away a part of it that in truth stays, and a track gets
back the share PERSISTENT of its covariance. More would make the velocities follow the pose's errors, or the positions
too uncertain: with a half, the 95 % regions of positions hold 94 to 99 % of the truth in the shipped scenes hall, five
and doorway.
"""

from dataclasses import dataclass
from importlib import import_module
from math import log, log1p, sqrt
from typing import Self

import numpy as np
from numpy.typing import NDArray

from mjnav.filters.mixture_kalman import GaussianSum
from mjnav.filters.particles import shuffled
from mjnav.geometry.angles import wrap
from mjnav.geometry.distance_field import DistanceField
from mjnav.geometry.distances import widest_std
from mjnav.messages import Array, Detection, Reading, RobotBelief, Track
from mjnav.rng import stream
from mjnav.robot.estimation.base import DRAWS, HEADING, NO_BELIEF, error_at
from mjnav.robot.estimation.kalman import KalmanPersonFilter
from mjnav.robot.estimation.lidar.detector import Detector, ScanDetections
from mjnav.robot.estimation.tracker import PersonFilter
from mjnav.robot.estimation.walk_filter import StopAndGo, WalkFilter
from mjnav.scene.spec import Scenario

# ------------------------------------------------------------------------- assignment of detections


FAR = 60.0  # Mahalanobis distance^2 from a track's moments beyond which nobody asks for the density


def mahalanobis(means: Array, covariances: Array, positions: Array, noise: Array, ages: Array) -> Array:
    """Squared distances of D detections from T tracks, (T, D).

    Tracks' moments are (T, 4), (T, 4, 4), positions (D, 2), their covariances (D, 2, 2), made `ages` (D,) [s] before:
    z ~ N(x - age v, H P H^T + R), H = (I, -age I).
    """
    age = ages[:, None]
    error = positions - (means[:, None, :2] - age * means[:, None, 2:])
    PP, PV, VV = covariances[:, :2, :2], covariances[:, :2, 2:], covariances[:, 2:, 2:]
    age = ages[:, None, None]
    cross = (PV + PV.swapaxes(1, 2))[:, None]
    S = PP[:, None] - age * cross + age**2 * VV[:, None] + noise
    determinant = S[..., 0, 0] * S[..., 1, 1] - S[..., 0, 1] ** 2
    dx, dy = error[..., 0], error[..., 1]
    return (S[..., 1, 1] * dx**2 - 2.0 * S[..., 0, 1] * dx * dy + S[..., 0, 0] * dy**2) / determinant


def assigned(log_density: Array, detectable: Array, false: float) -> NDArray[np.int64]:
    """The detection of each track, (T,); -1 for a track that none belongs to. No detection belongs to two.

    log_density (T, D) is of each detection under each track [1/m^2], -inf where it cannot belong to it. The most likely
    assignment maximises the product over tracks of p(z) / `false` where z belongs to the track and of 1 - P_D where
    none does, P_D being its `detectable` (T,), below one. `false` is the density of detections that belong to no track
    over the probability that a body in view is detected [1/m^2]; that a detection was made says that there the body was
    in view. A track's gate is where p(z) >= false.
    """
    from scipy.optimize import linear_sum_assignment  # a tracker that needs it imports it before the first tick

    num_tracks, num = log_density.shape
    if not (num_tracks and num):
        return np.full(num_tracks, -1)
    costs = np.full((num_tracks, num + num_tracks), np.inf)
    gain = log_density - np.log(false)
    costs[:, :num] = np.where(gain >= 0.0, -gain, np.inf)
    costs[:, num:][np.diag_indices(num_tracks)] = -np.log1p(-detectable)
    columns = linear_sum_assignment(costs)[1]
    return np.where(columns < num, columns, -1)


# ---------------------------------------------------------------------------------- life of a track


DETECTED = 0.85  # probability that a body in full view is detected: two that touch may be one cluster
CLUTTER = 0.002  # [1/m^2] density of false detections in a scan; with new bodies among them
CONFIRMED = 3  # detections that confirm a track, whose score has never been so low that it died
DEAD = -3.0  # score, 5 % in probability
SUREST = 8.0  # score; a track in full view dies after six scans in a row without a detection
COASTING = 5.0  # [s] without a detection, at most
SPREAD = 1.5  # [m] std of the position in its widest direction, at most


@dataclass(slots=True)
class Life:
    """What decides how long a track lives."""

    born: float  # [s]
    seen: float  # [s] when a detection last belonged to it
    detections: int = 1
    score: float = 0.0

    def detected(self, time: float, log_density: float) -> None:
        """A detection belongs to it, of that log of density under its belief [1/m^2]."""
        self.seen, self.detections = time, self.detections + 1
        self.score = min(self.score + log(DETECTED / CLUTTER) + log_density, SUREST)

    def missed(self, detectable: float) -> None:
        """No detection of a scan belongs to it."""
        self.score += log1p(-detectable)

    @property
    def confirmed(self) -> bool:
        """Whether it counts as a body."""
        return self.detections >= CONFIRMED

    def over(self, time: float, spread: float) -> bool:
        """Whether it ends at `time` [s], `spread` [m] being the largest std of its position."""
        return self.score < DEAD or spread > SPREAD or time - self.seen > COASTING


# ------------------------------------------------------------------------ error of the robot's pose


PERSISTENT = 0.5


@dataclass(frozen=True, slots=True)
class FrameError:
    """What one belief of the robot's pose does to all tracks."""

    place: Array  # (2,) [m] of the robot
    pose_covariance: Array  # (3, 3), PERSISTENT of it
    errors: Array  # (n, 3) of the pose, with that covariance

    @classmethod
    def of(cls, robot: RobotBelief, num: int, rng: np.random.Generator) -> Self:
        """`num` errors by the belief's own particles, whatever their law."""
        errors = shuffled(robot.particles, robot.weights, num, rng) - robot.mean
        errors[:, HEADING] = wrap(errors[:, HEADING])
        return cls(robot.mean[:2], PERSISTENT * robot.covariance, sqrt(PERSISTENT) * errors)

    @classmethod
    def none(cls, num: int) -> Self:
        """No error."""
        return cls(np.zeros(2), np.zeros((3, 3)), np.zeros((num, 3)))

    def covariance(self, position: Array) -> Array:
        """Of the error at a position (2,) [m]: (2, 2)."""
        J = self._by_pose(position)
        return J @ self.pose_covariance @ J.T

    def samples(self, position: Array) -> Array:
        """Errors at a position (2,) [m]: (n, 2)."""
        return self.errors @ self._by_pose(position).T

    def _by_pose(self, position: Array) -> Array:
        return error_at(position - self.place)[:2]


# ------------------------------------------------------------------------------------------ tracker


# The error of a detection in units of the root of its covariance, with variance 1. Detectors know the covariance, not
# the shape: most err less than it says, one in twenty twice as far, where a cluster holds part of something else.
SCAN_ERROR = GaussianSum(np.array([0.95, 0.05]), np.zeros((2, 2)), np.array([0.8 * np.eye(2), 4.8 * np.eye(2)]))
HISTORIES = 100  # of a track at most: twice as many changed no error of a track in the shipped scenes by 2 %
TINY = 1e-300  # [1/m^2] the least density of which there is a logarithm
UNNAMED = -1
PARTICLES = "estimation.particles"  # channel of the particles that a track hands over
RADIUS_MEMORY = 10  # detections of which a radius is the mean
CAME, LOST = 0.4, 1.0  # [m] and [s] unseen, of bodies on a map that the robot draws: what stands is in the map
ELSEWHERE = 0.5  # [m] between two readings: of a recovery that is a jump


@dataclass(slots=True)
class Body:
    """What is tracked, confirmed or not."""

    filter: PersonFilter
    life: Life
    radius: float  # [m]
    place: Array  # (2,) [m] where it was detected first
    number: int = UNNAMED  # of its name, once confirmed
    streams: tuple[np.random.Generator, ...] = ()  # of its particles and of the draws from them, once confirmed

    @property
    def name(self) -> str:
        """Of a confirmed track."""
        return f"track{self.number}"

    def over(self, time: float) -> bool:
        """Whether it ends at `time` [s]."""
        return self.life.over(time, widest_std(self.filter.covariance))


class LidarTracker:
    """Tracks bodies by the scans of a lidar, each by a `WalkFilter`.

    A scan's detections are assigned to tracks by `assigned`; `Life` says which tracks count, and how long. A
    reading without a scan only predicts, and so does one by a robot that does not know where it is (NaN). A detection
    was made before the reading, and is taken for the position at that time. On a map that the robot draws itself a body
    counts once it has gone CAME from where it was first seen, and is given up after LOST. Confirmed tracks are named
    track0, track1, ... in the order of their confirmation; no name comes twice. A robot that finds itself elsewhere
    forgets all.
    """

    def __init__(self, detector: Detector, num_particles: int, seed: int):
        import_module("scipy.optimize")  # which `assigned` needs, not to be loaded at a tick
        self._detector, self._num, self._seed = detector, num_particles, seed
        self._time, self._draws_map = 0.0, False
        self._stood = np.zeros(3)  # the robot's pose that bodies were placed by last
        self._births = self._names = 0  # so far
        self._bodies: list[Body] = []
        self._tracks: tuple[Track, ...] | None = None
        self._detections: tuple[Detection, ...] = ()
        self._weights = np.full(num_particles, 1.0 / num_particles)
        self._frame = stream(seed, "estimation.frame")

    @classmethod
    def of(cls, scenario: Scenario, seed: int) -> Self:
        """With the scenario's lidar and map."""
        return cls(Detector.of(scenario), scenario.estimation.obstacles.particles, seed)

    @property
    def detections(self) -> tuple[Detection, ...]:
        """What the latest reading's scan showed; empty where it had none."""
        return self._detections

    def update(self, reading: Reading, robot: RobotBelief | None = None) -> tuple[Track, ...]:
        """The confirmed tracks after one more reading, in the order of their names.

        Raises ValueError without the robot's belief.
        """
        if robot is None:
            raise ValueError("a tracker by the lidar needs the robot's belief")
        if robot.recovered and np.hypot(*(robot.mean - self._stood)[:2]) > ELSEWHERE:
            self._bodies = []  # they were placed by a pose that was wrong
        self._stood = robot.mean
        for body in self._bodies:
            body.filter.predict(reading.time - self._time)
        self._time, self._detections = reading.time, ()
        lost = not (np.isfinite(robot.mean).all() and np.isfinite(robot.covariance).all())
        if reading.scan.size and not lost:
            self._see(self._detector.detect(reading, robot))
        else:
            self._detector.follow(reading)
        self._bodies = [body for body in self._bodies if not self._over(body, reading.time)]
        frame = FrameError.none(self._num) if lost else FrameError.of(robot, self._num, self._frame)
        self._tracks = tuple(self._track(body, frame) for body in self._confirmed())
        return self._tracks

    def _over(self, body: Body, time: float) -> bool:
        return body.over(time) or (self._draws_map and time - body.life.seen > LOST)

    def learn(self, field: DistanceField) -> None:
        """The map as the robot has drawn it by now, of which nothing is a body; only who has come there is one."""
        self._detector.field, self._draws_map = field, True

    def draw(self, num: int) -> tuple[Array, ...]:
        """Samples of the latest tracks, (num, 4) each, in random order; an error before the first reading."""
        if self._tracks is None:
            raise RuntimeError(NO_BELIEF)
        pairs = zip(self._tracks, self._confirmed(), strict=True)
        return tuple(shuffled(track.particles, track.weights, num, body.streams[1]) for track, body in pairs)

    def _filter(self, rng: np.random.Generator) -> PersonFilter:
        """The filter of a new body, with a stream of its own."""
        return WalkFilter(min(self._num, HISTORIES), rng)

    def _confirmed(self) -> list[Body]:
        return sorted((body for body in self._bodies if body.number != UNNAMED), key=lambda body: body.number)

    def _see(self, scan: ScanDetections) -> None:
        """Assigns the detections of a scan; what is left over may be new bodies."""
        self._detections = found = tuple(one for one in scan.detections if _is_finite(one))
        log_density = self._log_density(found)
        detectable = np.array([DETECTED * scan.visible(body.filter.mean[:2], body.radius)[0] for body in self._bodies])
        columns = assigned(log_density, detectable, CLUTTER / DETECTED).tolist()
        for i, (body, column) in enumerate(zip(self._bodies, columns, strict=True)):
            if column < 0:
                missed = body.filter.missed(lambda points, r=body.radius: DETECTED * scan.visible(points, r))
                body.life.missed(missed)
            else:
                self._correct(body, found[column], float(log_density[i, column]))
        for place in sorted(set(range(len(found))).difference(columns)):
            self._begin(found[place])

    def _log_density(self, found: tuple[Detection, ...]) -> Array:
        """Of each detection under each body's belief [1/m^2], (T, D); -inf for those far away."""
        positions = np.array([one.position for one in found]).reshape(-1, 2)
        noise = np.array([one.covariance for one in found]).reshape(-1, 2, 2)
        ages = self._time - np.array([one.time for one in found])
        means = np.array([body.filter.mean for body in self._bodies]).reshape(-1, 4)
        covariances = np.array([body.filter.covariance for body in self._bodies]).reshape(-1, 4, 4)
        near = mahalanobis(means, covariances, positions, noise, ages) <= FAR
        log_density = np.full(near.shape, -np.inf)
        for i, j in np.argwhere(near).tolist():
            error = SCAN_ERROR.stretched(noise[j])
            density = self._bodies[i].filter.density(positions[j], error, age=float(ages[j]))
            log_density[i, j] = np.log(max(density, TINY))
        return log_density

    def _correct(self, body: Body, detection: Detection, log_density: float) -> None:
        """A detection belongs to a body, of that log of density under its belief [1/m^2]."""
        error = SCAN_ERROR.stretched(detection.covariance)
        body.filter.correct(detection.position, error, age=self._time - detection.time)
        body.life.detected(self._time, log_density)
        body.radius += (detection.radius - body.radius) / min(body.life.detections, RADIUS_MEMORY)
        came = not self._draws_map or np.hypot(*(detection.position - body.place)) > CAME
        if body.number == UNNAMED and body.life.confirmed and came:
            body.number, self._names = self._names, self._names + 1
            body.streams = tuple(stream(self._seed, channel, body.name) for channel in (PARTICLES, DRAWS))

    def _begin(self, detection: Detection) -> None:
        """A detection may be of a new body."""
        born = self._filter(stream(self._seed, "estimation.resampling", f"birth{self._births}"))
        born.start(detection.position, SCAN_ERROR.stretched(detection.covariance))
        born.predict(self._time - detection.time)
        self._births += 1
        self._bodies.append(Body(born, Life(self._time, self._time), detection.radius, detection.position))

    def _track(self, body: Body, frame: FrameError) -> Track:
        life, time, position = body.life, self._time, body.filter.mean[:2]
        covariance, particles = body.filter.covariance.copy(), body.filter.draw(self._num, body.streams[0])
        covariance[:2, :2] += frame.covariance(position)
        particles[:, :2] += frame.samples(position)
        return Track(
            body.name, time, particles, self._weights, body.filter.mean, covariance, float(self._num), body.radius,
            age=time - life.born, unseen=time - life.seen,
        )  # fmt: skip


class KalmanLidarTracker(LidarTracker):
    """The same lives and assignments, each track by one linear Kalman filter."""

    def _filter(self, rng: np.random.Generator) -> PersonFilter:
        return KalmanPersonFilter(StopAndGo())


def _is_finite(detection: Detection) -> bool:
    numbers = *detection.position, *detection.covariance.ravel(), detection.radius, detection.time
    return bool(np.isfinite(numbers).all())
