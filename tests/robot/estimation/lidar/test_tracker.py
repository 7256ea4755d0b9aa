"""Synthetic bodies, detected from the origin of a plane, and the scans of a scene."""

from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np
import pytest

from mjnav.messages import Detection, Reading, RobotBelief
from mjnav.robot.estimation.lidar.tracker import KalmanLidarTracker, LidarTracker, assigned, mahalanobis

STD, RADIUS = 0.03, 0.3  # [m]
PERIOD = 0.1  # [s]


@dataclass
class View:
    """What is seen from the origin of discs at known places."""

    detections: tuple[Detection, ...]
    bodies: np.ndarray  # (n, 2)

    def visible(self, points, radius):
        """All of it or nothing: a body hides what lies behind it, within its shadow."""
        points = np.reshape(points, (-1, 2))
        return np.array([float(not hidden(point, self.bodies)) for point in points])


def hidden(point, bodies):
    distance = np.hypot(*point)
    ahead = bodies @ point / distance
    beside = np.abs(bodies[:, 0] * point[1] - bodies[:, 1] * point[0]) / distance
    return bool(((ahead > 0.0) & (ahead < distance - 2.0 * RADIUS) & (beside < RADIUS)).any())


class Watcher:
    """Detects bodies along `paths` (T, n, 2), each with Gaussian noise, where no other body hides them."""

    def __init__(self, paths, seed=0, age=0.0, clutter=0.0):
        self.paths, self.age, self.clutter = paths, age, clutter
        self.rng = np.random.default_rng(seed)

    def detect(self, reading, robot):
        k = round(reading.time / PERIOD)
        bodies = self.paths[k]
        velocity = (self.paths[k] - self.paths[max(k - 1, 0)]) / PERIOD
        noise = STD * self.rng.standard_normal(bodies.shape)
        false = self.rng.uniform(-10.0, 10.0, (self.rng.poisson(self.clutter * 400.0), 2))
        there = [not hidden(body, bodies) for body in bodies]
        seen = (bodies + noise - self.age * velocity)[there]
        return View(tuple(self._detection(reading, z) for z in [*seen, *false]), bodies)

    def follow(self, reading):
        """It needs no motion: its bodies are in the world."""

    def _detection(self, reading, position):
        return Detection(reading.time - self.age, position, STD**2 * np.eye(2), RADIUS, 20)


def reading(k, scan=True):
    ranges, interval = np.ones(3) if scan else np.zeros(0), PERIOD if k else 0.0
    return Reading(PERIOD * k, interval, np.zeros(2), 0.0, np.zeros(3), np.zeros((0, 2)), ranges)


ROBOT = RobotBelief(0.0, np.zeros((1, 3)), np.ones(1), np.zeros(3), 1e-6 * np.eye(3), 1.0)


FILTERS = pytest.mark.parametrize("kind", [LidarTracker, KalmanLidarTracker])


def followed(paths, *, seed=0, num=100, scans=lambda k: True, kind=LidarTracker, **watcher):
    """The tracks of every tick, by a tracker of `paths` (T, n, 2)."""
    tracker = kind(Watcher(np.asarray(paths), seed, **watcher), num, seed)
    return [tracker.update(reading(k, scans(k)), ROBOT) for k in range(len(paths))]


def walk(*legs, start=(0.0, 0.0)):
    """A path (T, 2) by legs of (ticks, vx, vy)."""
    steps = [PERIOD * np.array(velocity) for ticks, *velocity in legs for _ in range(ticks)]
    return np.array(start) + np.cumsum([np.zeros(2), *steps], axis=0)[:-1]


def test_a_track_is_confirmed_by_its_third_detection_and_named_in_order():
    rows = followed(np.stack([walk((20, 0.8, 0.0), start=(2.0, 1.0)), walk((20, 0.0, 0.0), start=(-3.0, 2.0))], axis=1))
    assert [len(row) for row in rows[:4]] == [0, 0, 2, 2]
    assert [track.name for track in rows[-1]] == ["track0", "track1"]
    assert [track.age for track in rows[-1]] == pytest.approx([1.9, 1.9])
    walker, stander = rows[-1]
    assert walker.mean == pytest.approx([3.52, 1.0, 0.8, 0.0], abs=0.12)
    assert stander.mean == pytest.approx([-3.0, 2.0, 0.0, 0.0], abs=0.05)
    assert walker.radius == pytest.approx(RADIUS)


@FILTERS
def test_people_who_cross_keep_their_names(kind):
    swapped = 0
    for seed in range(5):
        one = walk((50, 1.0, 0.0), start=(1.5, 1.8))
        other = walk((50, -1.0, 0.1), start=(6.0, 2.2))
        rows = followed(np.stack([one, other], axis=1), seed=seed, kind=kind)
        assert {track.name for row in rows for track in row} == {"track0", "track1"}
        last = {track.name: track.mean[0] for track in rows[-1]}
        first = {track.name: track.mean[0] for track in rows[2]}
        swapped += (first["track0"] < first["track1"]) == (last["track0"] < last["track1"])
    assert swapped == 0


@FILTERS
def test_who_is_hidden_for_two_seconds_comes_back_under_the_same_name(kind):
    for seed in range(5):
        walker = walk((70, 0.8, 0.0), start=(1.0, 4.0))
        pillar = walk((70, 0.0, 0.0), start=(1.8, 2.0))
        paths = np.stack([walker, pillar], axis=1)
        out = [hidden(row[0], row) for row in paths]
        assert 18 <= sum(out) <= 26
        rows = followed(paths, seed=seed, kind=kind)
        names = [{track.name for track in row} for row in rows[3:]]
        assert all(row == {"track0", "track1"} for row in names)
        unseen = max(track.unseen for row in rows for track in row)
        assert 1.8 <= unseen <= 2.6


@FILTERS
def test_without_scans_tracks_go_on_spread_and_end(kind):
    path = walk((120, 0.4, 0.0), start=(2.0, 1.0))
    rows = followed(path[:, None], scans=lambda k: k < 20, kind=kind)
    before, later = rows[19][0], rows[34][0]
    assert later.unseen == pytest.approx(1.5)
    assert later.mean[0] == pytest.approx(path[34, 0], abs=0.4)
    assert np.trace(later.covariance[:2, :2]) > 20.0 * np.trace(before.covariance[:2, :2])
    assert all(np.isfinite(track.particles).all() for row in rows for track in row)
    assert rows[-1] == ()


def test_a_robot_that_does_not_know_where_it_is_only_predicts_and_its_tracks_stay_numbers():
    path = walk((40, 0.5, 0.0), start=(2.0, 1.0))
    tracker = LidarTracker(Watcher(path[:, None]), 100, 0)
    nowhere = replace(
        ROBOT, particles=np.full((1, 3), np.nan), mean=np.full(3, np.nan), covariance=np.full((3, 3), np.nan)
    )
    for k in range(40):
        (*_, track) = tracker.update(reading(k), nowhere if 15 <= k < 25 else ROBOT) or (None,)
        if k == 24:
            assert track.unseen == pytest.approx(1.0)
        if k > 3:
            assert np.isfinite(track.particles).all()
            assert np.isfinite(track.covariance).all()
    assert track.name == "track0"
    assert track.mean[:2] == pytest.approx(path[-1], abs=0.1)


def test_the_robots_own_error_spreads_its_tracks_the_more_the_farther_they_are():
    rng, std = np.random.default_rng(0), 0.05
    turned = np.column_stack([np.zeros((500, 2)), std * rng.standard_normal(500)])
    robot = RobotBelief(0.0, turned, np.full(500, 0.002), turned.mean(axis=0), np.cov(turned.T), 500.0)
    paths = np.tile([[2.0, 0.0], [0.0, 6.0]], (40, 1, 1))
    tracker = LidarTracker(Watcher(paths), 400, 0)
    for k in range(40):
        tracks = tracker.update(reading(k), robot)
    for track, axis, distance in zip(tracks, (1, 0), (2.0, 6.0), strict=True):
        own = track.covariance[1 - axis, 1 - axis]  # along the line of sight
        assert track.covariance[axis, axis] - own == pytest.approx(0.5 * (std * distance) ** 2, rel=0.15)
        assert np.cov(track.particles.T)[axis, axis] == pytest.approx(track.covariance[axis, axis], rel=0.25)


def test_a_robot_that_finds_itself_elsewhere_forgets_what_it_had_placed_by_the_wrong_pose():
    paths = np.tile([[3.0, 1.0]], (10, 1, 1))
    tracker = LidarTracker(Watcher(paths), 100, 0)
    for k in range(8):
        tracks = tracker.update(reading(k), ROBOT)
    assert [track.name for track in tracks] == ["track0"]
    assert len(tracker.update(reading(8), replace(ROBOT, recovered=True))) == 1, "it was where it believed to be"
    elsewhere = replace(ROBOT, mean=np.array([6.0, 0.0, 0.0]), recovered=True)
    assert tracker.update(reading(9), elsewhere) == ()


# ------------------------------------------------------------------------- assignment of detections


FALSE = 0.02  # [1/m^2]


def test_a_detection_is_judged_by_where_the_track_was_when_it_was_made():
    rng = np.random.default_rng(0)
    means, positions, ages = rng.normal(size=(3, 4)), rng.normal(size=(2, 2)), np.array([0.0, 0.15])
    roots, noise = rng.normal(size=(3, 4, 4)), np.array([0.1 * np.eye(2), [[0.2, 0.05], [0.05, 0.1]]])
    covariances = roots @ roots.swapaxes(1, 2)
    squared = mahalanobis(means, covariances, positions, noise, ages)
    for i in range(3):
        for j in range(2):
            H = np.hstack([np.eye(2), -ages[j] * np.eye(2)])
            error, S = positions[j] - H @ means[i], H @ covariances[i] @ H.T + noise[j]
            assert squared[i, j] == pytest.approx(error @ np.linalg.solve(S, error))


def test_the_assignment_is_the_most_likely_of_all():
    rng = np.random.default_rng(1)
    for _ in range(30):
        num_tracks, num = rng.integers(1, 4), rng.integers(1, 4)
        density = rng.normal(-2.0, 3.0, (num_tracks, num))
        detectable = rng.uniform(0.0, 0.95, num_tracks)

        def likelihood(columns, density=density, detectable=detectable):
            total = 0.0
            for i, j in enumerate(columns):
                if j < 0:
                    total += np.log1p(-detectable[i])
                elif density[i, j] < np.log(FALSE):
                    return -np.inf
                else:
                    total += density[i, j] - np.log(FALSE)
            return total

        options = permutations([*range(num)] + [-1] * num_tracks, int(num_tracks))
        best = max(likelihood(columns) for columns in options)
        assert likelihood(assigned(density, detectable, FALSE)) == pytest.approx(best)


# ---------------------------------------------------------------------------------- life of a track
