"""The robot's pose by a particle filter on (x, y, heading): wheels and gyro predict, scans against the map correct.

Monte Carlo localisation (Thrun, Burgard & Fox 2005, tables 8.2 and 8.3):

    predict    (v, omega)_i drawn from what wheels and gyro measured and their channels' own laws (`scan.py`), along
               the unicycle's arc
    correct    w_i <- w_i p(scan | x_i)^t by the likelihood field (`likelihood_field.py`). Beams beside one another see
               the same surface, with the same error of the map and of the scan's motion: t < 1 counts them as fewer
    resample   where the effective sample size is low, as many as the belief's spread asks for, roughened
    recover    where the scans are explained no more, poses from all over the floor compete with the belief

A scan in which too few beams met anything corrects nothing, and on a map without surfaces none does: the belief then
grows as wheels and gyro let it.

The number of particles is that of D. Fox, "Adapting the sample size in particle filters through KLD-sampling"
(International Journal of Robotics Research, 2003): with n draws from a distribution over k bins, the Kullback-Leibler
distance between the draws' shares and the distribution stays below epsilon with probability 1 - delta for
n = X / (2 epsilon), X the 1 - delta quantile of chi-square with k - 1 degrees of freedom.

The search of the floor serves a start anywhere and a robot that was carried away. Poses drawn evenly over it are too
far apart for a likelihood that is a few centimetres wide: none of them would fit. So the likelihood is first taken
as wide as the poses are apart, and narrowed level by level while the best poses are drawn again and spread a little
less each time (annealed importance sampling: Neal 2001). Poses that fit equally well in different places stay side by
side.

Recovery is augmented: w_fast and w_slow follow the mean likelihood of a scan under the belief (Thrun, Burgard & Fox
2005, table 8.3). Where the fast one falls behind the slow one, or is so low that no pose explains the scan, or where
beams go through what the map has, poses that fit the scan are looked for all over the floor. The book mixes random
poses into the belief at once. Among people that is not safe: a scan that shows mostly people fits somewhere by chance,
and better than where the robot is. So the poses of the search are a second belief, the rival, which moves with the
robot. It takes over when its evidence over the next scans outweighs that of the belief: people move on, walls do not.
That goes quickly only where beams went through what the map has at the belief's poses: no crowd explains that.
"""

from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np

from mjnav.constant import Constant
from mjnav.filters.particles import ess, resample, systematic, weighted_moments
from mjnav.geometry.angles import wrap
from mjnav.geometry.floor import Floor, FreeSpace
from mjnav.messages import Array, Reading, RobotBelief
from mjnav.motion.unicycle import integrate_rows
from mjnav.rng import stream
from mjnav.robot.estimation.base import HEADING, PoseEstimator, assumed_noise
from mjnav.robot.estimation.lidar.likelihood_field import Beams, LikelihoodField, contradictions, put_right, ways_of
from mjnav.robot.estimation.lidar.scan import TWIST_CHANNELS, MotionHistory, Twist, TwistSensors, scan_points
from mjnav.scene.spec import Scenario
from mjnav.scene.ways import floor_of_lidar, floor_of_robot

# ------------------------------------------------------------------------------ number of particles


EPSILON = 0.05  # of the distance, Fox's own
QUANTILE = 2.3263478740408408  # z of 1 - delta for delta = 0.01
BIN = (0.05, 0.05, 0.05)  # [m], [m], [rad]: the width of a bin


def kld_bound(num_bins: int, epsilon: float = EPSILON, quantile: float = QUANTILE) -> int:
    """The number of particles for `num_bins` occupied bins, by Wilson and Hilferty's chi-square quantile (eq. 7).

    n = (k - 1)/(2 epsilon) (1 - 2/(9 (k - 1)) + sqrt(2/(9 (k - 1))) z)^3; 1 for a single bin.
    """
    if num_bins <= 1:
        return 1
    share = 2.0 / (9.0 * (num_bins - 1.0))
    return ceil((num_bins - 1.0) / (2.0 * epsilon) * (1.0 - share + sqrt(share) * quantile) ** 3)


def occupied_bins(particles: Array) -> int:
    """The number of bins of a regular grid of width BIN that hold at least one of the poses (n, 3)."""
    places = np.floor(particles / BIN).astype(np.int64) + 2**20  # 21 bits each: a million bins to either side
    return len(np.unique(places @ [2**42, 2**21, 1]))


# ------------------------------------------------------------------------------- weighted particles


RESAMPLE_BELOW = 0.5  # share of the particles, as effective sample size
ROUGHENING = 1.5  # K of `filters.particles.roughen`
JITTER = (0.05, 0.05, 0.05)  # [m], [m], [rad]: std that roughening takes a wider spread for: modes stay apart
SLIP_EVERY = 8  # particles one is moved by what wheels and gyro do not see: slipping, being pushed
SLIP_STD = (0.05, 0.05, 0.03)  # [m], [m], [rad] of that, in each scan
LEAST_ESS = 0.05  # share of the particles that one scan leaves at least, as effective sample size
TEMPER = 0.75  # t, the weight of a scan's likelihood
FEWEST = 200  # particles, whatever the bound on the Kullback-Leibler distance says
COUNTED = 0.1  # of the mean weight: particles below do not count among those whose spread asks for particles
BISECTIONS = 12


class Cloud:
    """Particles (n, 3) and their weights (n,)."""

    def __init__(self, particles: Array, twists: TwistSensors, seed: int, purpose: str):
        """Equally weighted particles; the draws are from streams of `purpose`."""
        self.particles = particles
        self.weights = np.full(len(particles), 1.0 / len(particles))
        self._twists = twists
        self._motion = {channel: stream(seed, f"{purpose}.motion.{channel}") for channel in TWIST_CHANNELS}
        self._resampling = stream(seed, f"{purpose}.resampling")
        self._roughening = stream(seed, f"{purpose}.roughening")
        self._slipping = stream(seed, f"{purpose}.slip")
        self._turning = stream(seed, f"{purpose}.turn")
        self._blind = (0, 0)  # intervals since v and omega were measured, or a scan corrected

    def predict(self, twist: Twist) -> None:
        """Moves each particle by a draw of the twist."""
        v, omega = self._twists.sample(twist, len(self.particles), self._motion, self._blind)
        self.particles = integrate_rows(self.particles, v, omega, twist.interval)
        known = (twist.knows_v, twist.knows_omega)
        self._blind = (0 if known[0] else self._blind[0] + 1, 0 if known[1] else self._blind[1] + 1)

    def slip(self) -> None:
        """Moves every few of the particles as if the wheels had slipped: before a scan, which says whether they had."""
        moved = self.particles.copy()
        slipped = moved[::SLIP_EVERY]
        slipped += self._slipping.standard_normal(slipped.shape) * SLIP_STD
        slipped[:, HEADING] = wrap(slipped[:, HEADING])
        self.particles = moved

    def correct(self, fit: Array) -> float:
        """Weighs by log-likelihoods (n,) of a scan; the log of their mean over the belief, exp(t fit) each."""
        prior, weighted = self.weights, TEMPER * fit
        self.weights = tempered(weighted, LEAST_ESS, prior)
        self._blind = (0, 0)
        highest = float(weighted.max())
        return highest + float(np.log(prior @ np.exp(weighted - highest)))

    def blur(self, lag: float, twist: Twist) -> None:
        """Spreads the particles by what wheels and gyro may have missed in the `lag` [s] since a scan's beams.

        The scan says where the robot was when its beams were taken. Its points were carried on to the reading by the
        twists, whose errors, independent from interval to interval, are std sqrt(lag interval) each by then.
        """
        far, turned = self._turning.standard_normal((2, len(self.particles))) * sqrt(lag * twist.interval)
        moved = self.particles.copy()
        moved[:, 0] += twist.std[0] * far * np.cos(moved[:, HEADING])
        moved[:, 1] += twist.std[0] * far * np.sin(moved[:, HEADING])
        moved[:, HEADING] = wrap(moved[:, HEADING] + twist.std[1] * turned)
        self.particles = moved

    def moments(self) -> tuple[Array, Array, float]:
        """Mean (3,), covariance (3, 3) and effective sample size."""
        mean, covariance = weighted_moments(self.particles, self.weights, HEADING)
        return mean, covariance, ess(self.weights)

    def resample(self, covariance: Array, size: float, most: int) -> None:
        """Draws by the weights as many as the spread asks for, at most `most`; nothing where all is well.

        Leaves the arrays as they are and makes new ones: they may be part of a belief.
        """
        present = len(self.particles)
        offset = self._resampling.random()
        counted = self.particles[self.weights * present > COUNTED]
        num = max(min(kld_bound(occupied_bins(counted)), most), min(FEWEST, most))
        if size >= RESAMPLE_BELOW * present and present <= most and num <= 1.5 * present:
            return
        capped = np.diag(np.minimum(np.diagonal(covariance), np.square(JITTER)))
        normal = self._roughening.standard_normal((num, 3))
        self.particles = resample(self.particles, self.weights, offset, capped, ROUGHENING, normal)
        self.particles[:, HEADING] = wrap(self.particles[:, HEADING])
        self.weights = np.full(num, 1.0 / num)


def tempered(log_likelihood: Array, least: float, prior: Array | None = None) -> Array:
    """Weights prior_i exp(t l_i) / sum, (n,), with the largest t <= 1 that leaves an ESS of `least` n.

    Where the prior's own ESS is less than twice that, it leaves half of it. The prior is uniform by default.
    """
    num = len(log_likelihood)
    prior = np.full(num, 1.0 / num) if prior is None else prior
    shifted = np.minimum(log_likelihood - log_likelihood[prior > 0.0].max(), 0.0)
    target = min(least * num, 0.5 / float(prior @ prior))

    def at(exponent: float) -> Array:
        weights = prior * np.exp(exponent * shifted)
        return weights / weights.sum()

    weights, low, high = at(1.0), 0.0, 1.0
    if weights @ weights * target <= 1.0:
        return weights
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        weights = at(middle)
        low, high = (middle, high) if weights @ weights * target <= 1.0 else (low, middle)
    return at(low)


# ------------------------------------------------------------------------------ search of the floor


PER_AREA = 80.0  # [1/m^2] poses drawn first
MOST = 20_000  # poses drawn first, on large floors
KEPT = 1000  # poses of each further level
FOUND = 300  # poses that come out


@dataclass(frozen=True, slots=True)
class Level(Constant):
    """One level of the search."""

    spread: float  # [m] by which the likelihood is widened
    num_beams: int
    shift: float  # [m] std by which poses are spread for the next level
    turn: float  # [rad]
    temper: float = 1.0  # of the likelihood; the last level leaves modes as a scan of the filter does


LEVELS = (
    Level(0.3, 24, 0.15, 0.1),
    Level(0.12, 40, 0.06, 0.04, 0.5),
    Level(0.04, 60, 0.02, 0.012, 0.2),
    Level(0.02, 60, 0.01, 0.006, TEMPER),
)
KEEPS = 0.1  # of a level's poses, as effective sample size, whatever the likelihood says: so that no mode dies at once


@dataclass(frozen=True, slots=True)
class FloorSearch(Constant):
    """The free floor of a map, from which poses are drawn."""

    field: LikelihoodField
    places: Array  # (k, 2) [m] centres of the cells in which the robot may be
    cell: float  # [m]

    @classmethod
    def of(cls, field: LikelihoodField, floor: Floor, radius: float, route: Array) -> "FloorSearch":
        """The part of a floor on which a robot with this radius [m] can come to the points of its `route` (k, 2).

        All of the free floor where the map has no free place at the goal.
        """
        space = FreeSpace.of(floor, route)
        parts = space.parts(radius)
        goal = space.part_of(route[-1:], radius)[0]
        rows, columns = np.nonzero(parts == goal if goal > 0 else space.clearance >= radius)
        places = space.low + space.cell * np.column_stack([columns, rows])
        return cls(field, np.asarray(places, float), space.cell)

    def uniform(self, num: int, rng: np.random.Generator) -> Array:
        """Poses spread evenly over the floor and all headings, (num, 3)."""
        chosen = self.places[rng.integers(len(self.places), size=num)]
        chosen = chosen + self.cell * (rng.random((num, 2)) - 0.5)
        return np.column_stack([chosen, np.pi * (1.0 - 2.0 * rng.random(num))])

    def found(self, points: Array, rng: np.random.Generator) -> Array:
        """Poses at which a scan fits best, (FOUND, 3); `points` as `scan_points` gives them."""
        area = len(self.places) * self.cell**2
        poses = self.uniform(int(min(max(PER_AREA * area, KEPT), MOST)), rng)
        for level in LEVELS:
            fit = self.field.log_ratio(poses, self.field.beams(points, level.num_beams, level.spread))
            if level is LEVELS[-1]:
                fit += contradictions(poses, ways_of(points, self.field, level.num_beams), self.field)[0]
            num = FOUND if level is LEVELS[-1] else KEPT
            poses = poses[systematic(tempered(level.temper * fit, KEEPS), rng.random(), num)]
            poses = poses + rng.standard_normal(poses.shape) * (level.shift, level.shift, level.turn)
            poses[:, 2] = wrap(poses[:, 2])
        return poses


# ------------------------------------------------------------------ recovery of the particle filter


SLOW, FAST = 0.02, 0.3  # rates of w_slow and w_fast, a scan
BEHIND = 0.5  # share of w_slow by which w_fast is less where the search begins
LOST = 3.0  # w_fast below which no pose explains the scan: mean ratio of a return's density to that without a map
PATIENCE, MOST_PATIENCE = 3, 40  # scans between two searches; twice as many after each that has found nothing better
# Log of the odds that one scan adds at most, so that no single scan decides. Returns from before the surfaces may be
# people; beams that went through surfaces refute a pose, where they are more than a share of all and the others are not
# explained either: the map may have what is not there.
MOST_ODDS, REFUTED_ODDS, REFUTED = 0.07, 1.0, 0.1
TAKES_OVER, GIVES_UP = 4.0, -2.0  # log of the odds
YOUNG, TRIALS = 60, (3, 8, 16, 32)  # scans after a search in which its result is on trial; then others are looked for
TRIAL = 70  # scans after which a rival that has not taken over is dropped
COMPARED, WATCHED = 100, 10  # particles of a belief that are followed along the beams, beside a rival and always


class Recovery:
    """Watches a belief, and keeps the rival while there is one."""

    def __init__(self, search: FloorSearch, twists: TwistSensors, seed: int):
        self._field, self._search, self._twists, self._seed = search.field, search, twists, seed
        self._searching = stream(seed, "estimation.search")
        self._slow = self._fast = 0.0  # 0 before the first scan
        self._refuted = 0.0  # share of beams that went through surfaces, followed as w_fast
        self._age = YOUNG + 1  # scans since the belief came from a search; more than that where it did not
        self._since, self._patience = 0, PATIENCE  # scans since the last search, and until the next one
        self._rival: Cloud | None = None
        self._odds = 0.0  # log of those of the rival
        self._num_rivals = 0

    def predict(self, twist: Twist) -> None:
        """Moves the rival with the robot."""
        if self._rival is not None:
            self._rival.predict(twist)

    def rival(self, points: Array, beams: Beams, belief: Cloud, fit: Array) -> Array | None:
        """Poses (FOUND, 3) that take the belief's place, or None. `fit` (n,) is that of the belief's particles.

        The belief is the one before the correction by this scan.
        """
        self._since, self._age = self._since + 1, self._age + 1
        doubtful = self._doubts(points, beams, belief, fit)
        if self._rival is None:
            if (doubtful and self._since >= self._patience) or self._age in TRIALS:
                self._begin(points)
            elif not doubtful:
                self._patience = PATIENCE
            return None
        self._compare(points, beams, belief, fit)
        if self._odds >= TAKES_OVER:
            self.restart()
            return self._end()
        if self._odds <= GIVES_UP or self._since > TRIAL:
            self._patience = min(2 * self._patience, MOST_PATIENCE)
            self._end()
        return None

    def restart(self) -> None:
        """The belief is new, from a search: others that fit nearly as well are tried beside it for a while."""
        self._slow, self._age = 0.0, 0

    def _doubts(self, points: Array, beams: Beams, belief: Cloud, fit: Array) -> bool:
        """Whether the scans of late are not what the belief lets one expect."""
        quality = float(belief.weights @ np.exp(fit / beams.num))
        few = slice(None, None, max(len(belief.particles) // WATCHED, 1))
        weights = belief.weights[few]
        _, shares = contradictions(belief.particles[few], ways_of(points, self._field, beams.num), self._field)
        refuted = float(weights @ shares / weights.sum())
        if self._slow == 0.0:
            self._slow = self._fast = quality
            self._refuted = refuted
        self._slow += SLOW * (quality - self._slow)
        self._fast += FAST * (quality - self._fast)
        self._refuted += FAST * (refuted - self._refuted)
        return self._fast < self._least or self._refuted > REFUTED

    @property
    def _least(self) -> float:
        """Below it w_fast says that the scans are explained no more."""
        return max((1.0 - BEHIND) * self._slow, LOST)

    def _begin(self, points: Array) -> None:
        found = self._search.found(points, self._searching)
        self._rival = Cloud(found, self._twists, self._seed, f"estimation.rival{self._num_rivals}")
        self._num_rivals += 1
        self._odds, self._since = 0.0, 0

    def _end(self) -> Array | None:
        found, self._rival, self._since = self._rival, None, 0
        return None if found is None else found.particles

    def _compare(self, points: Array, beams: Beams, belief: Cloud, fit: Array) -> None:
        """Adds what one scan says to the odds."""
        rival = self._rival
        assert rival is not None
        ways = ways_of(points, self._field, beams.num)
        own = self._field.log_ratio(rival.particles, beams)
        own += contradictions(rival.particles, ways, self._field)[0]
        step = max(len(belief.particles) // COMPARED, 1)
        against, shares = contradictions(belief.particles[::step], ways, self._field)
        against, weights = TEMPER * (fit[::step] + against), belief.weights[::step]
        highest = float(against.max())
        evidence = rival.correct(own) - highest - float(np.log(weights @ np.exp(against - highest) / weights.sum()))
        refuted = weights @ shares > REFUTED * weights.sum() and self._fast < self._least
        most = REFUTED_ODDS if refuted or self._age <= YOUNG else MOST_ODDS
        self._odds += float(np.clip(evidence, -1.0, most))
        _, covariance, size = rival.moments()
        rival.resample(covariance, size, FOUND)


# ---------------------------------------------------------------------------------------- localizer


START_STD = (0.03, 0.03, 0.02)  # [m], [m], [rad]: how well a known start is known
GLOBAL_PARTICLES = 2000  # at most, where that is more than `particles`, while the belief is as wide as this:
WIDE = 0.5  # [m] std of the position
NEW = 20  # scans after a search in which beams that go through surfaces count, too: modes are told apart by them
LEAST_RETURNS = 5  # of a scan that corrects


def parts_of(scenario: Scenario) -> tuple[FloorSearch, TwistSensors, Array | None]:
    """What the scenario's map, lidar and assumed noise make, and the pose (3,) at the start, None where not known."""
    noise, robot, known = assumed_noise(scenario), scenario.robot, scenario.known_bodies
    field = LikelihoodField.of(floor_of_lidar(scenario), scenario.sensors.scanner, noise["lidar.range"])
    floor = floor_of_robot(known.walls, known.tables, known.pillars)
    search = FloorSearch.of(field, floor, robot.radius, np.array([robot.start[:2], *robot.route]))
    start = None if scenario.estimation.robot.start == "global" else np.array(robot.start)
    return search, TwistSensors.of(noise, robot.limits), start


class LidarLocalizer(PoseEstimator):
    """By particles, each weighed by the likelihood of the scan."""

    def __init__(self, search: FloorSearch, twists: TwistSensors, start: Array | None, num_particles: int, seed: int):
        """`start` (3,) is about where the robot is in the beginning; None for anywhere on the floor."""
        super().__init__(seed)
        self._field, self._search = search.field, search
        self._most = num_particles
        self._recovery = Recovery(search, twists, seed)
        self._history = MotionHistory(twists)
        self._starting = stream(seed, "estimation.start")
        self._anywhere = start is None  # until the first scan
        self._new = 0  # scans in which modes are still told apart
        if start is None:
            particles = search.uniform(max(num_particles, GLOBAL_PARTICLES), self._starting)
        else:
            particles = start + self._starting.standard_normal((num_particles, 3)) * START_STD
            particles[:, HEADING] = wrap(particles[:, HEADING])
        self._cloud = Cloud(particles, twists, seed, "estimation")

    @classmethod
    def of(cls, scenario: Scenario, seed: int) -> "LidarLocalizer":
        """With the scenario's map, lidar and assumed noise."""
        return cls(*parts_of(scenario), scenario.estimation.robot.particles, seed)

    def update(self, reading: Reading) -> RobotBelief:
        """The belief after one more reading; its moments come from the weights before resampling."""
        twist = self._history.follow(reading)
        if twist.interval > 0.0:
            self._cloud.predict(twist)
            self._recovery.predict(twist)
        points = scan_points(reading, self._history, self._field.lidar, self._field.noise)
        if len(points) and not self._anywhere:
            mean, covariance, _ = self._cloud.moments()
            points = put_right(points, self._field.lidar, mean, covariance, self._field.field.grid)
        informs = self._informs(points)
        recovered = informs and self._correct(points)
        cloud = self._cloud
        if informs and reading.scan_times.size:
            cloud.blur(max(reading.time - float(reading.scan_times.mean()), 0.0), twist)
        mean, covariance, size = cloud.moments()
        belief = RobotBelief(reading.time, cloud.particles, cloud.weights, mean, covariance, size, recovered)
        wide = covariance[0, 0] + covariance[1, 1] > WIDE**2
        cloud.resample(covariance, size, max(self._most, GLOBAL_PARTICLES) if wide else self._most)
        self._belief = belief
        return belief

    def _informs(self, points: Array) -> bool:
        """Whether a scan says anything of the pose."""
        returns = int(np.count_nonzero(np.isfinite(points[:, 0])))
        return not self._field.is_empty and returns >= LEAST_RETURNS

    def _correct(self, points: Array) -> bool:
        """Weighs the particles by a scan; whether others have taken their place."""
        beams = self._field.beams(points)
        if self._anywhere:
            self._restart(self._search.found(points, self._starting))
            self._recovery.restart()
            self._anywhere = False
        self._cloud.slip()
        fit = self._field.log_ratio(self._cloud.particles, beams)
        rival = self._recovery.rival(points, beams, self._cloud, fit)
        if rival is not None:
            self._restart(rival)
            fit = self._field.log_ratio(rival, beams)
        if self._new > 0:
            fit += contradictions(self._cloud.particles, ways_of(points, self._field, beams.num), self._field)[0]
            self._new -= 1
        self._cloud.correct(fit)
        return rival is not None

    def _restart(self, particles: Array) -> None:
        """Goes on from equally weighted particles."""
        self._cloud.particles, self._cloud.weights = particles, np.full(len(particles), 1.0 / len(particles))
        self._new = NEW
