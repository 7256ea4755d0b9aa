"""Recorded crowds: rows of a file become a recording, tracks, splines and people."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjnav.errors import InvalidValue
from mjnav.scene import dumps, load, loads
from mjnav.scene.crowd import Crowd, TrackSplines, people_of, read_recording, tracks_of
from mjnav.scene.people import PERIOD, Replay

ROWS = [(frame, person, 0.5 * person + 0.05 * frame, -1.25 * person) for person in (3, 1) for frame in range(0, 50, 10)]
PLAIN = "\n".join(f"{frame} {person} {x:.6f} {y:.6f}" for frame, person, x, y in ROWS)
EXPECTED = sorted(((float(f), str(p), x, y) for f, p, x, y in ROWS), key=lambda row: (int(row[1]), row[0]))


@pytest.fixture
def read(tmp_path):
    def read(content):
        path = tmp_path / "tracks.txt"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_recording(path)

    return read


def crowd(**keys):
    return Crowd(**{"file": "recording.txt", "frame_rate": 25.0, **keys})


# ------------------------------------------------------------------------------------------- recordings


def rows_of(recording):
    people = [recording.labels[i] for i in recording.person]
    return list(zip(recording.frame.tolist(), people, *recording.position.T.round(6).tolist(), strict=True))


@settings(max_examples=30)
@given(
    order=st.permutations(range(len(ROWS))),
    separators=st.lists(st.sampled_from([" ", "\t", ", ", ",", ";", "   "]), min_size=len(ROWS), max_size=len(ROWS)),
    number=st.sampled_from(["{:g}", "{:.1f}", "{:.7e}"]),
    end=st.sampled_from(["\n", "\r\n", "\n\n", " \n"]),
)
def test_neither_order_nor_separators_nor_the_way_of_writing_numbers_matter(
    tmp_path_factory, order, separators, number, end
):
    lines = []
    for i in order:
        frame, person, x, y = ROWS[i]
        words = [number.format(frame), number.format(person), f"{x:.6f}", f"{y:.6f}"]
        lines.append(separators[i].join(words))
    path = tmp_path_factory.mktemp("crowd") / "tracks.csv"
    path.write_text(end.join(lines) + end, newline="")
    assert rows_of(read_recording(path)) == EXPECTED


def test_a_header_names_the_columns_in_any_order_and_others_beside_them(read):
    rows = "\n".join(f"{person}\t{frame}\t{x}\t{y}\t1.7" for frame, person, x, y in ROWS)
    found = read(f"# id\tframe\tx/m\ty/m\tz/m\n{rows}")
    assert (found.columns, found.num_skipped) == (("id", "frame", "x", "y", "z"), 1)
    assert rows_of(found) == EXPECTED
    obsmat = "\n".join(f"{f:.7e} {p:.7e} {x:.7e} 9 {y:.7e} 0.5 0 0" for f, p, x, y in ROWS)  # 9: a height
    assert rows_of(read(obsmat)) == EXPECTED


NO_HEADER = "allowed: rows of frame id x y, rows of frame id x z y vx vz vy, or a header line above the rows that names"
BAD_FILES = {
    "a word in a row": (f"{PLAIN}\n50 3 abc 1.0", "line 11: found 'abc'; allowed: a finite number (x)"),
    "another number of columns": ("1 2 3 4 5 6\n", f"line 1: found '6 columns: 1 2 3 4 5 6'; {NO_HEADER}"),
    "binary": (b"\x89PNG\r\n\x1a\n\0\0", "line 1: found b'\\x89'; allowed: text in UTF-8: rows of frame id x y"),
    "a stray frame": (f"{PLAIN}\n1e9 3 0 0", "found 'frames from 0 to 1000000000'; allowed: at most 1000000 usual"),
}


@pytest.mark.parametrize("title", BAD_FILES)
def test_what_is_no_recording_is_refused_with_file_and_line(read, tmp_path, title):
    content, message = BAD_FILES[title]
    with pytest.raises(InvalidValue) as error:
        read(content)
    assert str(error.value).startswith(f"{tmp_path / 'tracks.txt'}: {message}")
    assert "\n" not in str(error.value)


# ----------------------------------------------------------------------------------------------- tracks


def walk(person, frames, y=0.0):
    """At 1 m/s along x, with 10 frames a second."""
    return [(frame, person, 0.1 * frame, y) for frame in frames]


@pytest.fixture
def tracks(read):
    def tracks(rows, **keys):
        return tracks_of(read("\n".join(" ".join(map(str, row)) for row in rows)), crowd(frame_rate=10.0, **keys))

    return tracks


def test_a_jump_makes_two_tracks_and_a_single_row_is_left_out(tracks):
    found = tracks([*walk(1, range(0, 20, 4)), *walk(1, range(20, 40, 4), y=9.0), (0, 2, 5.0, 5.0)])
    assert [len(track.rows) for track in found.tracks] == [5, 5]
    assert (found.num_gaps, found.num_jumps, found.num_single) == (0, 1, 1)


def test_splines_pass_through_every_row_whatever_the_other_tracks_are():
    rng = np.random.default_rng(5)
    tracks = []
    for length in (2, 3, 4, 40):
        time = rng.uniform(-5.0, 50.0) + np.cumsum(rng.uniform(0.05, 1.0, length))
        tracks.append(np.column_stack([time, rng.normal(size=(length, 2))]))
    splines = TrackSplines(tracks)
    for i, track in enumerate(tracks):
        for time, *position in track:
            np.testing.assert_allclose(splines.positions(time)[i], position, atol=1e-9)


def test_a_cubic_is_met_exactly_with_its_mean_velocity_and_people_stand_outside_of_it():
    def cubic(t):
        return np.stack([0.1 * t**3 - t, 2.0 - 0.3 * t**2], axis=-1)

    time = np.linspace(1.0, 4.0, 7)
    splines = TrackSplines([np.column_stack([time, cubic(time)])])
    for t in (1.0, 2.345, 3.9):
        np.testing.assert_allclose(splines.positions(t)[0], cubic(t), atol=1e-12)
        mean = (cubic(t + 0.22) - cubic(t + 0.2)) / 0.02
        np.testing.assert_allclose(splines.velocities(t, 0.02, 0.2)[0], mean, atol=1e-9)
    for t, end in ((-3.0, 1.0), (9.0, 4.0)):
        np.testing.assert_allclose(splines.positions(t)[0], cubic(end))
        assert splines.velocities(t, 0.02)[0].tolist() == [0.0, 0.0]


# ----------------------------------------------------------------------------------------------- people


SCENE = """
schema = 1
name = "recorded"
[robot]
start = [-2.0, -2.0, 0.0]
goal = [14.0, 9.0]
[crowd]
file = "recording.txt"
frame_rate = 25.0
"""


def test_replayed_people_are_at_their_recorded_places_and_come_and_go_with_their_tracks(recording):
    people = people_of(crowd(), recording)
    assert len(people) == 8
    found = read_recording(recording)
    by_start = {tuple(person["start"]): person for person in people}
    for _, rows in found.rows():
        person = by_start[tuple(found.position[rows][0])]
        track = np.array(person["track"])
        np.testing.assert_allclose(track[:, 0], found.frame[rows] / 25.0)
        np.testing.assert_allclose(track[:, 1:], found.position[rows])
        assert (person["behaviour"], person.get("enters", 0.0)) == ("replay", pytest.approx(track[0, 0]))
        assert person["leaves"] == pytest.approx(track[-1, 0])


def test_a_window_counts_from_its_beginning_and_bends_nobodys_track(recording):
    whole = people_of(crowd(), recording)
    part = people_of(crowd(window=(12.3, 14.9)), recording)
    assert 1 < len(part) < len(whole)
    for person in part:
        enters, leaves = person.get("enters", 0.0), person["leaves"]
        assert 0.0 <= enters < leaves <= 2.6 + 1e-9
        assert enters / PERIOD == pytest.approx(round(enters / PERIOD))  # at a decision, when the replay moves on
        track = np.array(person["track"])
        # A track that was cut has rows beyond the window, of which the whole track's spline is known.
        other = next(one for one in whole if track[-1, 1:].tolist() in [row[1:] for row in one["track"]])
        here, there = TrackSplines([track]), TrackSplines([np.array(other["track"])])
        for time in np.arange(enters, leaves, 0.3):
            np.testing.assert_allclose(here.positions(time), there.positions(time + 12.3), atol=1e-3)
        np.testing.assert_allclose(person["start"], here.positions(enters)[0], atol=1e-6)


def test_a_run_file_names_its_recording_from_its_own_folder_and_the_loaded_scene_needs_it_no_more(
    recording, tmp_path, monkeypatch
):
    standing = '[[people]]\nstart = [5.0, -3.0]\nbehaviour = "constant_velocity"\nvelocity = [0.0, 0.0]\n'
    (tmp_path / "scene.toml").write_text(SCENE + standing)
    monkeypatch.chdir("/")
    first, *recorded = load(tmp_path / "scene.toml", {"crowd.radius": 0.2}).people
    assert first.start == (5.0, -3.0)
    assert [type(person.behaviour) for person in recorded] == [Replay] * 8
    assert {person.radius for person in recorded} == {0.2}
    assert not any(person.sees for person in recorded)
    scenario = load(tmp_path / "scene.toml")
    recording.unlink()
    assert "crowd" not in dumps(scenario)
    assert loads(dumps(scenario)) == scenario


BAD_TABLES = {
    "a missing file": (
        'file="x.txt"',
        "crowd.file: found 'x.txt'; allowed: a recording that can be read (No such file",
    ),
    "a window after the end": ("window=[40,50]", "crowd.window: found '0 people with 0 rows from 40 to 50 s'; "),
    "units of a picture": ("scale=100.0", "crowd.frame_rate: found '164 jumps in 246 rows'; "),
}


@pytest.mark.parametrize("title", BAD_TABLES)
def test_what_cannot_be_is_refused_with_its_key(recording, tmp_path, title):
    line, message = BAD_TABLES[title]
    key = line.partition("=")[0]
    kept = [line for line in SCENE.splitlines() if not line.startswith(f"{key} ")]
    (tmp_path / "scene.toml").write_text("\n".join([*kept, line]))
    with pytest.raises(InvalidValue) as error:
        load(tmp_path / "scene.toml")
    assert message in str(error.value)


def test_the_text_of_a_log_opens_no_file(recording):
    with pytest.raises(InvalidValue, match=r"crowd\.file: found 'recording\.txt'; allowed: nothing; only a run file"):
        loads(SCENE)
