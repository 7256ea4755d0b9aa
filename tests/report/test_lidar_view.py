"""What pictures and films show of a robot that goes by its lidar."""

import numpy as np
import pytest

import mjnav
from mjnav.log import open_log
from mjnav.loop.prepare import load_scenario
from mjnav.report.lidar_view import LoggedViews
from tests.report.scanning import by_lidar, write_log


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
