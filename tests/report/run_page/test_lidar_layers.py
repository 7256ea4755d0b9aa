"""What a page shows of a robot that goes by its lidar."""

import numpy as np
import pytest

from mjnav.log import open_log
from mjnav.report.inspection import inspect
from mjnav.report.run_page.page import page
from mjnav.report.run_page.playback import playback
from mjnav.report.run_page.run_frames import columns_of_tracks
from tests.report.run_page.test_packed import unpacked
from tests.report.run_page.test_predicted_ways import stored
from tests.report.scanning import by_lidar, write_log


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    path = tmp_path_factory.mktemp("logs") / "scans.mcap"
    write_log(path, by_lidar({"estimation.map.missing": ["pillar1"]}))
    return open_log(path)


@pytest.fixture(scope="module")
def data(shown):
    return playback(shown)


def arrays(data, *names):
    document = {"fields": data.fields, "gzip": data.gzip}
    return [unpacked(document, name) for name in names]


def test_a_track_keeps_its_column_and_the_next_one_takes_what_became_free():
    first = columns_of_tracks(["track3", "track5"], {})
    assert first == {"track3": "column0", "track5": "column1"}
    second = columns_of_tracks(["track5", "track6", "person0"], first)
    assert second == {"track5": "column1", "track6": "column0", "person0": "person0"}


def test_tracks_have_number_age_time_unseen_and_radius(data):
    assert len(data.tracks) == 5  # though ten tracks lived
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
    first = stored({"fields": data.fields, "gzip": data.gzip}, "scan_time", np.float64)
    for message in shown.messages("/scan"):
        row, logged = int(number[message.sequence]), np.array(message.value.ranges)[::2]
        assert first[row] == pytest.approx(1e-9 * message.time_ns, abs=1e-6)
        logged[np.isinf(logged)] = np.nan
        np.testing.assert_allclose(ranges[row], logged, atol=0.0101)


def test_the_robots_own_map_is_drawn_where_it_differs(data, shown):
    assert [len(data.scene["pillars"]), len(data.lidar["map"]["pillars"])] == [2, 1]
    text = page([(inspect(shown), data)])
    for layer in ("scan", "detections", "map"):
        assert f'data-layer="{layer}"' in text


def test_a_page_of_scans_stays_small(data):
    assert len(data.gzip) < 11 * 1200  # bytes a tick
