"""The trackers of people whose detections have identity; `test_walk_filter` has the filter of one person."""

import numpy as np

from mjnav.messages import Reading
from mjnav.noise import make_distribution
from mjnav.robot.estimation.tracker import ParticleTracker

SETTLED = 20  # readings after which the start is forgotten
PEOPLE = ((0.0, 0.0, 1.0, 0.0), (3.0, 1.0, 0.0, -1.2), (5.0, 5.0, -0.5, 0.5))


def true_states(ticks, people=PEOPLE):
    """(T, P, 4)"""
    people = np.asarray(people)
    states = np.repeat(people[None], ticks, axis=0)
    states[..., :2] += 0.1 * np.arange(ticks)[:, None, None] * people[:, 2:]
    return states


def readings_of(detections):
    """Readings, ten a second, of people at `detections` (T, P, 2)."""
    for k, places in enumerate(detections):
        yield Reading(0.1 * k, 0.1 * bool(k), np.zeros(2), 0.0, np.zeros(3), places, np.zeros(0))


def errors(noise, believed, seed, ticks=100):
    """Errors (T, P, 4) of means, and squares (T, P) of their distances in the belief's own measure, once settled."""
    drawn = [[noise[f"detection.{c}"].sample(np.random.default_rng([seed, p, a]), ticks) for a, c in enumerate("xy")]
             for p in range(len(PEOPLE))]  # fmt: skip
    truth = true_states(ticks)
    tracker = ParticleTracker(believed, 200, [0.3] * 3, seed)
    rows = [tracker.update(reading) for reading in readings_of(truth[..., :2] + np.array(drawn).transpose(2, 0, 1))]
    error = np.array([[track.mean for track in row] for row in rows]) - truth
    inverse = np.linalg.inv([[track.covariance for track in row] for row in rows])
    return error[SETTLED:], np.einsum("tpi,tpij,tpj->tp", error, inverse, error)[SETTLED:]


def test_settled_tracks_are_consistent_and_velocities_known_to_a_tenth_under_skewed_noise(pearson):
    found = [errors(pearson, pearson, seed) for seed in range(6)]
    velocity = np.concatenate([error[..., 2:] for error, _ in found])
    squares = np.concatenate([square for _, square in found])
    assert np.sqrt(np.mean(velocity**2)) < 0.1
    assert np.mean(squares < 9.488) > 0.9  # the 95 % region of four degrees of freedom


def test_only_the_right_sign_of_the_noise_tells_where_people_are(mirrored, pearson):
    noise = pearson | {"detection.x": make_distribution("pearson", mean=0.0, std=0.12, skew=1.6, kurtosis=7.0)}
    reflected = noise | {"detection.x": mirrored(noise["detection.x"])}
    right, wrong = (
        np.mean([errors(noise, believed, seed)[0][..., 0] ** 2 for seed in range(6)]) for believed in (noise, reflected)
    )
    assert np.sqrt(right) < 0.05
    assert np.sqrt(wrong) > 2.0 * np.sqrt(right)


def test_a_person_carried_away_is_found_and_the_others_are_not_disturbed(drive, pearson):
    readings, _ = drive(pearson, 0, ticks=60, people=PEOPLE)
    alone = ParticleTracker(pearson, 200, [0.3] * 3, 0)
    undisturbed = [alone.update(reading) for reading in readings]
    for reading in readings[40:]:
        reading.detections[1] += [5.0, -4.0]
    tracker = ParticleTracker(pearson, 200, [0.3] * 3, 0)
    tracks = [tracker.update(reading) for reading in readings]
    assert [k for k, row in enumerate(tracks) if row[1].recovered] == [42]
    assert np.abs(tracks[-1][1].mean[:2] - true_states(60)[-1, 1, :2] - [5.0, -4.0]).max() < 0.2
    for row, expected in zip(tracks, undisturbed, strict=True):
        for p in (0, 2):
            assert np.array_equal(row[p].particles, expected[p].particles)
