"""Whole runs: the same seed ends in the same state, whatever else happens, and every end is in order."""

from typing import ClassVar

import numpy as np
import pytest

import mjnav
from mjnav import control
from mjnav.control.methods.cvar import Cvar
from mjnav.log import open_log
from mjnav.loop.episode import Episode
from mjnav.loop.pacer import RealTimePacer
from mjnav.loop.prepare import as_scenario
from mjnav.loop.supervision import RunFault
from mjnav.robot.navigator import Navigator

ENGINES = ("mujoco", "kinematic")


def state_hash(scenario, **options) -> str:
    return Episode(scenario, **options).run().summary["state_hash"]


# ------------------------------------------------------------------------------------- the same state


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("rate", "delay"), [(10.0, 1), (10.0, 0), (10.0, 3), (5.0, 1), (50.0, 1), (4.0, 0)])
def test_a_seed_ends_in_the_same_state_logged_or_not_late_or_not(room, slow_clock, tmp_path, engine, rate, delay):
    scenario = room(f"physics.engine={engine}", f"control.rate={rate}", f"control.delay={delay}")
    hashes = {
        "first": state_hash(scenario),
        "again": state_hash(scenario),
        "logged": state_hash(scenario, log=tmp_path / "a.mcap"),
        "looked at": state_hash(scenario, cones=True),
        "no rays cast": state_hash(scenario, scan=False),
        "late": state_hash(scenario, pacer=RealTimePacer(1.0 / rate, clock=slow_clock, sleep=slow_clock.sleep)),
    }
    assert len(set(hashes.values())) == 1, hashes


def test_paced_by_the_wall_clock_a_seed_ends_in_the_same_state(room, tmp_path):
    scenario = room("time_limit=0.5")
    paced = mjnav.run(scenario, real_time=True, log=tmp_path / "a.mcap")
    assert paced.summary["state_hash"] == mjnav.run(scenario).summary["state_hash"]
    assert mjnav.run(scenario).real_time is None
    first = next(open_log(tmp_path / "a.mcap").messages("/events")).value
    assert first.name == "real_time"
    assert first.message == str(paced.real_time)


class Looker(Cvar):
    """Sees scans, as every controller of a user's own does."""

    scans: ClassVar[list] = []

    def decide(self, observation):
        self.scans.append(observation.scan)
        return super().decide(observation)


def test_rays_are_cast_where_somebody_looks_at_scans(room, tmp_path):
    def beams(*overrides, **options) -> int:
        records = []
        Episode(room("time_limit=0.1", *overrides), watch=records.append, scan=False, **options).run()
        return records[0].reading.scan.size

    assert beams() == 0
    assert beams("estimation.robot.source=lidar") == beams(log=tmp_path / "a.mcap") == 360
    Episode(as_scenario(room("time_limit=0.1"), controller=Looker), scan=False).run()
    assert [scan.ranges.size for scan in Looker.scans] == [360]


def test_what_matters_changes_the_hash(room):
    changes = ("control.delay=2", "control.rate=5", "physics.engine=kinematic", "noise.profile=none", "time_limit=1.1")
    hashes = [state_hash(room(change)) for change in ("seed=0", *changes)]
    assert len(set(hashes)) == len(hashes)


# ------------------------------------------------------------------------------- paired random streams


def sensor_noise(scenario, monkeypatch) -> tuple[np.ndarray, np.ndarray]:
    """Detections and poses less the truth, tick by tick."""
    readings = []
    estimate = Navigator.estimate

    def listening(self, new, beliefs):
        readings.extend(new)
        return estimate(self, new, beliefs)

    with monkeypatch.context() as patch:
        patch.setattr(Navigator, "estimate", listening)
        trajectory = Episode(scenario).run().trajectory
    detections = np.array([reading.detections for reading in readings]) - trajectory.people_position[:-1]
    return detections, np.array([reading.pose[:2] for reading in readings]) - trajectory.robot_pose[:-1, :2]


@pytest.mark.parametrize("engine", ENGINES)
def test_every_method_meets_the_same_noise(room, monkeypatch, engine):
    overrides = (f"physics.engine={engine}", "time_limit=2.0")
    mean = sensor_noise(room(*overrides, controller="mean"), monkeypatch)
    rkhs = sensor_noise(room(*overrides, "control.samples=40", controller="rkhs"), monkeypatch)
    for one, other in zip(mean, rkhs, strict=True):
        assert len(one) == 20
        assert one == pytest.approx(other, abs=1e-12)
        assert one.std() > 0.03


# ------------------------------------------------------------------------------------- how runs end


def test_waypoints_are_visited_in_their_order(empty):
    route = [(1.5, 0.0), (1.5, 1.5), (0.0, 1.5)]
    scenario = empty(f"robot.waypoints={[list(point) for point in route]}", "noise.profile=none")
    result = Episode(scenario).run()
    assert result.summary["outcome"] == "goal"
    path = result.trajectory.robot_pose[:, :2]
    reached = [np.flatnonzero(np.hypot(*(path - point).T) <= scenario.robot.goal_tolerance)[0] for point in route]
    assert reached == sorted(reached)
    assert reached[-1] == len(path) - 1
    assert result.summary["straight_line_m"] == pytest.approx(4.5)


@pytest.mark.parametrize("method", control.names())
def test_a_goal_behind_the_robot_is_reached_by_turning_round(empty, method):
    overrides = ["robot.goal=[-2.0, 0.1]"]
    if method == "rkhs-paper":  # its cost has no heading term, with which a robot at rest would turn
        overrides += ["control.heading_weight=0.3", "control.preview=1.0"]
    result = Episode(empty(*overrides, controller=method)).run()
    assert (result.summary["outcome"], result.summary["success"]) == ("goal", True)


BLOCKED = ("pillars.0.position=[1.0, 0.0]", "control.sensing_range=0.01", "noise.profile=none")  # it sees nothing


@pytest.mark.parametrize("engine", ENGINES)
def test_a_collision_ends_the_run_where_it_should(room, engine):
    result = Episode(room(*BLOCKED, "time_limit=10", f"physics.engine={engine}")).run()
    assert (result.summary["outcome"], result.summary["success"]) == ("collision", False)
    assert result.summary["collisions"] == {"person": 0, "table": 0, "wall": 0, "pillar": 1}
    assert result.summary["min_clearance_m"] < 0.02
    assert result.trajectory.contacts[0].name == "pillar0"


@pytest.mark.parametrize("engine", ENGINES)
def test_or_the_run_goes_on_and_is_no_success(room, tmp_path, engine):
    scenario = room(*BLOCKED, "stop_on_collision=false", "time_limit=3.5", f"physics.engine={engine}")
    result = Episode(scenario, log=tmp_path / "a.mcap").run()
    assert (result.summary["outcome"], result.summary["success"]) == ("timeout", False)
    assert result.summary["collisions"]["pillar"] == 1
    assert result.summary["ticks"] == 35
    texts = [message.value.message for message in open_log(tmp_path / "a.mcap").messages("/events")]
    assert any("contact with pillar pillar0" in text for text in texts)


# ------------------------------------------------------------------------------------------- faults


def test_physics_that_diverge_abort_the_run_at_the_last_state_that_is_known(room, tmp_path):
    def upset(record):
        if record.tick == 5:
            episode._simulation._world._engine.data.qvel[0] = 1e11

    episode = Episode(room(), log=tmp_path / "a.mcap", watch=upset)
    with pytest.raises(RunFault, match=r"^aborted after 0\.5 s, 6 ticks: MuJoCo lost the physics before 0\.5\d+ s: "):
        episode.run()
    log = open_log(tmp_path / "a.mcap")
    assert (log.complete, log.truncated, log.result["outcome"]) == (True, False, "aborted")
    assert log.result["path_length_m"] < 1.0
    trajectory = log.trajectory()
    assert (len(trajectory.command), np.isfinite(trajectory.robot_pose).all()) == (6, True)
    faults = [message.value for message in log.messages("/events") if message.value.name == "fault"]
    assert [fault.message.partition(":")[0] for fault in faults] == ["MuJoCo lost the physics before 0.500 s"]


# --------------------------------------------------------------------------------- memory and the log
