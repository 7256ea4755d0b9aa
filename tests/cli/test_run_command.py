"""`mjnav run`: what it prints, what it writes and what it refuses."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from mjnav import scene
from mjnav.cli.run import describe
from mjnav.log import open_log
from mjnav.robot.navigator import Navigator

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


def test_without_a_log_no_file_appears(mjnav, tmp_path):
    assert mjnav("run", "crossing1", "--no-log", *SHORT).code == 0
    assert files(tmp_path) == []


def test_a_log_goes_below_the_working_directory_and_is_named_after_the_run(mjnav, tmp_path):
    said = mjnav("run", "crossing1", "--controller", "mean", "--seed", "2", *SHORT)
    (path,) = files(tmp_path)
    assert re.fullmatch(r"runs/out/crossing1-mean-2-[0-9T.]+\.mcap", path)
    assert said.out.splitlines()[-1].split() == ["log", path]
    assert open_log(tmp_path / path).complete


def test_a_log_goes_where_it_is_told(mjnav, tmp_path):
    (tmp_path / "folder").mkdir()
    assert mjnav("run", "crossing1", "--log", "folder/a.mcap", *SHORT).code == 0
    assert files(tmp_path) == ["folder/a.mcap"]


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


def test_otherwise_a_run_that_cannot_keep_up_goes_on(mjnav):
    words = ("--real-time", "--overruns", "skip", "--no-log", "--json", "--set", "time_limit=0.05")
    printed = json.loads(mjnav("run", "crossing1", *words, *TOO_FAST).out)
    assert (printed["outcome"], printed["ticks"]) == ("timeout", 50)
    assert printed["deadline_misses"] > 1


def test_a_log_that_lacks_something_is_no_secret(mjnav):
    summary = json.loads(mjnav("run", "crossing1", "--log", "a.mcap", "--json", *SHORT).out)
    assert describe(summary).splitlines()[-1].split() == ["log", "a.mcap"]
    assert describe(summary, log_dropped=3).endswith("(3 parts of ticks are missing: the disk could not keep up)")


def test_tracks_are_told_of_unless_each_person_had_one_and_nobody_else(mjnav):
    summary = json.loads(mjnav("run", "crossing1", "--no-log", "--json", *SHORT).out)
    assert "tracks" not in describe(summary)
    summary |= {"tracked_share": 0.9, "false_tracks": 0.25, "identity_switches": 1, "gospa_m": 0.5}
    line = "  tracks          90 % of people's time, 0.25 false at a time, 1 identity switch; GOSPA 0.50 m"
    assert line in describe(summary).splitlines()


def test_a_path_and_several_overrides_are_taken(mjnav, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(scene.dumps(scene.load("crossing1")))
    overrides = ("--set", "control.rate=5", "--set", "people.0.radius=0.4", "--set", "name=other")
    printed = json.loads(mjnav("run", path, "--json", "--no-log", *overrides, "--set", "time_limit=0.4").out)
    assert (printed["scene"], printed["ticks"]) == ("other", 2)


# ------------------------------------------------------------------------------------------- refusals


@pytest.mark.parametrize(
    ("words", "fragments"),
    [
        (["hal"], ["scene: found 'hal'", "did you mean 'hall'?"]),
        (["./hall.toml"], ["./hall.toml", "No such file", "did you mean 'hall'?"]),
        (["hall", "--controller", "rkh"], ["--controller: control.method: found 'rkh'", "did you mean 'rkhs'?"]),
        (["hall", "--set", "control.degre=3"], ["--set: control.degre", "did you mean 'degree'?"]),
        (["hall", "--set", "time_limit"], ["--set: found 'time_limit'; allowed: KEY=VALUE"]),
        (["hall", "--set", "control.rate=30"], ["control.rate: found 30", "physics.timestep"]),
        (["hall", "--overruns", "abort"], ["--overruns needs --real-time, --live or --view"]),
        (["hall", "--real-time", "--overruns", "abrot"], ["--overruns: found 'abrot'", "did you mean 'abort'?"]),
        (["hall", "--log", "/dev/null"], ["/dev/null: exists already"]),
        (["hall", "--log", "new/a.mcap"], ["new/a.mcap: there is no folder /", "/new"]),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_line_with_the_nearest_name(mjnav, tmp_path, words, fragments):
    said = mjnav("run", *words)
    assert (said.code, said.out) == (2, "")
    assert len(said.err.splitlines()) == 1
    assert said.err.startswith("mjnav: ")
    for fragment in fragments:
        assert fragment in said.err
    assert files(tmp_path) == []


def test_an_existing_log_is_left_as_it_is(mjnav, tmp_path):
    path = tmp_path / "a.mcap"
    path.write_bytes(b"mine")
    said = mjnav("run", "hall", "--log", path)
    assert (said.code, said.out) == (2, "")
    assert "exists already" in said.err
    assert path.read_bytes() == b"mine"


def test_a_folder_that_may_not_be_written_to_is_refused(bound_by_permissions, tmp_path):
    folder = tmp_path / "closed"
    folder.mkdir(mode=0o500)
    words = [sys.executable, "-m", "mjnav.cli.main", "run", "hall", "--log", "closed/a.mcap"]
    done = subprocess.run([*bound_by_permissions, *words], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == f"mjnav: closed/a.mcap: the folder {folder} is not writable\n"


def test_a_fault_in_the_run_is_one_line_and_exit_1(mjnav, monkeypatch):
    monkeypatch.setattr(Navigator, "predict", lambda *_, **__: 1 // 0)
    said = mjnav("run", "crossing1", "--no-log", "--json", *SHORT)
    assert (said.code, json.loads(said.out)["outcome"]) == (1, "aborted")
    assert said.err.startswith("mjnav: aborted after 0.0 s, 0 ticks: ZeroDivisionError: integer division or modulo by")
    assert len(said.err.splitlines()) == 1


def test_a_profile_is_a_table_for_people_and_a_key_of_the_json(mjnav):
    said = mjnav("run", "crossing1", "--no-log", "--profile", *SHORT)
    assert [line.split()[0] for line in said.out.splitlines() if line.startswith(("sense ", "advance ", "tick "))] == [
        "sense",
        "advance",
        "tick",
    ]
    profile = json.loads(mjnav("run", "crossing1", "--no-log", "--profile", "--json", *SHORT).out)["profile"]
    assert profile["ticks"] == 3
    assert set(profile["phases"]["control"]["parts"]) == {"predict", "decide"}


def test_a_requirement_on_the_run_is_checked_after_it_and_its_name_before(mjnav):
    words = ("run", "crossing1", "--no-log", "--set", "physics.engine=kinematic", "--set", "time_limit=0.5")
    assert mjnav(*words, "--require", "outcome==timeout", "--require", "collisions_person==0").code == 0
    said = mjnav(*words, "--json", "--require", "success==true", "--require", "ticks>=5")
    assert (said.code, said.err) == (1, "mjnav: required success == 1; found 0\n")
    assert [one["met"] for one in json.loads(said.out)["requirements"]] == [False, True]
    refused = mjnav(*words, "--require", "time>=5")
    assert (refused.code, refused.out) == (2, "")
    assert "did you mean 'time_s'?" in refused.err
