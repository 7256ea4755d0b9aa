"""What a page shows of a method that plans ahead and of a robot that goes by its lidar is what its log has."""

import numpy as np
import pytest

from mjnav.log import open_log
from mjnav.report.inspection import inspect
from mjnav.report.run_page.layers import FAN_POINTS
from mjnav.report.run_page.page import page
from mjnav.report.run_page.playback import playback
from tests.report.planning import NUM_TICKS, written
from tests.report.run_page.test_arrays import stored, unpacked
from tests.report.scanning import by_lidar, write_log


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    """The plans by tick, the log and its playback."""
    path = tmp_path_factory.mktemp("logs") / "plan.mcap"
    plans = {tick: plan for tick, plan in enumerate(written(path)) if plan is not None}
    return plans, open_log(path), playback(open_log(path))


def test_plan_and_fan_are_those_of_the_log(planned):
    plans, _, data = planned
    document = {"fields": data["fields"], "gzip": data["gzip"]}
    paths, feasible = unpacked(document, "plan"), stored(document, "plan_feasible", np.uint8)
    assert feasible[:, None].tolist() == [[1], [255], [1], [0], [255]]  # none in one tick and at the end
    moves, step = stored(document, "fan", np.int8), data["fields"]["fan"]["step"]
    kept = np.linspace(0, 19, FAN_POINTS).astype(int)
    for tick, plan in plans.items():
        np.testing.assert_allclose(paths[tick], plan.path, atol=1e-3)
        fan = plan.path[0] + step * np.cumsum(moves[tick].astype(float), axis=1)
        np.testing.assert_allclose(fan, plan.fan[:, kept], atol=0.5 * step + 1e-3)  # errors do not add up
    assert (moves[1] == -128).all()
    assert data["plan"] == {"fan": [32, FAN_POINTS], "bin": 0.1, "violation": True}


def test_violations_are_counted_at_0_and_by_tenths_from_the_low_end_on(planned):
    _, _, data = planned
    document = {"fields": data["fields"], "gzip": data["gzip"]}
    shares = stored(document, "violation", np.uint8)[0] / 255
    assert shares[[0, 1, 10, 11, 20]] == pytest.approx([0.5, 0.125, 0.125, 0.125, 0.125], abs=0.003)
    assert np.count_nonzero(shares) == 5
    np.testing.assert_allclose(unpacked(document, "violation_shares")[0], [0.5, 0.25], atol=1e-3)
    assert data["cone"] is None  # its panel gives way


def test_a_page_has_the_legend_of_plans_where_there_are_some(planned, tmp_path):
    _, log, data = planned
    with_plans = page([(inspect(log), data)])
    written(tmp_path / "b.mcap", plans=False)
    other = open_log(tmp_path / "b.mcap")
    without = page([(inspect(other), playback(other))])
    assert ('<li ><i class="mark plan">' in with_plans, '<li hidden><i class="mark plan">' in without) == (True, True)
    assert 'data-layer="candidates" checked' in without
    assert 'data-layer="candidates" checked' not in with_plans
    assert data["ticks"] == NUM_TICKS


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    path = tmp_path_factory.mktemp("logs") / "scans.mcap"
    write_log(path, by_lidar({"estimation.map.missing": ["pillar1"]}))
    return open_log(path)


@pytest.fixture(scope="module")
def data(shown):
    return playback(shown)


def arrays(data, *names):
    document = {"fields": data["fields"], "gzip": data["gzip"]}
    return [unpacked(document, name) for name in names]


def test_tracks_have_number_age_time_unseen_and_radius(data):
    assert len(data["tracks"]) == 5  # though ten tracks lived
    (life,) = arrays(data, "life")
    assert life[2, :, 0] == pytest.approx([3, 4, 5, 6, 7])
    assert life[7, :, 0] == pytest.approx([13, 14, 15, 16, 17])
    assert life[2, 0, 1:] == pytest.approx([1.2, 0.3, 0.3], abs=0.006)
    assert life[7, 1, 1:] == pytest.approx([1.2, 0.0, 0.3], abs=0.006)


def test_detections_are_those_of_the_log_with_their_ellipses(data, shown):
    (found,) = arrays(data, "detected")
    for message in shown.messages("/detections"):
        for row, logged in zip(found[message.sequence], message.value["detections"], strict=True):
            assert row[:2] == pytest.approx(logged["position"], abs=1e-3)
            assert row[2:5] == pytest.approx([0.25, 0.2 * 5.991**0.5, 0.1 * 5.991**0.5], abs=1e-3)
            assert abs(row[5]) == pytest.approx(np.pi / 2, abs=1e-3)


def test_ranges_are_those_of_the_log_to_a_centimetre(data, shown):
    ranges, number = arrays(data, "scan", "scan_of")
    first = stored({"fields": data["fields"], "gzip": data["gzip"]}, "scan_time", np.float64)
    for message in shown.messages("/scan"):
        row, logged = int(number[message.sequence]), np.array(message.value.ranges)[::2]
        assert first[row] == pytest.approx(1e-9 * message.time_ns, abs=1e-6)
        logged[np.isinf(logged)] = np.nan
        np.testing.assert_allclose(ranges[row], logged, atol=0.0101)


def test_the_robots_own_map_is_drawn_where_it_differs(data, shown):
    assert [len(data["scene"]["pillars"]), len(data["lidar"]["map"]["pillars"])] == [2, 1]
    text = page([(inspect(shown), data)])
    for layer in ("scan", "detections", "map"):
        assert f'data-layer="{layer}"' in text


def test_a_page_of_scans_stays_small(data):
    assert len(data["gzip"]) < 11 * 1200  # bytes a tick
