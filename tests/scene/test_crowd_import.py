"""What a recording holds, in figures whose answers are known; and scenes of real recordings.

ETH's hotel and UCY's zara01 are read where MJNAV_PEOPLE_DATA names their folder (`tests/conftest.py`).
"""

import numpy as np
import pytest

from mjnav.scene import loads
from mjnav.scene.crowd import Crowd, Track, TrackSplines, people_of
from mjnav.scene.crowd_import import choose_window, import_crowd, robot_way, scene_tables, survey
from mjnav.scene.toml import toml_text


def straight(first, last, start, velocity, step=0.5):
    time = np.arange(first, last + 1e-9, step)
    return Track("1", np.column_stack([time, np.array(start) + (time - first)[:, None] * np.array(velocity)]))


def test_people_speeds_overlaps_and_windows_are_counted():
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
    assert (found.pairs, found.overlapping) == (21, (0, 21, 21))
    assert found.closest == pytest.approx(0.45)
    assert [(w.start, w.end, w.people, w.most_at_once) for w in found.windows] == [(0, 10, 2, 2), (10, 20, 1, 1)]
    assert [w.closest_at_start for w in found.windows] == [pytest.approx(0.45)] * 2


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


@pytest.mark.parametrize(
    ("name", "rows", "people", "most"), [("biwi_hotel", 6543, 389, 18), ("crowds_zara01", 5153, 148, 20)]
)
def test_a_recording_is_read_and_every_window_of_it_makes_a_scene(people_data, name, rows, people, most):
    path = people_data / f"{name}.txt"
    found = import_crowd(path, {"frame_rate": 25.0}, 30.0)
    assert (len(found.recording.frame), found.survey.people, found.survey.most_at_once) == (rows, people, most)
    assert (found.tracks.num_gaps, found.tracks.num_jumps, found.tracks.num_single) == (0, 0, 0)
    for window in found.survey.windows[:-1]:
        if window.people:
            tables = scene_tables(found, (window.start, window.end), name, people_data)
            tables["people"] = people_of(Crowd(str(path), 25.0, window=(window.start, window.end)), path)
            del tables["crowd"]
            assert len(loads(toml_text(tables)).people) <= window.people
    first, last = choose_window(found.tracks.tracks, 30.0, None)
    enters, leaves = np.array([track.rows[[0, -1], 0] for track in found.tracks.tracks]).T
    counts = [((enters < t + 30.0) & (leaves > t)).sum() for t in np.arange(0.0, 330.0)]
    assert ((enters < last) & (leaves > first)).sum() >= max(counts)
