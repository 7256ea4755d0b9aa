"""The pages of a robot that goes by its lidar and of a method that plans ahead, in a browser; and the plan in films."""

import numpy as np
import pytest

from mjnav.cli.main import main
from mjnav.log import open_log
from mjnav.report.lidar_view import BelievedWay, LoggedViews, ShownScan, scan_points
from tests.report.planning import written
from tests.report.scanning import by_lidar, write_log
from tests.report.test_page_in_browser import pixels


def test_a_moment_has_the_latest_plan_for_a_period(tmp_path):
    plans = written(tmp_path / "a.mcap")
    views = LoggedViews(open_log(tmp_path / "a.mcap"))
    for time, tick in ((0.0, 0), (0.05, 0), (0.1, 0), (0.2, 2), (0.35, 3), (0.4, 3)):
        shown = views.at(time)
        np.testing.assert_array_equal(shown["plan"], plans[tick].path.astype("f4"))
        np.testing.assert_array_equal(shown["fan"], plans[tick].fan.astype("f4"))
        assert shown["feasible"] == (tick != 3)
    assert views.at(0.15) == {}  # the second tick had none


def test_a_browser_shows_the_plan_its_fan_and_the_violation(open_page, tmp_path):
    written(tmp_path / "a.mcap")
    assert main(["report", str(tmp_path / "a.mcap")]) == 0
    view = open_page(tmp_path / "a.html", "#t=0.2")
    seen = {pixels(view)}
    for layer in ("fan", "plan"):
        view.locator(f"[data-layer={layer}]").click()
        seen.add(pixels(view))
    assert len(seen) == 3
    shares = [view.inner_text(f".violation .{name}") for name in ("share-text", "touching")]
    assert [text.replace("\u202f", " ") for text in shares] == ["50 %", "25 %"]
    assert view.get_attribute(".violation .current.colliding", "d").count("Z") == 2
    assert not view.is_visible(".cone")


ALL_BUT_FEW = {"sensors.lidar.model": "rplidar-a1", "sensors.lidar.mount": [0.05, -0.02, 0.3]}
POINTS = """() => Run.load(JSON.parse(document.getElementById('runs').textContent)[0], 0)
    .then((run) => scanPoints(run, 7))"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    write_log(folder / "scans.mcap", by_lidar({**ALL_BUT_FEW, "estimation.map.shift": [0.1, 0.0, 0.0]}))
    assert main(["report", str(folder / "scans.mcap")]) == 0
    return folder


def test_its_points_are_those_of_the_log_each_from_where_the_robot_believed_to_be_then(open_page, folder):
    log = open_log(folder / "scans.mcap")
    scenario, run = log.scenario(), log.trajectory()
    lidar, way = scenario.sensors.scanner, BelievedWay.of(run.time[:-1], run.estimate)
    scans = [message for message in log.messages("/scan") if message.sequence <= 7]
    scan = ShownScan.of(scans[-1].value, scenario)
    every = ShownScan(scan.first, np.where(np.arange(len(scan.ranges)) % 2 == 0, scan.ranges, np.inf))
    found = np.array(open_page(folder / "scans.html", "#t=0.7").evaluate(POINTS))
    np.testing.assert_allclose(found, scan_points(every, lidar, way), atol=0.012)
