"""The robot's pose by a particle filter on (x, y, heading): wheels and gyro predict, scans against the map correct.

Monte Carlo localisation (Thrun, Burgard & Fox 2005, tables 8.2 and 8.3):

    predict    (v, omega)_i drawn from what wheels and gyro measured and their channels' own laws (`twist.py`), along
               the unicycle's arc
    correct    w_i <- w_i p(scan | x_i)^t by the likelihood field (`likelihood_field.py`). Beams beside one another see
               the same surface, with the same error of the map and of the scan's motion: t < 1 counts them as fewer
    resample   where the effective sample size is low, as many as the belief's spread asks for (`kld.py`), roughened
    recover    where the scans are explained no more, poses from all over the floor compete with the belief
               (`recovery.py`)

A scan in which too few beams met anything corrects nothing, and on a map without surfaces none does: the belief then
grows as wheels and gyro let it.
"""

import numpy as np

from mjnav.estimation.base import HEADING, PoseEstimator, assumed_noise
from mjnav.estimation.lidar.cloud import Cloud
from mjnav.estimation.lidar.likelihood_field import LikelihoodField, contradictions, put_right, ways_of
from mjnav.estimation.lidar.recovery import FloorSearch, Recovery
from mjnav.estimation.lidar.scan import MotionHistory, TwistSensors, scan_points
from mjnav.geometry.angles import wrap
from mjnav.messages import Array, Reading, RobotBelief
from mjnav.rng import stream
from mjnav.scenarios.spec import Scenario
from mjnav.scenarios.ways import floor_of_lidar, floor_of_robot

START_STD = (0.03, 0.03, 0.02)  # [m], [m], [rad]: how well a known start is known
GLOBAL_PARTICLES = 2000  # at most, where that is more than `particles`, while the belief is as wide as this:
WIDE = 0.5  # [m] std of the position
NEW = 20  # scans after a search in which beams that go through surfaces count, too: modes are told apart by them
LEAST_RETURNS = 5  # of a scan that corrects


def field_and_search(scenario: Scenario) -> tuple[LikelihoodField, FloorSearch]:
    """The likelihood field of a scenario's lidar on the robot's map, and the floor on which the robot may be."""
    noise, robot, known = assumed_noise(scenario), scenario.robot, scenario.known_bodies
    field = LikelihoodField.of(floor_of_lidar(known), scenario.sensors.scanner, noise["lidar.range"])
    floor = floor_of_robot(known.walls, known.tables, known.pillars)
    return field, FloorSearch.of(field, floor, robot.radius, np.array([robot.start[:2], *robot.route]))


class LidarLocalizer(PoseEstimator):
    """`lidar.particle`."""

    def __init__(
        self,
        field: LikelihoodField,
        search: FloorSearch,
        twists: TwistSensors,
        start: Array | None,
        num_particles: int,
        seed: int,
    ):
        """`start` (3,) is about where the robot is in the beginning; None for anywhere on the floor."""
        super().__init__(seed)
        self._field, self._search = field, search
        self._most = num_particles
        self._recovery = Recovery(field, search, twists, seed)
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
        robot, choice = scenario.robot, scenario.estimation.robot
        field, search = field_and_search(scenario)
        start = None if choice.start == "global" else np.array(robot.start)
        twists = TwistSensors.of(assumed_noise(scenario), robot.limits)
        return cls(field, search, twists, start, choice.particles, seed)

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
