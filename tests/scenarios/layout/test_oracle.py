"""Which starts a robot that knows all could survive: cases that are decided by hand."""

import json

import pytest

import mjnav
from mjnav.cli.main import main
from mjnav.scenarios import loads
from mjnav.scenarios.layout.placing import is_avoidable

HEAD = 'schema = 1\nname = "start"\n[robot]\nstart = [0, 0, 0]\ngoal = [9, 0]\n'
LANE = "".join(f"[[walls]]\nfrom = [-3, {y}]\nto = [9, {y}]\n" for y in (-0.4, 0.4))  # too narrow for two


def person(x, y, vx, vy):
    return f'[[people]]\nstart = [{x}, {y}]\nbehaviour = "constant_velocity"\nvelocity = [{vx}, {vy}]\nradius = 0.2\n'


@pytest.mark.parametrize(
    ("scene", "avoidable"),
    [
        (LANE + person(2, 0, -1.2, 0), False),  # nobody passes, and the robot does not reverse
        (LANE + person(2, 0, 1.2, 0), True),  # who walks away
        (LANE + person(8, 0, -1.2, 0), True),  # who is too far to come in 3 s
        (person(0.8, 0, -1.5, 0), False),  # 0.4 m before contact at 1.5 m/s: 0.25 s, in which 1 m/s² moves 3 cm
        (person(3.5, 0, -1.2, 0), True),  # in the open there is time to step aside
        (person(0.6, 0, 0, 0), True),  # who stands beside a robot that may stand
    ],
)
def test_a_start_is_avoidable_where_some_control_touches_nothing(scene, avoidable):
    assert is_avoidable(loads(HEAD + scene)) is avoidable


def test_people_count_from_when_they_enter_until_they_leave():
    blocked = LANE + person(2, 0, -1.2, 0)
    assert not is_avoidable(loads(HEAD + blocked))
    for keys in ("enters = 3.5", "leaves = 0.5", "enters = 2.5"):  # the last of them is still 1.4 m off at 3 s
        assert is_avoidable(loads(HEAD + blocked + keys)), keys
    assert not is_avoidable(loads(HEAD + blocked + "enters = 0.5"))


def test_who_enters_where_the_robot_stands_waits():
    assert is_avoidable(loads(HEAD + LANE + person(0, 0, 0, 0) + "enters = 0.5"))


@pytest.mark.parametrize(
    ("walk", "avoidable"),
    [
        ('behaviour = "replay"\ntrack = [[0, 2, 0], [1, 0.8, 0], [2, 0, 0], [3, -1, 0]]', False),
        ('behaviour = "replay"\ntrack = [[0, 2, 0], [1, 1.2, 0], [2, 2, 0]]', True),  # turns round in time
        ('behaviour = "waypoints"\nspeed = 1.2\nwaypoints = [[-2, 0]]', False),
        ('behaviour = "waypoints"\nspeed = 1.2\nwaypoints = [[1.2, 0], [8, 0]]', True),
        ('behaviour = "waypoints"\nspeed = 1.2\nwaypoints = [[1, 0]]\nat_end = "leave"', True),
        ('behaviour = "stop_and_go"\nvelocity = [-1.2, 0]\ngo_time = 0.5\nstop_time = 9', True),
        ('behaviour = "stop_and_go"\nvelocity = [-1.2, 0]\ngo_time = 2.5\nstop_time = 9', False),
    ],
)
def test_the_oracle_knows_tracks_turns_ends_and_pauses(walk, avoidable):
    scene = HEAD + LANE + f"[[people]]\nstart = [2, 0]\nradius = 0.2\n{walk}\n"
    assert is_avoidable(loads(scene)) is avoidable


def test_a_run_says_whether_its_start_could_be_avoided(tmp_path, capsys):
    file, log = tmp_path / "start.toml", tmp_path / "start.mcap"
    file.write_text(HEAD + person(0.8, 0, -1.5, 0) + "[physics]\nengine = 'kinematic'\n")
    assert main(["run", str(file), "--json", "--log", str(log), "--set", "time_limit=1"]) == 0
    told = capsys.readouterr()
    assert json.loads(told.out)["avoidable_start"] is False
    assert told.err.count("no control of the robot avoids contact in the first 3 s") == 1
    events = [message.value.name for message in mjnav.open_log(log).messages("/events")]
    assert events.count("start") == 1
