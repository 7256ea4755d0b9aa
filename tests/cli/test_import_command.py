"""`mjnav import crowd`."""

import json
from pathlib import Path

import pytest

from mjnav.scene import load
from mjnav.scene.people import Replay
from tests.scene.conftest import made_up


@pytest.fixture
def recording(tmp_path):
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "walkers.txt").write_text(made_up())
    return Path("data/walkers.txt")


RATE = ("--frame-rate", 25)


def test_it_says_what_a_recording_holds(mjnav, recording):
    said = mjnav("import", "crowd", recording, *RATE)
    assert (said.code, said.err) == (0, "")
    lines = [line.split(maxsplit=1) for line in said.out.splitlines() if line]
    assert ["columns", "frame id x y; 0 lines of comments or headers"] in lines
    assert "  duration     29.6 s at 25 frames a second; a step is 0.4 s" in said.out
    assert said.out.splitlines()[-1].split() == ["0", "to", "29.6", "s", "8", "6", "6.36", "m"]
    found = json.loads(mjnav("import", "crowd", recording, *RATE, "--json", "--duration", 10).out)
    assert (found["people"], found["tracks"], found["frame_rate_hz"], found["jumps"]) == (8, 8, 25.0, 0)
    assert [window["people"] for window in found["windows"]] == [5, 8, 2]
    assert found["wrote"] is None


def test_it_writes_a_run_file_that_runs_and_whose_log_needs_no_recording(mjnav, recording, tmp_path):
    said = mjnav("import", "crowd", recording, *RATE, "-o", "scene.toml", "--duration", 8, "--people", 4)
    assert (said.code, said.err) == (0, "")
    scenario = load(tmp_path / "scene.toml")
    assert (len(scenario.people), scenario.time_limit) == (4, 8.0)
    assert all(isinstance(person.behaviour, Replay) for person in scenario.people)
    quick = ("--set", "physics.engine=kinematic", "--set", "time_limit=2", "--json")
    assert mjnav("run", "scene.toml", "--log", "a.mcap", *quick).code == 0
    (tmp_path / recording).unlink()
    (tmp_path / "scene.toml").unlink()
    assert json.loads(mjnav("replay", "a.mcap", "--json").out)["identical"]


def test_a_run_file_has_what_the_options_say_and_replaces_nothing(mjnav, recording, tmp_path):
    words = ("import", "crowd", recording, *RATE, "-o", "scene.toml", "--window", 3, 9, "--crop", 2, -1, 10, 9)
    said = mjnav(*words, "--react", "--set", "crowd.radius=0.2", "--set", "robot.max_speed=1.75", "--json")
    wrote = json.loads(said.out)["wrote"]
    assert (wrote["window_s"], wrote["behaviour"]) == ([3.0, 9.0], "react")
    scenario = load(tmp_path / "scene.toml")
    assert scenario.robot.max_speed == 1.75
    assert {person.radius for person in scenario.people} == {0.2}
    assert all(2.0 <= person.start[0] <= 10.0 for person in scenario.people)
    assert mjnav(*words).err == "mjnav: scene.toml: exists already; choose another name\n"


UNIX = [(1.7e9 + 0.4 * i, 1, 0.4 * i) for i in range(20)]  # frame, id and x
NEVER_ENDING = {
    "a stray row": (
        [*UNIX[:10], (0.0, 1, 4.0), *UNIX[10:]],
        ("--frame-rate", 1),
        "a.txt: found 'frames from 0 to 1700000007.6'; allowed: at most 1000000 usual steps (0.4) from the first frame",
    ),
    "frames without a time between them": (
        [(1e-8 * i, 1, 0.0) for i in range(5)],
        ("--frame-rate", 1e-7, "--set", "crowd.max_gap=1e6"),
        "a.txt: found '1 rows of 1 people, 4 repeated'; allowed: people in two rows or more",
    ),
    "frames of a week": (
        [(i, 1, 0.0) for i in range(5)],
        ("--frame-rate", 1e-6),
        "--frame-rate: found 1e-06; allowed: a rate at which the recording lasts at most 1e+06 s, not 4e+06 s",
    ),
    "windows of a second": (
        [(i, 1, 0.0) for i in range(5)],
        ("--frame-rate", 1e-5, "--duration", 1, "--set", "crowd.max_gap=1e6"),
        "--duration: found 1.0; allowed: at least 8 s: at most 50000 windows of the 4e+05 s",
    ),
    "gaps of many": (
        [*UNIX, *((1.7e9 + 9e4 * i, person, i) for person in range(2, 9) for i in (0, 1))],
        ("--frame-rate", 1, "--set", "crowd.max_gap=1e6"),
        "--set: crowd.max_gap: found 1000000.0; allowed: a time that bridges gaps of at most 1000000 missing rows in",
    ),
}


@pytest.mark.parametrize("title", NEVER_ENDING)
def test_a_recording_that_hardly_ends_is_refused_in_one_line(mjnav, tmp_path, title):
    rows, words, line = NEVER_ENDING[title]
    text = "".join(f"{frame!r} {person} {x} 0.0\n" for frame, person, x in rows)
    (tmp_path / "a.txt").write_text(text)
    said = mjnav("import", "crowd", "a.txt", *words)
    assert (said.code, said.err.count("\n")) == (2, 1)
    assert said.err.startswith(f"mjnav: {line}")


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("nowhere.txt", *RATE), "nowhere.txt: found nothing; allowed: a recording that can be read (No such file"),
        (("data", *RATE), "data: found nothing; allowed: a recording that can be read (Is a directory)"),
        (("data/walkers.txt",), "--frame-rate: found nothing; allowed: what the column of frames counts a second: 25"),
        (("data/walkers.txt", "--people", 3), "--people needs -o FILE.toml"),
        (("data/walkers.txt", "--duration", 0), "--duration: found 0.0; allowed: a number from 1 to 1e+06 s"),
        (("data/walkers.txt", "--frame-rate", 0), "--frame-rate: found 0.0; allowed: a number > 0 and <= 1000000 Hz"),
        (
            ("data/walkers.txt", *RATE, "--crop", 0, 0, 0, 1),
            "--crop: found (0.0, 1.0); allowed: the corner opposite to",
        ),
        (("data/walkers.txt", *RATE, "--set", "crowd.scal=2"), "--set: crowd.scal: found 'scal'; allowed: crop, "),
        (
            ("data/walkers.txt", "-o", "a.toml", *RATE, "--window", 90, 99),
            "--window: found (90.0, 99.0); allowed: a window in",
        ),
        (
            ("data/walkers.txt", "-o", "a.toml", *RATE, "--set", "robot.radus=1"),
            "a.toml: robot.radus: found 'radus'; allowed",
        ),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_line(mjnav, recording, tmp_path, words, line):
    said = mjnav("import", "crowd", *words)
    assert said.code == 2
    assert said.err.startswith(f"mjnav: {line}")
    assert said.err.count("\n") == 1
    assert not (tmp_path / "a.toml").exists()
