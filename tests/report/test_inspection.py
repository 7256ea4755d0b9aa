"""What `inspect` says of real runs and made-up logs, whole, cut off and foreign; of beliefs and people."""

import json

import numpy as np
import pytest
from mcap.writer import Writer

import mjnav
from mjnav.log import Recorder, open_log
from mjnav.loop.prepare import load_scenario
from mjnav.metrics.summary import summarise
from mjnav.report.inspection import ShownPerson, judged_beliefs, people_lines
from mjnav.report.inspection import inspect as inspected
from mjnav.scene import dumps
from tests.log.conftest import MadeUpRun, make_scenario

KEYS = """
    schema complete truncated duration_s outcome topics run result recovered path bytes damage missing ticks people
    figures beliefs timing moments
"""


def inspect(path) -> dict:
    """What `mjnav inspect --json` prints."""
    return inspected(path).document()


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Real runs by name: (what the run said, the log's path)."""
    folder = tmp_path_factory.mktemp("runs")
    lanes = ("lanes.left=[0.0, 1.0, -0.3]", "lanes.right=[0.0, 1.0, 0.3]")
    asked = {
        "short": ("crossing1", ("time_limit=2.5",), None),
        "hit": ("crossing1", ("stop_on_collision=false", "time_limit=12", *lanes), "dwa"),
        "lidar": ("crossing1", ("time_limit=3", "physics.engine=kinematic", "estimation.obstacles.source=lidar"), None),
        "slow sensors": ("hall", ("time_limit=2", "sensors.rate=5"), "saa"),
    }
    found = {}
    for name, (scene, overrides, controller) in asked.items():
        path = folder / f"{name}.mcap"
        scenario = load_scenario(scene, overrides, controller=controller, seed=1)
        found[name] = mjnav.run(scenario, log=path), path
    return found


def same(a, b):
    """Equal, numbers to 1e-9."""
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    return a == (pytest.approx(b, abs=1e-9) if isinstance(b, float) else b)


@pytest.mark.parametrize("name", ["short", "hit", "lidar", "slow sensors"])
def test_figures_from_the_messages_are_the_results(runs, name):
    result, path = runs[name]
    found = inspect(path)
    assert list(found) == KEYS.split()
    json.dumps(found, allow_nan=False)
    assert (found["complete"], found["truncated"], found["damage"], found["missing"]) == (True, False, None, [])
    for key, value in found["figures"].items():
        assert same(value, result.summary[key]), key
    for key in ("compute_ms", "deadline_misses", "real_time_factor"):
        assert same(found["timing"][key], result.summary[key]), key
    assert found["ticks"] == {"whole": result.summary["ticks"], "missing": 0, "ranges": []}
    assert found["bytes"] == path.stat().st_size


def test_a_run_that_was_killed_has_the_figures_of_its_whole_ticks(runs, tmp_path):
    result, path = runs["hit"]
    content = path.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(content[: int(0.7 * len(content))])
    found = inspect(tmp_path / "cut.mcap")
    assert (found["complete"], found["truncated"], found["damage"], found["outcome"]) == (False, True, None, None)
    assert found["missing"][:2] == [
        "no footer: the writer was killed, or the file was not copied whole",
        "no mjnav/result: the run did not end",
    ]
    figures, ticks = found["figures"], found["ticks"]["whole"]
    assert (figures["outcome"], figures["success"], figures["ticks"]) == (None, None, ticks)
    assert 10 < ticks < result.summary["ticks"]
    path_so_far = np.hypot(*np.diff(result.trajectory.robot_pose[: ticks + 1, :2], axis=0).T).sum()
    assert figures["path_length_m"] == pytest.approx(path_so_far, abs=1e-9)
    assert found["timing"]["real_time_factor"] is None
    assert found["timing"]["work_factor"] > 1.0
    assert found["moments"]


def record(path, *, ticks, dropped=(), result=True):
    """A made-up run whose log dropped some ticks, all but their timing, as a log that cannot keep up does."""
    run = MadeUpRun(num_people=1, num_candidates=5)
    with Recorder(path, make_scenario(1), {"scene": "made-up"}, "<mujoco/>") as recorder:
        for tick in range(ticks):
            record = run.record(tick)
            if tick in dropped:
                recorder._last = tick, round(1e9 * record.truth.time)
            else:
                recorder.write(record)
            recorder.write_timing(run.timing(tick))
            recorder._writer.flush()
        if result:
            recorder.finish(run.truth(ticks), {"outcome": "goal", "ticks": ticks})


def test_dropped_ticks_are_counted_and_told_by_their_numbers(tmp_path):
    record(tmp_path / "a.mcap", ticks=12, dropped=(3, 8, 9, 11))
    found = inspect(tmp_path / "a.mcap")
    assert found["damage"] is None
    assert found["ticks"] == {"whole": 8, "missing": 4, "ranges": [(3, 3), (8, 9), (11, 11)]}
    assert found["missing"] == ["4 ticks: 3, 8 to 9, 11"]
    assert found["topics"]["/command"]["missing"] == 4
    assert (found["topics"]["/command"]["max_gap_s"], found["topics"]["/command"]["max_gap_at_s"]) == (
        pytest.approx(0.3),
        pytest.approx(0.7),
    )
    assert found["topics"]["/tick"]["missing"] == 0
    assert found["topics"]["/scan"]["missing"] is None
    assert len(open_log(tmp_path / "a.mcap").trajectory().status) == 2  # every row one period after the one before
    assert found["timing"]["ticks"] == 12


def test_another_programs_log_has_a_table_of_topics_and_nothing_else(tmp_path):
    path = tmp_path / "ros.mcap"
    with open(path, "wb") as file:
        writer = Writer(file)
        writer.start("ros2", "rosbag2")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        chatter = writer.register_channel("/chatter", "cdr", schema)
        twin = writer.register_channel("/chatter", "cdr", schema)
        command = writer.register_channel("/command", "json", 0)  # a topic of mjnav's by name
        start = 1_700_000_000_000_000_000
        for i in range(5):
            writer.add_message(chatter, start + i * 500_000_000, b"hello", 0)
            writer.add_message(command, start + i * i * 500_000_000, b'{"x": 1}' if i else b"not json", 0, 7 * i)
        writer.add_message(twin, start + 4_000_000_000, b"hi", 0)
        writer.finish()
    found = inspect(path)
    assert (found["run"], found["figures"], found["timing"], found["ticks"], found["moments"]) == (None,) * 4 + ([],)
    assert found["topics"]["/chatter"] == {
        "schema": "std_msgs/msg/String",
        "messages": 6,
        "hz": 1.25,
        "max_gap_s": 2.0,
        "max_gap_at_s": 2.0,
        "missing": None,
        "bytes": 27,
        "share": 27 / (27 + 40),
    }
    assert found["topics"]["/command"]["missing"] is None
    assert "no mjnav/run: another program wrote this, or its beginning is lost" in found["missing"]


def test_a_log_whose_scenario_is_not_that_of_its_messages_has_no_figures(tmp_path):
    path = tmp_path / "a.mcap"
    run = MadeUpRun(num_people=2, num_candidates=5)
    with Recorder(path, make_scenario(2), {}, "<mujoco/>") as recorder:
        recorder._attachments = (("scenario.toml", "application/toml", dumps(make_scenario(1)).encode()),)
        recorder.write(run.record(0))
        recorder.finish(run.truth(1), {"outcome": "goal"})
    found = inspect(path)
    assert (found["figures"], found["moments"]) == (None, [])
    assert found["missing"] == ["figures: its scenario has 1 people, its messages 2"]
    assert found["topics"]["/command"]["messages"] == 1


def test_the_figures_of_the_run_are_those_of_its_bodies():
    keys = [
        "physics.engine=kinematic",
        "time_limit=3",
        "estimation.robot.filter=ekf",
        "estimation.obstacles.source=direct",
    ]
    scenario = load_scenario("crossing3", keys, seed=2)
    trajectory = mjnav.run(scenario, log=False).trajectory
    figures = summarise(trajectory, scenario, outcome="timeout")
    robot, *people = judged_beliefs(trajectory, scenario)
    assert [(one["body"], one["by"]) for one in (robot, *people)] == [
        ("robot", "pose, ekf"),
        *((f"person{i}", "direct") for i in range(3)),
    ]
    assert (robot["nees"], robot["coverage"], robot["rmse_m"]) == (
        figures["robot_nees"],
        figures["robot_coverage"],
        figures["localization_rmse_m"],
    )
    assert sum(one["ticks"] for one in people) == 3 * len(trajectory.status)
    assert figures["people_nees"] == pytest.approx(np.mean([one["nees"] or 0.0 for one in people]))
    assert figures["people_coverage"] == pytest.approx(np.mean([one["coverage"] or 0.0 for one in people]))
    assert figures["tracking_rmse_m"] == pytest.approx(
        np.sqrt(np.mean([(one["rmse_m"] or 0.0) ** 2 for one in people]))
    )
    assert figures["ess_min"] == {"robot": robot["ess_min"], "people": min(one["ess_min"] for one in people)}


def test_people_who_are_alike_share_a_line():
    blind, scared = (
        ShownPerson("waypoints", "regular", False, 0.0, None),
        ShownPerson("orca", "scared", True, 2.0, 7.0),
    )
    assert list(people_lines([blind, scared, scared, scared, blind])) == [
        "0, 4: waypoints, takes no account of the robot",
        "1, 2, 3: orca, scared, sees the robot",
    ]
