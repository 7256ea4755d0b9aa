from itertools import permutations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from mjnav.estimation.lidar.association import GATE, Predicted, assigned, predicted

FALSE = 0.02


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


def test_a_detection_is_judged_by_the_density_of_where_the_track_was_when_it_was_made():
    rng = np.random.default_rng(0)
    means, positions, ages = rng.normal(size=(3, 4)), rng.normal(size=(2, 2)), np.array([0.0, 0.15])
    roots, noise = rng.normal(size=(3, 4, 4)), np.array([0.1 * np.eye(2), [[0.2, 0.05], [0.05, 0.1]]])
    covariances = roots @ roots.swapaxes(1, 2)
    found = predicted(means, covariances, positions, noise, ages)
    for i in range(3):
        for j in range(2):
            H = np.hstack([np.eye(2), -ages[j] * np.eye(2)])
            law = multivariate_normal(H @ means[i], H @ covariances[i] @ H.T + noise[j])
            assert found.log_density[i, j] == pytest.approx(law.logpdf(positions[j]))
            error = positions[j] - H @ means[i]
            assert found.squared[i, j] == pytest.approx(error @ np.linalg.solve(law.cov, error))


def test_the_assignment_is_the_most_likely_of_all():
    rng = np.random.default_rng(1)
    for _ in range(30):
        num_tracks, num = rng.integers(1, 4), rng.integers(1, 4)
        found = Predicted(rng.uniform(0.0, 12.0, (num_tracks, num)), rng.normal(size=(num_tracks, num)))
        detectable = rng.uniform(0.0, 0.95, num_tracks)

        def likelihood(columns, found=found, detectable=detectable):
            total = 0.0
            for i, j in enumerate(columns):
                if j < 0:
                    total += np.log1p(-detectable[i])
                elif found.squared[i, j] > GATE:
                    return -np.inf
                else:
                    total += -np.log(FALSE) + found.log_density[i, j]
            return total

        options = permutations([*range(num)] + [-1] * num_tracks, int(num_tracks))
        best = max(likelihood(columns) for columns in options)
        assert likelihood(assigned(found, detectable, FALSE)) == pytest.approx(best)


def test_the_nearest_pair_is_given_up_where_the_others_would_lose_more():
    # The detection at 0.2 is nearer to the track at 0.25, but only it is near enough to the one at 0.
    found = predicted(*still((0.0, 0.0), (0.25, 0.0)), *at((0.2, 0.0), (0.45, 0.0)))
    assert assigned(found, np.array([0.9, 0.9]), FALSE).tolist() == [0, 1]


def test_a_detection_beyond_the_gate_belongs_to_nobody():
    found = predicted(*still((0.0, 0.0)), *at((0.5, 0.0)))
    assert found.squared[0, 0] > GATE
    assert assigned(found, np.array([0.9]), FALSE).tolist() == [-1]


def test_of_two_tracks_in_one_place_the_one_in_view_gets_the_detection():
    found = predicted(*still((0.0, 0.0), (0.0, 0.0)), *at((0.02, 0.0)))
    assert assigned(found, np.array([0.0, 0.9]), FALSE).tolist() == [-1, 0]
    assert assigned(found, np.array([0.9, 0.0]), FALSE).tolist() == [0, -1]


def test_without_tracks_or_detections_nothing_is_assigned():
    assert assigned(predicted(*still(), *at((1.0, 1.0))), np.zeros(0), FALSE).shape == (0,)
    assert assigned(predicted(*still((1.0, 1.0)), *at()), np.array([0.9]), FALSE).tolist() == [-1]
