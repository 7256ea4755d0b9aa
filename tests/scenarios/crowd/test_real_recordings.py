"""ETH's hotel and UCY's zara01, where MJNAV_PEOPLE_DATA names their folder (`tests/conftest.py`)."""

import numpy as np
import pytest

from mjnav.scenarios import loads
from mjnav.scenarios.crowd.importing import choose_window, import_crowd, people_of, scene_tables
from mjnav.scenarios.crowd.spec import Crowd
from mjnav.scenarios.toml import toml_text


@pytest.mark.parametrize(
    ("name", "rows", "people", "most"), [("biwi_hotel", 6543, 389, 18), ("crowds_zara01", 5153, 148, 20)]
)
def test_a_recording_is_read_and_every_window_of_it_makes_a_scene(people_data, name, rows, people, most):
    path = people_data / f"{name}.txt"
    found = import_crowd(path, {}, 30.0)
    assert (len(found.recording.frame), found.survey.people, found.survey.most_at_once) == (rows, people, most)
    assert (found.rate.frame_rate, found.rate.sure, found.step) == (25.0, True, 10.0)
    assert (found.tracks.num_gaps, found.tracks.num_jumps, found.tracks.num_single) == (0, 0, 0)
    for window in found.survey.windows[:-1]:
        if window.people:
            tables = scene_tables(found, (window.start, window.end), name, people_data)
            tables["people"] = people_of(Crowd(str(path), 25.0, window=(window.start, window.end)), path)
            del tables["crowd"]
            assert len(loads(toml_text(tables)).people) <= window.people


def test_the_busiest_window_is_found(people_data):
    tracks = import_crowd(people_data / "crowds_zara01.txt", {}, 30.0).tracks.tracks
    first, last = choose_window(tracks, 30.0, None)
    enters, leaves = np.array([track.rows[[0, -1], 0] for track in tracks]).T
    counts = [((enters < t + 30.0) & (leaves > t)).sum() for t in np.arange(0.0, 330.0)]
    assert ((enters < last) & (leaves > first)).sum() == max(counts)
