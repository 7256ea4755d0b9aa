"""A table [crowd] becomes people."""

import numpy as np
import pytest

from mjnav.errors import InvalidValue
from mjnav.scenarios import dumps, load, loads
from mjnav.scenarios.crowd.importing import people_of
from mjnav.scenarios.crowd.reader import read_recording
from mjnav.scenarios.crowd.spec import Crowd
from mjnav.scenarios.crowd.tracks import TrackSplines
from mjnav.scenarios.people import PERIOD, Replay

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


def crowd(**keys):
    return Crowd(**{"file": "recording.txt", "frame_rate": 25.0, **keys})


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
    tracks = {tuple(person["track"][-1][1:]): person for person in whole}
    for person in part:
        enters, leaves = person.get("enters", 0.0), person["leaves"]
        assert 0.0 <= enters < leaves <= 2.6 + 1e-9
        assert enters / PERIOD == pytest.approx(round(enters / PERIOD))  # at a decision, when the replay moves on
        track = np.array(person["track"])
        last = track[-1, 1:]
        # A track that was cut has rows beyond the window, of which the whole track's spline is known.
        other = next(one for one in tracks.values() if list(last) in [row[1:] for row in one["track"]])
        here, there = TrackSplines([track]), TrackSplines([np.array(other["track"])])
        for time in np.arange(enters, leaves, 0.3):
            np.testing.assert_allclose(here.positions(time), there.positions(time + 12.3), atol=1e-3)
        np.testing.assert_allclose(person["start"], here.positions(enters)[0], atol=1e-6)


def test_who_reacts_walks_from_the_recorded_start_to_the_recorded_end_at_the_recorded_speed(recording):
    replayed, reacting = people_of(crowd(), recording), people_of(crowd(people="react"), recording)
    stands = [person for person in reacting if person["at_end"] == "stay"]
    assert len(stands) == 1
    assert stands[0]["start"] == [6.0, 4.0]
    for before, after in zip(replayed, reacting, strict=True):
        assert (before["start"], before.get("enters")) == (after["start"], after.get("enters"))
        assert after["behaviour"] == "social_force"
        if after["at_end"] == "leave":
            track = np.array(before["track"])
            way = np.hypot(*np.diff(track[:, 1:], axis=0).T).sum()
            assert after["waypoints"] == [track[-1, 1:].tolist()]
            assert after["speed"] == pytest.approx(way / np.ptp(track[:, 0]), rel=1e-4)


def test_a_run_file_names_its_recording_from_its_own_folder_and_the_loaded_scene_needs_it_no_more(
    recording, tmp_path, monkeypatch
):
    (tmp_path / "scene.toml").write_text(SCENE)
    monkeypatch.chdir("/")
    scenario = load(tmp_path / "scene.toml", {"crowd.radius": 0.2})
    assert [type(person.behaviour) for person in scenario.people] == [Replay] * 8
    assert {person.radius for person in scenario.people} == {0.2}
    assert not any(person.sees for person in scenario.people)
    recording.unlink()
    text = dumps(scenario)
    assert "crowd" not in text
    assert loads(text) == scenario


def test_recorded_people_stand_behind_those_of_the_file(recording, tmp_path):
    own = '[[people]]\nstart = [5.0, -3.0]\nbehaviour = "constant_velocity"\nvelocity = [0.0, 0.0]\n'
    (tmp_path / "scene.toml").write_text(SCENE + own)
    assert [type(person.behaviour).__name__ for person in load(tmp_path / "scene.toml").people][:2] == [
        "ConstantVelocity",
        "Replay",
    ]


BAD = {
    "a missing file": (
        'file="x.txt"',
        "crowd.file: found 'x.txt'; allowed: a recording that can be read (No such file",
    ),
    "a window after the end": (
        "window=[40,50]",
        "crowd.window: found '0 people from 40 to 50 s'; allowed: a window in",
    ),
    "a window of no length": ("window=[5,5]", "crowd.window: found (5.0, 5.0); allowed: [from, to] with from < to"),
    "a flat crop": ("crop=[[0,0],[0,5]]", "crowd.crop.1: found (0.0, 5.0); allowed: the corner opposite to (0.0, 0.0)"),
    "a crop beside everybody": ("crop=[[900,900],[901,901]]", "crowd.crop: found ((900.0, 900.0), "),
    "units of a picture": ("scale=100.0", "crowd.scale: found '1 tracks, "),
    "another unit of time": ("frame_rate=0.1", "crowd.frame_rate: found '0 tracks, "),
    "a misspelt key": ("windw=[0,5]", "crowd.windw: found 'windw'; allowed: columns, crop, file, frame_rate, max_gap,"),
}


@pytest.mark.parametrize("title", BAD)
def test_what_cannot_be_is_refused_with_its_key(recording, tmp_path, title):
    line, message = BAD[title]
    key = line.partition("=")[0]
    kept = [line for line in SCENE.splitlines() if not line.startswith(f"{key} ")]
    (tmp_path / "scene.toml").write_text("\n".join([*kept, line]))
    with pytest.raises(InvalidValue) as error:
        load(tmp_path / "scene.toml")
    assert message in str(error.value)


def test_more_people_than_a_scene_may_have_are_refused_with_their_number(tmp_path):
    rows = [f"{frame} {person} {frame} {person}" for person in range(501) for frame in (0, 1)]
    (tmp_path / "many.txt").write_text("\n".join(rows))
    with pytest.raises(
        InvalidValue, match=r"window: found '501 people with 1002 rows'; allowed: .* at most 500 people"
    ):
        people_of(crowd(frame_rate=1.0), tmp_path / "many.txt")


def test_the_text_of_a_log_opens_no_file(recording):
    with pytest.raises(InvalidValue, match=r"crowd\.file: found 'recording\.txt'; allowed: nothing; only a run file"):
        loads(SCENE)
