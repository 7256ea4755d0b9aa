"""`mjnav import crowd`."""

import json
from pathlib import Path

import pytest

from mjnav.scene import load, loads
from mjnav.scene.people import Replay, SocialForce
from mjnav.study.bench import Bench
from mjnav.study.cells import resolve
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
    assert ["columns", "frame id x y"] in lines
    assert ["duration_s", "29.6"] in lines
    assert said.out.splitlines()[-1].split() == ["0", "to", "29.6", "s", "8", "6", "6.359"]
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
    keys = ("window=[3.0,9.0]", "crop=[[2.0,-1.0],[10.0,9.0]]", "people=react", "radius=0.2")
    words = ("import", "crowd", recording, *RATE, "-o", "scene.toml", "--set", "robot.max_speed=1.75")
    words += tuple(word for key in keys for word in ("--set", f"crowd.{key}"))
    wrote = json.loads(mjnav(*words, "--json").out)["wrote"]
    assert (wrote["window_s"], wrote["behaviour"]) == ([3.0, 9.0], "react")
    scenario = load(tmp_path / "scene.toml")
    assert scenario.robot.max_speed == 1.75
    assert {person.radius for person in scenario.people} == {0.2}
    assert all(2.0 <= person.start[0] <= 10.0 for person in scenario.people)
    assert mjnav(*words).err == "mjnav: scene.toml: exists already; choose another name\n"


UNIX = [(1.7e9 + 0.4 * i, 1, 0.4 * i) for i in range(20)]  # frame, id and x
NEVER_ENDING = {
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


def test_a_suite_of_all_windows_is_one_that_the_bench_takes(mjnav, recording, tmp_path):
    words = ("import", "crowd", recording, *RATE, "--duration", 8, "--suite")
    said = mjnav(*words, "walkers.toml", "--set", "control.rate=5.0")
    assert said.code == 0, said.err
    assert said.out.splitlines()[-2:] == ["file        walkers.toml", "windows     3"]
    parts = [f"walkers-{start}" for start in (0, 8, 16)]
    assert {path.stem for path in tmp_path.glob("*.toml")} == {*parts, "walkers"}
    bench = Bench.load("walkers.toml")
    assert bench.methods == Bench.load().methods
    assert [suite.name for suite in bench.suites] == ["walkers replay", "walkers react"]
    for suite, people in zip(bench.suites, (Replay, SocialForce), strict=True):
        cells = resolve(suite.study(bench.methods[:1]))
        assert [cell.scene for cell in cells] == parts
        assert {type(person.behaviour) for cell in cells for person in loads(cell.document).people} == {people}
    assert {load(tmp_path / f"{part}.toml").control.rate for part in parts} == {5.0}
    (tmp_path / "walkers.toml").unlink()
    for given, line in (
        (("walkers.toml",), "walkers-0.toml: exists already; choose another name"),
        (("other.toml", "--duration", 40), "--duration: found 40.0; allowed: at most the recording's 29.6 s"),
        (("other.toml", "--set", "robot.start=[0,0]"), "other-0.toml: robot.start: found"),
        (("other.toml", "--set", "crowd.people=react"), "--suite has every window, with people who are replayed"),
    ):
        again = mjnav(*words, *given)
        assert (again.code, again.err.count("\n")) == (2, 1)
        assert again.err.startswith(f"mjnav: {line}")
    assert not list(tmp_path.glob("other*"))
