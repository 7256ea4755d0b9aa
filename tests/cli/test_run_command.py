"""`mjnav run`, `--live` too: what it prints, what it writes and what it refuses."""

import json
import re
import socket
from pathlib import Path

import pytest

from mjnav.log import open_log

pytestmark = pytest.mark.xdist_group("real time")

SHORT = ("--set", "time_limit=0.3")
FIGURES = """
    schema scene controller seed outcome success timeout collisions collisions_moving collisions_at_rest
    robot_at_fault people_see_robot layout avoidable_start lane_violation_s time_s aggregated_time_s
    failures_to_progress path_length_m straight_line_m path_ratio spl mean_deviation_m max_deviation_m control_cost
    min_clearance_m min_obstacle_clearance_m mean_obstacle_clearance_m min_human_distance_m mean_human_distance_m
    space_compliance intimate_space_share personal_space_share social_space_share min_time_to_collision_s
    social_force_on_people_m_s social_force_on_robot_m_s social_work_m_s min_speed_m_s mean_speed_m_s max_speed_m_s
    min_acceleration_m_s2 mean_acceleration_m_s2 max_acceleration_m_s2 min_jerk_m_s3 mean_jerk_m_s3 max_jerk_m_s3
    stalled_s not_moving_s heading_change_rad ticks infeasible_ticks clipped_ticks cautious_ticks compute_ms
    real_time_factor deadline_misses
    localization_rmse_m tracking_rmse_m seen_tracking_rmse_m gospa_m gospa_localization_m gospa_missed_m gospa_false_m
    identity_switches track_fragmentations false_tracks tracked_share first_track_delay_s robot_nees people_nees
    robot_coverage people_coverage robot_divergences people_divergences ess_min ess_mean robot_depleted_share
    people_depleted_share recoveries kidnappings kidnappings_recovered kidnap_recovery_s state_hash log metrics detour
"""


def files(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def test_json_is_one_object_with_the_documented_keys_and_nothing_else(mjnav):
    said = mjnav("run", "crossing1", "--json", "--no-log", "--seed", "3", *SHORT)
    assert said.code == 0
    printed = json.loads(said.out, parse_constant=pytest.fail)  # NaN and infinity are no JSON
    assert sorted(printed) == sorted(FIGURES.split())
    assert printed["schema"] == 1
    assert (printed["scene"], printed["controller"], printed["seed"]) == ("crossing1", "rkhs", 3)
    assert list(printed["collisions"]) == ["person", "table", "wall", "pillar"]
    assert list(printed["compute_ms"]) == ["sense", "estimate", "control", "record", "tick"]
    assert all(list(figures) == ["p50", "p99", "max"] for figures in printed["compute_ms"].values())
    assert (printed["ticks"], printed["log"], printed["lane_violation_s"]) == (3, None, None)
    assert re.fullmatch("[0-9a-f]{64}", printed["state_hash"])


def test_a_log_goes_below_the_working_directory_and_is_named_after_the_run(mjnav, tmp_path):
    said = mjnav("run", "crossing1", "--controller", "mean", "--seed", "2", *SHORT)
    (path,) = files(tmp_path)
    assert re.fullmatch(r"runs/out/crossing1-mean-2-[0-9T.]+\.mcap", path)
    assert said.out.splitlines()[-1].split() == ["log", path]
    assert open_log(tmp_path / path).complete


def test_a_run_for_people_says_how_it_went(mjnav):
    said = mjnav("run", "lane", "--no-log", *SHORT)
    assert said.out.startswith("lane, rkhs, seed 0: timeout after 0.3 s\n")
    for word in ("collisions", "clearance", "path", "control cost", "estimates", "infeasible", "real time"):
        assert word in said.out
    assert "deadlines" not in said.out


def test_a_paced_run_says_what_it_got(mjnav):
    said = mjnav("run", "lane", "--no-log", "--real-time", *SHORT)
    (line,) = (line for line in said.out.splitlines() if "deadlines missed" in line)
    got = line.partition("of 3 deadlines missed; ")[2]
    assert re.match(r"scheduler SCHED_\w+.*, memory .*locked.*, affinity ", got)
    privileged = "scheduler SCHED_FIFO" in got or "memory locked" in got
    assert said.err == f"mjnav: real time: until it ends, this run has {got}\n" * privileged


TOO_FAST = ("--set", "control.rate=1000", "--set", "physics.timestep=0.001", "--set", "control.samples=150")


def test_on_request_the_first_missed_deadline_ends_the_run_and_the_log_says_which(mjnav, tmp_path):
    words = ("--real-time", "--overruns", "abort", "--log", "a.mcap", "--json", "--set", "time_limit=5")
    said = mjnav("run", "crossing1", *words, *TOO_FAST)
    printed = json.loads(said.out)
    assert said.code == 1
    assert said.err.splitlines()[-1].startswith("mjnav: a deadline was missed: aborted after ")
    assert (printed["outcome"], printed["deadline_misses"]) == ("aborted", 1)
    assert 1 <= printed["ticks"] < 5000
    log = open_log(tmp_path / "a.mcap")
    (event,) = (message.value for message in log.messages("/events") if message.value.name == "overrun")
    last = printed["ticks"] - 1
    assert re.fullmatch(rf"tick {last} was still at work \d+\.\d ms after the deadline of the next, .*", event.message)
    assert (log.complete, log.result["outcome"]) == (True, "aborted")


def test_a_requirement_on_the_run_is_checked_after_it_and_its_name_before(mjnav):
    words = ("run", "crossing1", "--no-log", "--set", "physics.engine=kinematic", "--set", "time_limit=0.5")
    assert mjnav(*words, "--require", "outcome==timeout", "--require", "collisions_person==0").code == 0
    said = mjnav(*words, "--json", "--require", "success==true", "--require", "ticks>=5")
    assert (said.code, said.err) == (1, "mjnav: required success == 1; found 0\n")
    assert [one["met"] for one in json.loads(said.out)["requirements"]] == [False, True]


def test_a_live_run_says_where_it_is_served_on_standard_error_only(mjnav):
    pytest.importorskip("foxglove", reason="foxglove-sdk is not installed")
    said = mjnav("run", "crossing1", "--live", "--port", 0, "--no-real-time", "--json", "--no-log", *SHORT)
    assert said.code == 0
    assert re.match(r"mjnav: live at ws://127\.0\.0\.1:\d+: ", said.err)
    plain = mjnav("run", "crossing1", "--json", "--no-log", *SHORT)
    assert json.loads(said.out)["state_hash"] == json.loads(plain.out)["state_hash"]


def test_a_port_that_is_taken_is_one_line(mjnav, tmp_path):
    pytest.importorskip("foxglove", reason="foxglove-sdk is not installed")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        said = mjnav("run", "crossing1", "--live", "--port", port)
    assert said.code == 2
    assert said.err == f"mjnav: port {port} of 127.0.0.1 cannot be served: Address already in use; choose another\n"
    assert list(tmp_path.iterdir()) == []
