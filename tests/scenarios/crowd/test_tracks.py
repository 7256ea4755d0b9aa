"""From rows to tracks: cut where nobody can follow, placed in the scene."""

from math import pi

import numpy as np
import pytest

from mjnav.scenarios.crowd.reader import read_recording
from mjnav.scenarios.crowd.tracks import Placement, tracks_of


@pytest.fixture
def tracks(tmp_path):
    def tracks(rows, placement=Placement(), max_gap=2.0):  # noqa: B008 - frozen
        path = tmp_path / "tracks.txt"
        path.write_text("\n".join(" ".join(map(str, row)) for row in rows))
        return tracks_of(read_recording(path), 10.0, placement, max_gap)

    return tracks


def walk(person, frames, start=0.0, y=0.0):
    """At 1 m/s along x, with 10 frames a second."""
    return [(frame, person, start + 0.1 * frame, y) for frame in frames]


def test_time_counts_from_the_first_frame_of_the_recording(tracks):
    found = tracks([*walk(1, range(700, 740, 4)), *walk(2, range(720, 760, 4))])
    assert [track.rows[0, 0] for track in found.tracks] == [0.0, 2.0]
    for track in found.tracks:
        np.testing.assert_allclose(track.speeds, 1.0)


def test_a_long_gap_makes_two_tracks_and_a_short_one_is_bridged(tracks):
    rows = [*walk(1, range(0, 20, 4)), *walk(1, range(28, 40, 4)), *walk(1, range(80, 100, 4))]
    found = tracks(rows)
    assert [len(track.rows) for track in found.tracks] == [8, 5]
    assert (found.num_gaps, found.num_bridged, found.num_jumps, found.num_single) == (1, 1, 0, 0)
    assert len(tracks(rows, max_gap=5.0).tracks) == 1


def test_a_jump_makes_two_tracks_and_a_single_row_is_left_out(tracks):
    found = tracks([*walk(1, range(0, 20, 4)), *walk(1, range(20, 40, 4), y=9.0), (0, 2, 5.0, 5.0)])
    assert [len(track.rows) for track in found.tracks] == [5, 5]
    assert (found.num_gaps, found.num_jumps, found.num_single) == (0, 1, 1)


def test_who_leaves_the_crop_and_comes_back_is_two_tracks(tracks):
    there_and_back = [(4 * i, 1, min(0.4 * i, 8.0 - 0.4 * i), 0.0) for i in range(21)]
    found = tracks(there_and_back, Placement(crop=((3.0, 1.0), (-1.0, -1.0))))
    assert [(track.rows[:, 1].min(), track.rows[:, 1].max()) for track in found.tracks] == [
        (0.0, pytest.approx(2.8)),
        (pytest.approx(0.0), pytest.approx(2.8)),
    ]


def test_a_placement_scales_mirrors_rotates_and_moves_in_this_order():
    placement = Placement(scale=2.0, mirror=True, rotation=0.5 * pi, offset=(10.0, 20.0))
    np.testing.assert_allclose(placement.placed(np.array([[1.0, 0.0], [0.0, 1.0]])), [[10.0, 22.0], [12.0, 20.0]])
