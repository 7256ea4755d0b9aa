"""The likelihood of a scan around the believed pose, as a page shows it."""

import numpy as np
import pytest

from mjnav.log import open_log
from mjnav.noise import profile
from mjnav.report.lidar_view import BelievedWay, ShownScan, scan_points
from mjnav.report.run_page.layers import LEVELS, SIDE, likelihood_levels
from mjnav.robot.estimation.lidar.likelihood_field import LikelihoodField
from mjnav.scene.ways import floor_of_lidar
from tests.report.scanning import by_lidar, write_log


@pytest.mark.parametrize("error", [(0.0, 0.0), (0.1, -0.2)])
def test_the_likeliest_place_is_where_the_robot_is(tmp_path, error):
    scenario = by_lidar({"noise.profile": "none", "people": [], "time_limit": 0.2})
    write_log(tmp_path / "a.mcap", scenario)
    log = open_log(tmp_path / "a.mcap")
    run, lidar = log.trajectory(), scenario.sensors.scanner
    field = LikelihoodField.of(floor_of_lidar(scenario.known_bodies), lidar, profile("pearson")["lidar.range"])
    message = next(iter(log.messages("/scan")))
    points = scan_points(ShownScan.of(message.value, scenario, 0), lidar, BelievedWay(run.time, run.robot_pose))
    truth = run.robot_pose[0]  # its heading is 0, so that only its place has to be taken off
    pose = truth + np.array([*error, 0.0])
    levels = likelihood_levels(field, points - truth[:2], pose, 0.35).reshape(SIDE, SIDE)
    row, column = np.unravel_index(levels.argmax(), levels.shape)
    steps = np.linspace(-0.35, 0.35, SIDE)
    assert (steps[column], steps[row]) == pytest.approx((-error[0], -error[1]), abs=0.026)
    assert (levels.max(), levels.min()) == (LEVELS - 1, 0)
