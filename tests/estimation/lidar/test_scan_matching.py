import numpy as np
import pytest
from scipy.stats import chi2

from mjnav.estimation.lidar.scan_matching import (
    UNKNOWN,
    MatchSettings,
    match_scan,
    normal_equations,
    reach_of,
    weighted_law,
)
from mjnav.geometry.angles import wrap
from mjnav.geometry.distance_field import DistanceField
from mjnav.geometry.distances import beam_angles
from mjnav.geometry.floor import Floor
from mjnav.noise import make_distribution, profile
from mjnav.scenarios.sensors import LidarSpec, lidar_of

ANGLES = beam_angles(360)
POSE = np.array([3.0, 1.5, 0.4])
STD = 0.03  # [m] of a range


def points_of(ranges):
    """In the robot's frame, NaN where a beam met nothing."""
    return np.where(np.isfinite(ranges), ranges, np.nan)[:, None] * np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])


def error_of(match, pose):
    error = match.pose - pose
    error[2] = wrap(error[2])
    return error


@pytest.fixture(scope="module")
def field(room):
    return DistanceField.of(room, 0.025)


@pytest.mark.parametrize("off", [(0.0, 0.0, 0.0), (0.08, -0.06, 0.05), (-0.1, 0.1, -0.1), (0.15, 0.0, 0.08)])
def test_a_scan_without_noise_gives_the_pose_to_a_millimetre(room, field, ranges, off):
    match = match_scan(field, points_of(ranges(room, POSE)), np.full(360, 0.01), POSE + off)
    assert np.abs(error_of(match, POSE)).max() < 1e-3
    assert match.num_points == 360
    assert match.explained > 0.98


def test_people_before_the_walls_do_not_pull(room, field, ranges):
    seen = ranges(room, POSE)
    for first in (20, 110, 250):
        seen[first : first + 40] = np.minimum(seen[first : first + 40], 0.8)
    match = match_scan(field, points_of(seen), np.full(360, STD), POSE + np.array([0.05, 0.05, 0.03]))
    assert np.abs(error_of(match, POSE)).max() < 2e-3
    assert 0.6 < match.explained < 0.72


def test_along_a_corridor_the_guess_stays_and_its_variance_is_large(corridor, ranges):
    field = DistanceField.of(corridor)
    pose = np.array([0.0, 0.8, 0.2])
    guess = pose + np.array([0.3, 0.05, -0.05])
    match = match_scan(field, points_of(ranges(corridor, pose)), np.full(360, STD), guess)
    assert match.pose == pytest.approx([guess[0], pose[1], pose[2]], abs=2e-3)
    std = np.sqrt(np.diagonal(match.covariance))
    assert std[0] == pytest.approx(UNKNOWN, rel=0.01)
    assert std[1:].max() < 0.01
    assert np.linalg.eigvalsh(match.covariance).min() > 0.0


def test_returns_that_came_back_for_their_error_alone_do_not_pull(corridor, ranges):
    # A corridor whose end, 2.95 m ahead, is about as far as the lidar sees.
    end = Floor(corridor.discs, np.vstack([corridor.boxes, [[3.05, 1.0, 0.0, 1.0, 1.0, 0.05]]]))
    field, pose, law = DistanceField.of(end), np.array([0.05, 1.0, 0.0]), profile("gaussian")["lidar.range"]
    lidar, rng, found = lidar_of(LidarSpec(spread=0.06), 360, 3.0), np.random.default_rng(0), {}
    for _ in range(40):
        seen = ranges(end, pose) + 0.06 * rng.standard_normal(360)
        seen[seen > lidar.max_range] = np.inf
        for reach in (np.inf, reach_of(lidar, law)):
            found.setdefault(reach, []).append(
                match_scan(field, points_of(seen), np.full(360, 0.06), pose, reach=reach)
            )
    everything, within = found.values()
    errors = [error_of(match, pose)[0] for match in everything]
    assert np.mean(errors) > 0.01 > 4.0 * np.std(errors) / np.sqrt(40)
    assert np.mean([error_of(match, pose)[0] for match in within]) == pytest.approx(0.0, abs=1e-6)
    assert all(match.covariance[0, 0] > 1.0 for match in within)


def test_without_points_or_map_nothing_is_known(room, field, ranges):
    empty = match_scan(field, np.full((360, 2), np.nan), np.full(360, STD), POSE)
    assert empty.pose == pytest.approx(POSE, abs=1e-12)
    assert (empty.num_points, empty.explained) == (0, 0.0)
    assert np.diagonal(empty.covariance).min() >= UNKNOWN**2


def test_the_gradient_is_that_of_the_robust_cost(room, field, ranges):
    points, t, m = points_of(ranges(room, POSE))[::7].copy(), 0.05, 9.0

    def cost(pose):
        """sum m e^2 / (m + e^2) / 2, whose derivative by e is w e."""
        c, s = np.cos(pose[2]), np.sin(pose[2])
        squared = (field.clearance(pose[:2] + points @ np.array([[c, s], [-s, c]])) / t) ** 2
        return 0.5 * (m * squared / (m + squared)).sum()

    pose = POSE + np.array([-0.013, 0.017, 0.004])
    # Ranges without an error: the variance is the map's, the same everywhere.
    hessian, gradient, _ = normal_equations(points, np.zeros(len(points)), pose, field.grid, t**2, m, np.inf)
    h = 1e-7
    numeric = [(cost(pose + h * axis) - cost(pose - h * axis)) / (2.0 * h) for axis in np.eye(3)]
    assert gradient == pytest.approx(numeric, rel=1e-4, abs=1e-3)
    assert np.array_equal(hessian, hessian.T)
    assert np.linalg.eigvalsh(hessian).min() > 0.0


def test_the_covariance_covers_the_errors(room, field, ranges):
    rng, nees, errors = np.random.default_rng(0), [], []
    for _ in range(150):
        pose = np.array([*rng.uniform([2.8, 0.5], [3.8, 2.5]), rng.uniform(-3.0, 3.0)])
        seen = ranges(room, pose) + STD * rng.standard_normal(360)
        match = match_scan(
            field, points_of(seen), np.full(360, STD), pose + [0.03, 0.03, 0.02] * rng.standard_normal(3)
        )
        error = error_of(match, pose)
        errors.append(error)
        nees.append(error @ np.linalg.solve(match.covariance, error))
    assert 1.0 < np.mean(nees) < 3.3
    assert np.mean(np.array(nees) < chi2.ppf(0.95, 3)) > 0.93
    assert np.sqrt(np.mean(np.square(errors), axis=0)).max() < 5e-3


@pytest.mark.parametrize("name", ["gaussian", "pearson", "bimodal"])
def test_what_the_weights_make_of_a_law_is_what_weighted_means_of_its_draws_do(name):
    law, settings = profile(name)["lidar.range"], MatchSettings(map_std=0.0)
    m, num = settings.scale**2, 100
    draws = (law.sample(np.random.default_rng(0), 400_000) - law.mean) / law.std
    draws = draws.reshape(-1, num)
    mean = np.zeros(len(draws))
    for _ in range(60):  # each row's robust mean, as Gauss-Newton steps find a match
        w = (m / (m + (draws - mean[:, None]) ** 2)) ** 2
        mean = (w * draws).sum(axis=1) / w.sum(axis=1)
    centre, variance = weighted_law(law, settings)
    assert mean.mean() == pytest.approx(centre, abs=0.012)
    assert mean.var() == pytest.approx(variance / w.sum(axis=1).mean(), rel=0.1)


def test_a_symmetric_law_is_centred_at_its_mean_and_one_without_a_spread_is_exact():
    assert weighted_law(make_distribution("gaussian", mean=0.3, std=0.05))[0] == pytest.approx(0.0, abs=1e-9)
    assert weighted_law(profile("none")["lidar.range"]) == (0.0, 1.0)
