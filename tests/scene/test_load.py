"""Bad run files are refused with file, key, what was found, what is allowed and the nearest name."""

import os

import pytest

from mjnav.errors import InvalidValue
from mjnav.scene import dumps, load, loads, names

ROBOT = "start = [0.0, 0.0, 0.0]\ngoal = [9.0, 0.0]\n"
HEAD = 'schema = 1\nname = "bad"\n'
GOOD = HEAD + "[robot]\n" + ROBOT
PERSON = '[[people]]\nstart = [4.0, 2.0]\nbehaviour = "constant_velocity"\n'
WALKER = '[[people]]\nstart = [4.0, 2.0]\nbehaviour = "waypoints"\nwaypoints = [[6.0, 2.0]]\n'


def of_person(*lines):
    return GOOD + PERSON + "\n".join(lines)


SOCIAL = '[[people]]\nstart = [4, 2]\nbehaviour = "social_force"\nwaypoints = [[4, 3]]\n'
BAD = {  # a text, and the message's beginning behind the file
    "a misspelt key": (HEAD + "[robot]\nstart = [0, 0, 0]\ngaol = [9, 0]", "robot.gaol: found 'gaol'; allowed: base, "),
    "another schema": ("schema = 2\nwhatever = 1", "schema: found 2; allowed: 1"),
    "neither goal nor waypoints": (HEAD + "[robot]\nstart = [0, 0, 0]", "robot.goal: found nothing; allowed: goal = "),
    "a least speed above the greatest": (GOOD + "min_speed = 2.0", "robot.min_speed: found 2.0; allowed: a number bel"),
    "a wall of no length": (GOOD + "[[walls]]\nfrom = [1, 2]\nto = [1, 2]", "walls.0.to: found (1.0, 2.0); "),
    "a lane without direction": (GOOD + "[lanes]\nleft = [0, 0, 1]\nright = [0, 1, 1]", "lanes.left: found (0.0, 0.0"),
    "an unknown behaviour": (of_person().replace("t_velocity", "t_velocty"), "people.0.behaviour: found 'constant_vel"),
    "who leaves before they come": (of_person("velocity = [0, 0]", "enters = 5\nleaves = 2"), "people.0.leaves: found"),
    "trips of who stays away": (GOOD + WALKER + 'at_end = "leave"\nclear_of_robot = 1', "people.0.clear_of_robot: fou"),
    "an unknown channel": (GOOD + '[noise.odometry.omga]\ndistribution = "gaussian"', "noise.odometry.omga: found "),
    "a rate between the steps": (GOOD + "[control]\nrate = 30.0", "control.rate: found 30.0; allowed: a rate whose"),
    "nesting without end": (GOOD + "[control]\nclip = " + "[" * 30 + "]" * 30, "control.clip."),
    "not TOML": (HEAD + "[robot]\nstart [0, 0, 0]", "line 4, column 7: found 'start [0, 0, 0]'; allowed: TOML (Expect"),
    "a key twice": (HEAD + 'name = "b"', "line 3, column 11: found 'name = \"b\"'; allowed: TOML (Cannot overwrite"),
}  # fmt: skip


@pytest.mark.parametrize("title", BAD)
def test_a_bad_run_file_is_refused_with_the_message_that_says_what_to_do(title, tmp_path, monkeypatch):
    text, message = BAD[title]
    (tmp_path / "file.toml").write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InvalidValue) as error:
        load("file.toml")
    assert str(error.value).startswith(f"file.toml: {message}")
    assert "\n" not in str(error.value)
    assert error.value.exit_code == 2


def test_a_missing_shipped_scene_is_answered_with_the_nearest_one():
    with pytest.raises(InvalidValue) as error:
        load("hal")
    assert str(error.value) == (
        f"scene: found 'hal'; allowed: {', '.join(names())}; or the path of a run file, .toml; did you mean 'hall'?"
    )


def test_a_missing_path_is_answered_with_the_nearest_file_or_scene(tmp_path):
    (tmp_path / "corridor.toml").write_text(GOOD)
    for path, nearest in (tmp_path / "coridor.toml", tmp_path), ("hal.toml", "hall'"):
        with pytest.raises(InvalidValue, match=rf"found nothing; allowed: a run file .*did you mean '{nearest}"):
            load(path)


@pytest.mark.parametrize("path", ["a\0b/", "/", "/dev/null/x.toml", "x" * 1000 + ".toml"])
def test_a_path_that_cannot_be_read_is_refused(path):
    with pytest.raises(InvalidValue, match="allowed: a run file that can be read"):
        load(path)


def test_a_pipe_that_nobody_writes_to_is_no_run_file_and_no_trace(tmp_path):
    os.mkfifo(pipe := tmp_path / "pipe.toml")
    for path, overrides in ((pipe, []), ("crossing1", ["control.latency.trace=" + str(pipe)])):
        with pytest.raises(InvalidValue, match=r"can be read \(not a regular file\)"):
            load(path, ["control.latency.model=sampled", *overrides])


def test_text_in_another_encoding_is_refused_with_its_line(tmp_path):
    path = tmp_path / "latin1.toml"
    path.write_bytes(HEAD.encode() + 'description = "caf\xe9"\n'.encode("latin-1"))
    with pytest.raises(InvalidValue, match=r"line 3: found b'\\xe9'; allowed: text in UTF-8"):
        load(path)


@pytest.mark.parametrize("name", names())
def test_every_shipped_scene_survives_the_round_trip(name):
    scenario = load(name)
    text = dumps(scenario)
    assert loads(text) == scenario
    assert dumps(loads(text)) == text


def test_every_default_is_explicit_in_a_dump():
    text = dumps(loads(GOOD))
    assert text.startswith('schema = 1\nname = "bad"\n')
    for line in ("seed = 0", "goal_tolerance = 0.3", 'profile = "pearson"', "delay = 1", "people = []"):
        assert f"\n{line}\n" in text
    assert "waypoints" not in text  # the robot has a goal
