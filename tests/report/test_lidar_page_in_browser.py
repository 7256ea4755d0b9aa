"""The page of a robot that goes by its lidar, in a browser."""

import numpy as np
import pytest

from mjnav.cli.main import main
from mjnav.log import open_log
from mjnav.report.lidar_view import BelievedWay, ShownScan, scan_points
from tests.report.scanning import by_lidar, write_log
from tests.report.test_page_in_browser import DESK, pixels

ALL_BUT_FEW = {"sensors.lidar.model": "rplidar-a1", "sensors.lidar.mount": [0.05, -0.02, 0.3]}
POINTS = """() => Run.load(JSON.parse(document.getElementById('runs').textContent)[0], 0)
    .then((run) => scanPoints(run, 7))"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    write_log(folder / "scans.mcap", by_lidar({**ALL_BUT_FEW, "estimation.map.shift": [0.1, 0.0, 0.0]}))
    assert main(["report", str(folder / "scans.mcap")]) == 0
    return folder


@pytest.fixture
def view(browser, folder):
    page, said = browser.new_page(viewport=DESK), []
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.goto((folder / "scans.html").as_uri() + "#t=0.7")
    page.wait_for_selector("html[data-ready]")
    yield page
    page.close()
    assert said == []


def test_its_points_are_those_of_the_log_each_from_where_the_robot_believed_to_be_then(view, folder):
    log = open_log(folder / "scans.mcap")
    scenario, run = log.scenario(), log.trajectory()
    lidar, way = scenario.sensors.scanner, BelievedWay.of(run.time[:-1], run.estimate)
    scans = [message for message in log.messages("/scan") if message.sequence <= 7]
    scan = ShownScan.of(scans[-1].value, scenario, 0)
    every = ShownScan(scan.first, np.where(np.arange(len(scan.ranges)) % 2 == 0, scan.ranges, np.inf))
    found = np.array(view.evaluate(POINTS))
    np.testing.assert_allclose(found, scan_points(every, lidar, way), atol=0.012)


def test_each_layer_can_be_switched_off(view):
    seen = {pixels(view)}
    for layer in ("scan", "detections", "map", "estimates"):
        view.locator(f"[data-layer={layer}]").click()
        seen.add(pixels(view))
    assert len(seen) == 5
