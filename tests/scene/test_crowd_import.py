"""What a recording holds, in figures whose answers are known."""

import numpy as np
import pytest

from mjnav.scene.crowd import Track, TrackSplines
from mjnav.scene.crowd_import import choose_window, robot_way, survey


def straight(first, last, start, velocity, step=0.5):
    time = np.arange(first, last + 1e-9, step)
    return Track("1", np.column_stack([time, np.array(start) + (time - first)[:, None] * np.array(velocity)]))


def test_people_speeds_distances_and_windows_are_counted():
    tracks = [
        straight(0.0, 10.0, (0.0, 0.0), (1.0, 0.0)),
        straight(0.0, 10.0, (0.0, 0.45), (1.0, 0.0)),  # beside the first, all the way
        straight(12.0, 20.0, (5.0, 3.0), (0.0, 0.0)),
    ]
    found = survey(tracks, 0.5, 10.0)
    assert (found.people, found.most_at_once, found.duration) == (3, 2, 20.0)
    assert found.area == ((0.0, 0.0), (10.0, 3.0))
    assert found.speeds.median_walking == pytest.approx(1.0)
    assert found.speeds.standing == pytest.approx(16 / 56)
    assert found.closest == pytest.approx(0.45)
    assert [(w.start, w.end, w.people, w.most_at_once) for w in found.windows] == [(0, 10, 2, 2), (10, 20, 1, 1)]
    assert [w.closest_at_start for w in found.windows] == [pytest.approx(0.45)] * 2
    short = survey([straight(0.0, 0.4, (0.0, y), (1.0, 0.0), step=0.4) for y in (0.0, 1.0)], 0.4, 10.0)
    assert [(w.people, w.most_at_once) for w in short.windows] == [(2, 2)]


def test_a_window_is_found_by_its_number_of_people():
    tracks = [straight(float(t), t + 3.0, (0.0, 0.0), (1.0, 0.0)) for t in (0, 10, 11, 12, 30, 40, 41)]
    assert choose_window(tracks, 5.0, None) == (8.0, 13.0)
    assert choose_window(tracks, 5.0, 2) == (7.0, 12.0)
    assert choose_window(tracks, 100.0, 2) == (0.0, 44.0)


def test_the_robot_crosses_the_area_from_a_clear_start_to_a_goal():
    rng = np.random.default_rng(2)
    tracks = [
        straight(rng.uniform(0.0, 4.0), 12.0, (x, rng.uniform(0.0, 8.0)), (v, 0.0))
        for x, v in [(0.0, 1.2)] * 4 + [(14.0, -1.1)] * 4
    ]
    start, goal = map(np.array, robot_way(tracks, 1.0, 11.0))
    assert np.hypot(*(goal - start[:2])) > 6.0
    assert np.arctan2(*(goal - start[:2])[::-1]) == pytest.approx(start[2], abs=1e-3)
    splines = TrackSplines([track.rows for track in tracks])
    for time in np.arange(1.0, 3.0, 0.2):
        there = [track.rows[0, 0] <= time for track in tracks]
        assert np.hypot(*(splines.positions(time) - start[:2]).T)[there].min() > 1.5
