from itertools import permutations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from mjnav.estimation.lidar.track_filter import ParticleTrackFilter
from mjnav.estimation.lidar.tracker import assigned, mahalanobis

FALSE = 0.02  # [1/m^2]


def still(*places, std=0.1):
    """Moments of tracks at rest."""
    means = np.array([[x, y, 0.0, 0.0] for x, y in places]).reshape(-1, 4)
    return means, np.tile(np.diag([std**2, std**2, 0.01, 0.01]), (len(places), 1, 1))


def at(*places, std=0.05):
    """Detections of no age."""
    return (
        np.array(places, float).reshape(-1, 2),
        np.tile(std**2 * np.eye(2), (len(places), 1, 1)),
        np.zeros(len(places)),
    )


def log_density(tracks, detections):
    return mahalanobis(*tracks, *detections)[1]


def test_a_detection_is_judged_by_the_density_of_where_the_track_was_when_it_was_made():
    rng = np.random.default_rng(0)
    means, positions, ages = rng.normal(size=(3, 4)), rng.normal(size=(2, 2)), np.array([0.0, 0.15])
    roots, noise = rng.normal(size=(3, 4, 4)), np.array([0.1 * np.eye(2), [[0.2, 0.05], [0.05, 0.1]]])
    covariances = roots @ roots.swapaxes(1, 2)
    squared, density = mahalanobis(means, covariances, positions, noise, ages)
    for i in range(3):
        for j in range(2):
            H = np.hstack([np.eye(2), -ages[j] * np.eye(2)])
            law = multivariate_normal(H @ means[i], H @ covariances[i] @ H.T + noise[j])
            assert density[i, j] == pytest.approx(law.logpdf(positions[j]))
            error = positions[j] - H @ means[i]
            assert squared[i, j] == pytest.approx(error @ np.linalg.solve(law.cov, error))


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


def test_the_nearest_pair_is_given_up_where_the_others_would_lose_more():
    # The detection at 0.2 is nearer to the track at 0.25, but only it is near enough to the one at 0.
    density = log_density(still((0.0, 0.0), (0.25, 0.0)), at((0.2, 0.0), (0.45, 0.0)))
    assert assigned(density, np.array([0.9, 0.9]), FALSE).tolist() == [0, 1]


def test_a_detection_that_is_likelier_to_be_false_belongs_to_nobody():
    tracks = still((0.0, 0.0))
    inside, outside = (log_density(tracks, at((x, 0.0))) for x in (0.4, 0.5))
    assert outside[0, 0] < np.log(FALSE) < inside[0, 0]
    assert assigned(inside, np.array([0.0]), FALSE).tolist() == [0]
    assert assigned(outside, np.array([0.9]), FALSE).tolist() == [-1]


def test_of_two_tracks_in_one_place_the_one_in_view_gets_the_detection():
    density = log_density(still((0.0, 0.0), (0.0, 0.0)), at((0.02, 0.0)))
    assert assigned(density, np.array([0.0, 0.9]), FALSE).tolist() == [-1, 0]
    assert assigned(density, np.array([0.9, 0.0]), FALSE).tolist() == [0, -1]


def test_without_tracks_or_detections_nothing_is_assigned():
    assert assigned(log_density(still(), at((1.0, 1.0))), np.zeros(0), FALSE).shape == (0,)
    assert assigned(log_density(still((1.0, 1.0)), at()), np.array([0.9]), FALSE).tolist() == [-1]


def test_who_turns_on_their_heel_stays_within_reach_of_the_particles_and_not_of_their_gaussian():
    track = ParticleTrackFilter(100, np.random.default_rng(0))
    covariance, ages = 0.03**2 * np.eye(2), np.zeros(1)
    for k in range(20):
        if k:
            track.predict(0.1)
            track.correct(np.array([0.15 * k, 0.0]), covariance, 0.0)
        else:
            track.start(np.zeros(2), covariance)
    track.predict(0.1)
    back = np.array([[0.15 * 18, 0.0]])
    gaussian = mahalanobis(track.mean[None], track.covariance[None], back, covariance[None], ages)[1]
    assert gaussian[0, 0] < np.log(FALSE) - 3.0
    assert track.log_density(back, covariance[None], ages)[0] > gaussian[0, 0] + 3.0
