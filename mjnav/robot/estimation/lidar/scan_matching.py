"""Scan matching: the pose at which a scan lies best on a map's surfaces, and a Kalman filter that is corrected by it.

A point p of the scan, in the robot's frame, lies at q = (x, y) + R(theta) p in the world. Its residual is the map's
clearance c(q), which is 0 on a surface. With g = grad c(q) the residual's derivative by the pose is

    J = (g_x, g_y, g . R'(theta) p)

and its variance, for a range of variance s^2 along the beam's direction u, is (g . u)^2 s^2 + t^2, t that of the map:
a beam along a wall says as much of the way to the wall as one that meets it squarely. Points that no surface of the
map explains, on people before a wall, get the weight of Geman and McClure,

    w = (m / (m + e^2))^2,   e = c / std,

with m large at first and then small (graduated non-convexity: Blake & Zisserman 1987; Yang et al. 2020), and the pose
follows from Gauss-Newton steps (sum w J^T J / var) d = -sum w J^T c / var. The field takes the place of
correspondences, as in the likelihood field of Thrun, Burgard & Fox (2005, ch. 6.4) and Biber & Strasser (2003).

A beam sees only faces that are turned to it. Where the nearest face is turned away (g . u > 0), as for a point in the
farther half of a wall, the face that was seen is at least |c| before the point: then c = -|c| and g = -g.

Directions that the scan does not determine, such as along a corridor, stay as guessed (Zhang, Kaess & Singh 2016).

The filter:

    predict   by wheels and gyro                                             (`scan`, `estimation.kalman`)
    match     the scan on the map, from the prediction x, P: a pose z, R
    gate      (z - x)^T (P + R)^-1 (z - x) <= chi-squared
    correct   x, P by z, R

A match that the prediction excludes, or that explains little of the scan, is not taken. Without a scan the filter only
predicts, and its covariance grows.

The measurement belongs to a moment that has passed: a lidar takes a turn before it hands it over, and the motion since
is known with errors that also moved the prediction. So the filter stands at the moment of its latest measurement; what
is believed now is carried there from it.

One Gaussian holds one place. After some good matches in a row that were not taken, as where wheels slip, the filter
starts again from the match; after some scans in a row that are not explained, and at the first scan where no start is
given, from the place of the whole floor that fits best (`localizer.FloorSearch`).
"""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from importlib import import_module

import numpy as np
from numpy.linalg import eigh, solve

from mjnav.compile.compiled import Matrix, Vector, kernel
from mjnav.constant import Constant
from mjnav.geometry.angles import wrap
from mjnav.geometry.distance_field import DistanceField, FieldGrid, lookup
from mjnav.messages import Array, Reading, RobotBelief
from mjnav.noise import Distribution
from mjnav.rng import stream
from mjnav.robot.estimation.base import MAX_LOG_DENSITY, PoseEstimator
from mjnav.robot.estimation.kalman import Gaussian, pose_belief, pose_given, pose_moved, pose_residual
from mjnav.robot.estimation.lidar.likelihood_field import contradictions, put_right, ways_of
from mjnav.robot.estimation.lidar.localizer import LEAST_RETURNS, START_STD, FloorSearch, parts_of
from mjnav.robot.estimation.lidar.scan import MotionHistory, TwistSensors, scan_points
from mjnav.scene.sensors import Lidar
from mjnav.scene.spec import Scenario

# --------------------------------------------------------------------------------- match of one scan


MAP_STD = 0.01  # [m] of the map's surfaces and of the field between its nodes
SCALE, WIDE_SCALE = 2.0, 8.0  # std beyond which a point counts for little: in the end, and in the first step
MAX_STEPS = 15  # of Gauss-Newton; most matches take four to six
PRECISION = 1e-5  # [m], [rad] of a step that is the last one
LOOSEST = 0.2  # [m], [rad] std of a direction that is still determined
UNKNOWN = 10.0  # [m], [rad] std of a direction that the scan does not determine
INFLATION = 1.4  # factor on the covariance: neighbouring beams share errors
SHARED_STD = (0.0015, 0.0015, 0.001)  # [m], [m], [rad] of the pose by errors of the map, its field and the beams' times
LEAST_FACING = 0.1  # cosine of the angle between a beam and a face, of which the expected range is told
WITHIN = 2.5  # standard deviations
LEAST_STD = 2e-3  # [m] of a range


@dataclass(frozen=True, slots=True)
class ScanMatch(Constant):
    """A pose as a scan measures it."""

    pose: Array  # (3,)
    covariance: Array  # (3, 3)
    num_points: int  # of the scan that met something
    explained: float  # mean weight of those within reach: about the share that lies on surfaces of the map


def match_scan(
    field: DistanceField,
    points: Array,
    range_std: Array,
    guess: Array,
    inflation: float = INFLATION,
    reach: float = np.inf,
) -> ScanMatch:
    """Matches points (n, 2) [m] in the robot's frame, NaN where a beam met nothing, from a guessed pose (3,) on.

    range_std (n,) [m] is that of each range, `inflation` a factor on the covariance. Surfaces beyond `reach` [m] do not
    count (`reach_of`). Without points, and on an empty map, the pose is the guess and every direction unknown.
    """
    met = np.isfinite(points).all(axis=1)
    points, variance = np.ascontiguousarray(points[met]), np.ascontiguousarray(range_std[met] ** 2)

    def equations(pose: Array, m: float) -> tuple[Array, Array, float]:
        return normal_equations(points, variance, pose, field.grid, MAP_STD**2, m, reach)

    return best_match(equations, len(points) if field.grid.clearance.size else 0, guess, inflation)


def best_match(
    equations: Callable[[Array, float], tuple[Array, Array, float]], num: int, guess: Array, inflation: float
) -> ScanMatch:
    """By Gauss-Newton steps: `equations` of a pose and of m are those of `num` points."""
    pose, scale = np.array(guess, float), WIDE_SCALE
    hessian, explained = np.zeros((3, 3)), 0.0
    for _ in range(MAX_STEPS if num else 0):
        hessian, gradient, explained = equations(pose, scale**2)
        step = -_inverse(hessian, 0.0) @ gradient
        if scale == SCALE and np.abs(step).max() < PRECISION:
            break
        pose += step
        scale = max(0.5 * scale, SCALE)
    pose[2] = wrap(pose[2])
    covariance = _inverse(hessian / inflation, UNKNOWN**2)
    covariance += np.diag(np.square(SHARED_STD))
    return ScanMatch(pose, covariance, num, explained)


def reach_of(lidar: Lidar, noise: Distribution) -> float:
    """How far [m] a surface may be for nearly all of its returns to be within the lidar's range.

    Of a surface at the end of the range only the returns come back that err to the near side.
    """
    end = lidar.max_range
    return float(end - lidar.bias(end, noise) - WITHIN * lidar.std(end, noise))


def _inverse(hessian: Array, unknown: float) -> Array:
    """Of the symmetric matrix (3, 3), `unknown` in place of the variances of directions beyond std LOOSEST."""
    values, vectors = eigh(hessian)
    determined = values > LOOSEST**-2
    variances = np.where(determined, 1.0 / np.where(determined, values, 1.0), unknown)
    return (vectors * variances) @ vectors.T


def weighted_law(noise: Distribution, map_std: float = MAP_STD) -> tuple[float, float]:
    """What the weights make of ranges with errors of this law, z = (error - mean) / std.

    First the centre, the b with E[w z'] = 0, z' = z - b: a match takes ranges with the error b for right. It is 0 for a
    symmetric law; of a skewed one the weights draw it to the mode. Second the variance of a match over what its weights
    sum up to, E[(w z')^2] E[w] / E[d(w z')/dz]^2 / (1 + t^2 / std^2), t the std of the map (Huber 1981, ch. 3.2).
    (0, 1) of a law without a spread.
    """
    if noise.std == 0.0:
        return 0.0, 1.0
    z = np.linspace(-12.0, 12.0, 4801)
    density = np.exp(np.minimum(noise.logpdf(noise.mean + noise.std * z), MAX_LOG_DENSITY))
    density /= density.sum()
    widened = 1.0 + (map_std / noise.std) ** 2
    m = SCALE**2 * widened
    centre = 0.0
    for _ in range(100):
        weights = density * (m / (m + (z - centre) ** 2)) ** 2
        centre = float(weights @ z / weights.sum())
    squared = (z - centre) ** 2
    w = (m / (m + squared)) ** 2
    slope = density @ (w * (1.0 - 4.0 * squared / (m + squared)))
    return centre, float((density @ (w * w * squared)) * (density @ w) / slope**2 / widened)


def centred(points: Array, scan: Array, lidar: Lidar, noise: Distribution, centre: float) -> tuple[Array, Array]:
    """Points (B, 2) of a scan less the error b = `centre` that weights take for right, and their std of range (B,) [m].

    See `weighted_law`.
    """
    std = np.sqrt(lidar.std(np.nan_to_num(scan, posinf=0.0), noise) ** 2 + lidar.resolution**2 / 12.0 + LEAST_STD**2)
    away = points - lidar.mount[:2]
    away /= np.maximum(np.hypot(away[:, 0], away[:, 1]), LEAST_STD)[:, None]
    return points - (centre * std)[:, None] * away, std


@kernel
def normal_equations(
    points: Matrix, variance: Vector, pose: Vector, grid: FieldGrid, map_variance: float, m: float, reach: float
):
    """sum w J^T J / var (3, 3), sum w J^T c / var (3,) and mean w of points (n, 2), var (n,) of their ranges.

    Of points on surfaces at most `reach` [m] away: length - c / (g . u) along the beam.
    """
    hessian, gradient, total, count = np.zeros((3, 3)), np.zeros(3), 0.0, 0
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    for i in range(len(points)):
        x, y = cos * points[i, 0] - sin * points[i, 1], sin * points[i, 0] + cos * points[i, 1]
        c, gx, gy = lookup(grid, pose[0] + x, pose[1] + y)
        length = max(np.sqrt(x * x + y * y), 1e-9)
        along = (gx * x + gy * y) / length
        if along > 0.0:
            c, gx, gy, along = -abs(c), -gx, -gy, -along
        if length - c / min(along, -LEAST_FACING) > reach:
            continue
        count += 1
        turn = gy * x - gx * y
        inverse = 1.0 / (along * along * variance[i] + map_variance)
        weight = m / (m + c * c * inverse)
        weight *= weight
        total += weight
        share = weight * inverse
        hessian[0, 0] += share * gx * gx
        hessian[0, 1] += share * gx * gy
        hessian[0, 2] += share * gx * turn
        hessian[1, 1] += share * gy * gy
        hessian[1, 2] += share * gy * turn
        hessian[2, 2] += share * turn * turn
        gradient[0] += share * c * gx
        gradient[1] += share * c * gy
        gradient[2] += share * c * turn
    hessian[1, 0], hessian[2, 0], hessian[2, 1] = hessian[0, 1], hessian[0, 2], hessian[1, 2]
    return hessian, gradient, total / max(count, 1)


# ------------------------------------------------------------------------ Gaussian of a past moment


SAME = 1e-9  # [s] below which two moments are one


@dataclass(frozen=True, slots=True)
class Motion:
    """A twist from `begin` to `end` [s], of which any part may be undone.

    Its error is taken for white noise within: the way of a part of length s has the covariance density s.
    """

    begin: float
    end: float
    twist: Array  # (2,) v [m/s], omega [rad/s]
    density: Array  # (2, 2), covariance of the mean twist times the interval

    def carry(self, pose: Gaussian) -> Gaussian:
        """A pose at its beginning, carried to its end."""
        interval = self.end - self.begin
        return pose_moved(pose, self.twist, self.density / interval, interval)


class DelayedPose:
    """A pose at a moment of the past, and the motions since."""

    def __init__(self, past: Gaussian, kept: float):
        """Measurements may be up to `kept` [s] old."""
        self.past, self._kept = past, kept
        self._time = -np.inf  # [s] of the past; before the first motion it is any
        self._since: deque[Motion] = deque()

    def move(self, motion: Motion) -> None:
        """Goes on by a motion that begins where the latest one ended."""
        self._since.append(motion)
        self.go_to(motion.end - self._kept)

    def go_to(self, time: float) -> bool:
        """Takes the past on to `time` [s]; whether it is not there already or beyond."""
        if time <= self._time + SAME:
            return False
        while self._since and self._since[0].begin < time - SAME:
            motion = self._since.popleft()
            if motion.end > time + SAME:
                self._since.appendleft(replace(motion, begin=time))
                motion = replace(motion, end=time)
            self.past = motion.carry(self.past)
        self._time = time
        return True

    @property
    def now(self) -> Gaussian:
        """The past carried on to the end of the latest motion."""
        pose = self.past
        for motion in self._since:
            pose = motion.carry(pose)
        return pose


# ----------------------------------------------------------------------- localizer by scan matching


SLACK = 0.5  # [s] that a scan may be older than a turn
GATE = 21.1  # squared distance of prediction and match: 99.99 % of chi-squared with three degrees of freedom
EXPLAINED = 0.2  # least mean weight of a scan's points where a match is a measurement
DOUBTFUL = 0.45  # mean weight below which the place may be wrong altogether; 0.6 to 0.8 is common
PATIENCE = 5  # doubtful scans in a row before the floor is searched; after a search in vain twice as many
SLIPS = 3  # matches in a row that explain the scan and are not taken, before the filter starts again from one
BETTER = 0.15  # by which the mean weight is greater at a better place
NUM_GUESSES = 20  # poses of a search from which a scan is matched


class MatchingLocalizer(PoseEstimator):
    """By an extended Kalman filter that scans correct; `particles` are draws from its Gaussian."""

    def __init__(self, lidar: Lidar, noise: Distribution, twists: TwistSensors, start: Gaussian, num: int, seed: int):
        """`noise` is that of a range; `num` particles are drawn."""
        super().__init__(seed)
        import_module("scipy.linalg")  # which `Gaussian.given` needs, not to be loaded at a tick
        self._lidar, self._noise = lidar, noise
        self._centre, variance = weighted_law(noise)
        self._inflation = variance * INFLATION
        self._blind = np.zeros(2, int)  # intervals in a row in which v and omega were not measured
        self._history = MotionHistory(twists)
        self._pose = DelayedPose(start, (0.0 if lidar.rate is None else 1.0 / lidar.rate) + SLACK)
        self._doubts, self._patience = 0, PATIENCE  # doubtful scans in a row; until the next search
        self._slips = 0  # matches in a row that explain the scan and were not taken
        self._num, self._stream = num, stream(seed, "estimation.gaussian")

    def update(self, reading: Reading) -> RobotBelief:
        """The belief after one more reading."""
        if reading.interval > 0.0:
            self._predict(reading)
        recovered = self._see(reading)
        self._belief = pose_belief(self._pose.now, reading.time, self._num, self._stream, recovered)
        return self._belief

    def _predict(self, reading: Reading) -> None:
        """Moves the belief over a reading's interval.

        The error of a twist that nothing measures stays from interval to interval: its part in the variance of the way
        grows with k^2 after k intervals, by 2 k + 1 in the next one.
        """
        twist = self._history.follow(reading)
        self._blind = np.where([twist.knows_v, twist.knows_omega], 0, self._blind + 1)
        covariance = twist.covariance * np.maximum(2 * self._blind - 1, 1)
        begin = twist.time - twist.interval
        velocity = np.array([twist.v, twist.omega])
        self._pose.move(Motion(begin, twist.time, velocity, covariance * twist.interval))

    def _see(self, reading: Reading) -> bool:
        """Takes what a reading's scan says; whether the filter has started again.

        Its points are those of the robot's frame at the mean time of the beams, to which the filter is taken.
        """
        points = self._points(reading)
        if np.count_nonzero(np.isfinite(points[:, 0])) < LEAST_RETURNS:
            return False
        time = float(np.mean(reading.scan_times)) if len(reading.scan_times) else reading.time
        if not self._pose.go_to(time):
            return False
        ((x, y, heading),) = self._history.poses(np.array([time]), reading.time)
        c, s = np.cos(heading), np.sin(heading)
        points = (points - [x, y]) @ np.array([[c, -s], [s, c]])
        return self._correct(*centred(points, reading.scan, self._lidar, self._noise, self._centre))

    def _points(self, reading: Reading) -> Array:
        """The returns (B, 2) that count in the robot's frame at the reading, NaN for others."""
        return scan_points(reading, self._history, self._lidar, self._noise)

    def _correct(self, points: Array, std: Array) -> bool:
        """Takes what a scan says at the moment of the past; whether the filter has started again."""
        past = self._pose.past
        match = self._match(points, std, past.mean)
        innovation = pose_residual(match.pose, past.mean)
        distance = float(innovation @ solve(past.covariance + match.covariance, innovation))
        taken = match.explained >= EXPLAINED and distance <= GATE
        if taken:
            self._pose.past = pose_given(past, match.pose, match.covariance)
        found = self._elsewhere(points, std, match, taken)
        if found is None or found.explained < EXPLAINED:
            return False
        self._pose.past = Gaussian(found.pose, found.covariance)
        return True

    def _match(self, points: Array, std: Array, guess: Array) -> ScanMatch:
        """How points lie best on what is known, from a guessed pose (3,) on; each localizer knows something else."""
        raise NotImplementedError

    def _elsewhere(self, points: Array, std: Array, match: ScanMatch, taken: bool) -> ScanMatch | None:
        """A place to start again from, if there is one, after a scan that led to a `match`, whether it was `taken`."""
        doubtful = match.explained < DOUBTFUL
        self._doubts = self._doubts + 1 if doubtful else 0
        self._slips = 0 if taken or doubtful else self._slips + 1
        if not doubtful:
            self._patience = PATIENCE
        if self._slips >= SLIPS:
            self._slips = 0
            return match
        if self._doubts < self._patience:
            return None
        self._doubts, self._patience = 0, 2 * self._patience
        found = self._best(points, std, [match])
        if found.explained >= match.explained + BETTER:
            self._patience = PATIENCE
            return found
        return None if taken else match

    def _best(self, points: Array, std: Array, others: Sequence[ScanMatch]) -> ScanMatch:
        """The place that makes a scan the likeliest, of `others` and of what a search finds."""
        return others[0]


class ScanMatchingLocalizer(MatchingLocalizer):
    """By matches of scans with a map."""

    def __init__(self, search: FloorSearch, twists: TwistSensors, start: Array | None, num_particles: int, seed: int):
        """`start` (3,) is where the robot is in the beginning; None for anywhere on the floor."""
        self._search, self._field = search, search.field
        self._anywhere = start is None  # until the first scan
        if start is None:
            places = search.places
            spread = np.square([*(places.std(axis=0) + search.cell), np.pi])
            past = Gaussian(np.append(places.mean(axis=0), 0.0), np.diag(spread))
        else:
            past = Gaussian(np.array([*start[:2], wrap(start[2])]), np.diag(np.square(START_STD)))
        super().__init__(search.field.lidar, search.field.noise, twists, past, num_particles, seed)
        self._reach = reach_of(self._lidar, self._noise)
        self._searching = stream(seed, "estimation.search")

    @classmethod
    def of(cls, scenario: Scenario, seed: int) -> "ScanMatchingLocalizer":
        """With the scenario's map, lidar and assumed noise."""
        return cls(*parts_of(scenario), scenario.estimation.robot.particles, seed)

    def _see(self, reading: Reading) -> bool:
        return not self._field.is_empty and super()._see(reading)

    def _correct(self, points: Array, std: Array) -> bool:
        past = self._pose.past
        if self._anywhere:
            found, self._anywhere = self._best(points, std), False
            self._pose.past = Gaussian(found.pose, found.covariance)
            return False
        points = put_right(points, self._lidar, past.mean, past.covariance, self._field.field.grid)
        return super()._correct(points, std)

    def _match(self, points: Array, std: Array, guess: Array) -> ScanMatch:
        return match_scan(self._field.field, points, std, guess, self._inflation, self._reach)

    def _best(self, points: Array, std: Array, others: Sequence[ScanMatch] = ()) -> ScanMatch:
        """The place that makes a scan the likeliest, of those all over the floor and of others."""
        poses = self._search.found(points, self._searching)
        matches = [*others, *(self._match(points, std, guess) for guess in poses[:: len(poses) // NUM_GUESSES])]
        poses, beams = np.array([match.pose for match in matches]), self._field.beams(points)
        likelihood = self._field.log_ratio(poses, beams)
        likelihood += contradictions(poses, ways_of(points, self._field, beams.num), self._field)[0]
        return matches[int(np.argmax(likelihood))]
