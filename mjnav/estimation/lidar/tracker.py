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
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from math import log, log1p
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from mjnav.estimation.base import DRAWS
from mjnav.estimation.lidar.detector import Detector
from mjnav.estimation.lidar.track_filter import FrameError, ParticleTrackFilter, TrackFilter
from mjnav.filters.particles import shuffled
from mjnav.geometry.distances import widest_std
from mjnav.messages import Array, Detection, Reading, RobotBelief, Track
from mjnav.rng import stream
from mjnav.scenarios.spec import Scenario

# ------------------------------------------------------------------------- assignment of detections


FAR = 60.0  # Mahalanobis distance^2 from a track's moments beyond which nobody asks for the density


def mahalanobis(means: Array, covariances: Array, positions: Array, noise: Array, ages: Array) -> tuple[Array, Array]:
    """Of D detections from T tracks, squared, and the log of the density under the Gaussian of their moments, (T, D).

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
    squared = (S[..., 1, 1] * dx**2 - 2.0 * S[..., 0, 1] * dx * dy + S[..., 0, 0] * dy**2) / determinant
    return squared, -0.5 * squared - 0.5 * np.log(determinant) - np.log(2.0 * np.pi)


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


# ------------------------------------------------------------------------------------------ tracker


class ScanView(Protocol):
    """What one scan shows, as `detector.ScanDetections` says it."""

    @property
    def detections(self) -> tuple[Detection, ...]:
        """The bodies."""
        ...

    def visible(self, points: Array, radius: float) -> Array:
        """The share of a disc with a `radius` [m] at points (n, 2) that the scan could see, (n,)."""
        ...


class Detects(Protocol):
    """Finds bodies in scans."""

    def detect(self, reading: Reading, robot: RobotBelief) -> ScanView:
        """Those in a reading's scan, by the robot's belief after the same reading."""
        ...

    def follow(self, reading: Reading) -> None:
        """Notes the robot's motion in a reading without a scan."""
        ...


MakeFilter = Callable[[int, np.random.Generator], TrackFilter]  # of so many particles, with a stream of its own
UNNAMED = -1
PARTICLES = "estimation.particles"  # channel of the particles that a track hands over
RADIUS_MEMORY = 10  # detections of which a radius is the mean
ELSEWHERE = 0.5  # [m] between two readings: of a recovery that is a jump


@dataclass(slots=True)
class Body:
    """What is tracked, confirmed or not."""

    filter: TrackFilter
    life: Life
    radius: float  # [m]
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
    """Tracks bodies by the scans of a lidar.

    A scan's detections are assigned to tracks by `assigned`; `Life` says which tracks count, and how long. A
    reading without a scan only predicts, and so does one by a robot that does not know where it is (NaN). A detection
    was made before the reading, and is taken for the position at that time. Confirmed tracks are named track0, track1,
    ... in the order of their confirmation; no name comes twice. A robot that finds itself elsewhere forgets all.
    """

    def __init__(self, detector: Detects, make_filter: MakeFilter, num_particles: int, seed: int):
        import_module("scipy.optimize")  # which `assigned` needs, not to be loaded at a tick
        self._detector, self._make, self._num, self._seed = detector, make_filter, num_particles, seed
        self._time = 0.0
        self._stood = np.zeros(3)  # the robot's pose that bodies were placed by last
        self._births = self._names = 0  # so far
        self._bodies: list[Body] = []
        self._tracks: tuple[Track, ...] | None = None
        self._detections: tuple[Detection, ...] = ()
        self._weights = np.full(num_particles, 1.0 / num_particles)
        self._frame = stream(seed, "estimation.frame")

    @classmethod
    def of(cls, scenario: Scenario, seed: int) -> "LidarTracker":
        """By particles, with the scenario's lidar and map."""
        return cls(Detector.of(scenario), ParticleTrackFilter, scenario.estimation.obstacles.particles, seed)

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
        self._bodies = [body for body in self._bodies if not body.over(reading.time)]
        frame = FrameError.none(self._num) if lost else FrameError.of(robot, self._num, self._frame)
        self._tracks = tuple(self._track(body, frame) for body in self._confirmed())
        return self._tracks

    def draw(self, num: int) -> tuple[Array, ...]:
        """Samples of the latest tracks, (num, 4) each, in random order; an error before the first reading."""
        if self._tracks is None:
            raise RuntimeError("draw() needs tracks: call update() with a reading first")
        pairs = zip(self._tracks, self._confirmed(), strict=True)
        return tuple(shuffled(track.particles, track.weights, num, body.streams[1]) for track, body in pairs)

    def _confirmed(self) -> list[Body]:
        return sorted((body for body in self._bodies if body.number != UNNAMED), key=lambda body: body.number)

    def _see(self, scan: ScanView) -> None:
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
        near = mahalanobis(means, covariances, positions, noise, ages)[0] <= FAR
        log_density = np.full(near.shape, -np.inf)
        for body, row, places in zip(self._bodies, log_density, near, strict=True):
            if places.any():
                row[places] = body.filter.log_density(positions[places], noise[places], ages[places])
        return log_density

    def _correct(self, body: Body, detection: Detection, log_density: float) -> None:
        """A detection belongs to a body, of that log of density under its belief [1/m^2]."""
        body.filter.correct(detection.position, detection.covariance, self._time - detection.time)
        body.life.detected(self._time, log_density)
        body.radius += (detection.radius - body.radius) / min(body.life.detections, RADIUS_MEMORY)
        if body.number == UNNAMED and body.life.confirmed:
            body.number, self._names = self._names, self._names + 1
            body.streams = tuple(stream(self._seed, channel, body.name) for channel in (PARTICLES, DRAWS))

    def _begin(self, detection: Detection) -> None:
        """A detection may be of a new body."""
        born = self._make(self._num, stream(self._seed, "estimation.resampling", f"birth{self._births}"))
        born.start(detection.position, detection.covariance)
        born.predict(self._time - detection.time)
        self._births += 1
        self._bodies.append(Body(born, Life(self._time, self._time), detection.radius))

    def _track(self, body: Body, frame: FrameError) -> Track:
        life, time, position = body.life, self._time, body.filter.mean[:2]
        covariance, particles = body.filter.covariance.copy(), body.filter.draw(self._num, body.streams[0])
        covariance[:2, :2] += frame.covariance(position)
        particles[:, :2] += frame.samples(position)
        return Track(
            body.name, time, particles, self._weights, body.filter.mean, covariance, float(self._num), body.radius,
            age=time - life.born, unseen=time - life.seen,
        )  # fmt: skip


def _is_finite(detection: Detection) -> bool:
    numbers = *detection.position, *detection.covariance.ravel(), detection.radius, detection.time
    return bool(np.isfinite(numbers).all())
