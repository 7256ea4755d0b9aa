"""Splines through recorded positions."""

import numpy as np
import pytest

from mjnav.scenarios.crowd.tracks import TrackSplines


def test_they_pass_through_every_row_whatever_the_other_tracks_are():
    rng = np.random.default_rng(5)
    tracks = []
    for length in (2, 3, 4, 40):
        time = rng.uniform(-5.0, 50.0) + np.cumsum(rng.uniform(0.05, 1.0, length))
        tracks.append(np.column_stack([time, rng.normal(size=(length, 2))]))
    splines = TrackSplines(tracks)
    for i, track in enumerate(tracks):
        for time, *position in track:
            np.testing.assert_allclose(splines.positions(time)[i], position, atol=1e-9)


def test_a_cubic_is_met_exactly_with_its_mean_velocity():
    def cubic(t):
        return np.stack([0.1 * t**3 - t, 2.0 - 0.3 * t**2], axis=-1)

    time = np.linspace(1.0, 4.0, 7)
    splines = TrackSplines([np.column_stack([time, cubic(time)])])
    for t in (1.0, 2.345, 3.9):
        np.testing.assert_allclose(splines.positions(t)[0], cubic(t), atol=1e-12)
        mean = (cubic(t + 0.22) - cubic(t + 0.2)) / 0.02
        np.testing.assert_allclose(splines.velocities(t, 0.02, 0.2)[0], mean, atol=1e-9)


@pytest.mark.parametrize(("time", "x"), [(-3.0, 0.0), (9.0, 2.0)])
def test_before_its_first_and_after_its_last_row_a_person_stands(time, x):
    splines = TrackSplines([np.array([[0.0, 0.0, 0.0], [2.0, 2.0, 0.0]])])
    assert splines.positions(time)[0].tolist() == [x, 0.0]
    assert splines.velocities(time, 0.02)[0].tolist() == [0.0, 0.0]
