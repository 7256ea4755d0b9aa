"""What pictures and films show of a robot that goes by its lidar, and scans as the robot placed them."""

import numpy as np
import pytest
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan

import mjnav
from mjnav.log import open_log
from mjnav.loop.prepare import load_scenario
from mjnav.report.lidar_view import BelievedWay, LoggedViews, ShownScan, scan_points
from tests.report.scanning import ERROR, by_lidar, write_log


@pytest.fixture(scope="module")
def views(tmp_path_factory):
    path = tmp_path_factory.mktemp("logs") / "scans.mcap"
    write_log(path, by_lidar({}))
    log = open_log(path)
    return log.trajectory(), LoggedViews(log)


def test_between_two_ticks_the_latest_scan_and_detections_hold(views):
    trajectory, found = views
    now, later = found.at(0.3), found.at(0.35)
    assert now["scan"] is later["scan"]
    np.testing.assert_allclose(now["detections"], [[*place, 0.25] for place in trajectory.people_position[3]])
    assert now["coasts"].tolist() == [True, False, True, False, True]


def test_tracks_move_on_at_their_velocities(views):
    trajectory, found = views
    np.testing.assert_allclose(
        found.at(0.35)["tracks"][:, :2], trajectory.people_position[3]
    )  # they are believed to stand
    assert list(found.at(0.3)) == ["scan", "detections", "tracks", "coasts"]


def test_nothing_of_it_is_drawn_of_a_robot_that_is_told(tmp_path):
    scenario = load_scenario("crossing1", {"physics.engine": "kinematic", "time_limit": 0.2})
    mjnav.run(scenario, log=tmp_path / "told.mcap")
    assert LoggedViews(open_log(tmp_path / "told.mcap")).at(0.1) == {}


def lidar(**keys):
    return by_lidar({f"sensors.lidar.{key}": value for key, value in keys.items()}).sensors.scanner


def test_beams_end_at_the_walls_where_the_belief_is_true_and_beside_them_by_its_error(tmp_path):
    scenario = by_lidar({"noise.profile": "none", "people": [], "sensors.lidar.model": "ideal"})
    write_log(tmp_path / "a.mcap", scenario)
    log = open_log(tmp_path / "a.mcap")
    run = log.trajectory()
    believed = BelievedWay.of(run.time[:-1], run.estimate)
    for message in log.messages("/scan"):
        scan = ShownScan.of(message.value, scenario)
        true = BelievedWay(run.time, run.robot_pose)
        exact, placed = (scan_points(scan, scenario.sensors.scanner, way) for way in (true, believed))
        on_wall = np.abs(np.abs(exact[:, 1]) - 2.95) < 1e-6  # faces of walls 0.1 m thick at y = -3 and 3
        assert on_wall.sum() > 100
        robot = run.robot_pose[message.sequence]
        c, s = np.cos(ERROR[2]), np.sin(ERROR[2])
        moved = (exact - robot[:2]) @ np.array([[c, s], [-s, c]]) + robot[:2] + ERROR[:2]
        np.testing.assert_allclose(placed, moved, atol=1e-9)


def test_each_beam_starts_from_where_the_robot_was_when_it_was_taken():
    turning = lidar(model="lds-01", beams=4, rate=5.0, mount=[0.1, 0.0, np.pi / 2])
    way = BelievedWay(np.array([0.0, 1.0]), np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))  # 1 m/s along x
    points = scan_points(ShownScan(0.5, np.full(4, 2.0)), turning, way)
    directions = turning.angles + np.pi / 2
    starts = 0.5 + 0.05 * np.arange(4) + 0.1
    np.testing.assert_allclose(points[:, 0], starts + 2.0 * np.cos(directions))
    np.testing.assert_allclose(points[:, 1], 2.0 * np.sin(directions), atol=1e-12)


def test_the_makers_mean_error_is_taken_off_as_estimators_do():
    scenario = by_lidar({"sensors.lidar.model": "lds-02"})
    message = LaserScan(ranges=[6.2, np.inf])
    message.timestamp.FromNanoseconds(500_000_000)
    scan = ShownScan.of(message, scenario)
    assert (scan.first, scan.ranges.tolist()) == (0.5, [6.2 - 0.155, np.inf])
