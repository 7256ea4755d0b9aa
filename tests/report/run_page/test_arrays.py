"""The arrays of a page: packed columns, histograms, ranks, predicted ways, and how consistent the beliefs are."""

import gzip
from base64 import b64decode
from pathlib import Path

import numpy as np
import pytest

import mjnav
from mjnav.log import open_log
from mjnav.log.encode.plan import SUFFIX
from mjnav.loop.prepare import load_scenario
from mjnav.metrics.consistency import DEPLETED
from mjnav.report.run_page.layers import CONE_BINS, Packer, cone_bins
from mjnav.report.run_page.playback import playback
from mjnav.report.run_page.run_frames import MAX_FREE, POINTS, candidate_ranks


def unpacked(document, name):
    """A measured array as the page makes it again, by plain loops."""
    field, data = document["fields"][name], gzip.decompress(b64decode(document["gzip"]))
    length = int(np.prod(field["shape"]))
    stored = data[field["offset"] : field["offset"] + 2 * length]
    columns = []
    for column in range(length // field["shape"][0]):
        code, values = 0, []
        for row in range(field["shape"][0]):
            place = column * field["shape"][0] + row
            code = (code + stored[place] + 256 * stored[length + place]) % 65536
            values.append(np.nan if code == 65535 else field["low"] + field["step"] * code)
        columns.append(values)
    return np.array(columns).T.reshape(field["shape"])


def test_measured_numbers_come_back_to_half_a_step_and_missing_ones_stay_so():
    values = np.random.default_rng(0).normal(scale=3.0, size=(50, 4, 2))
    values[3:9, 2] = np.nan
    packer = Packer()
    packer.numbers("before", np.zeros(3, np.uint8))
    packer.measured("some", values, 0.01)
    found = unpacked(packer.packed(), "some")
    np.testing.assert_array_equal(np.isnan(found), np.isnan(values))
    assert np.nanmax(np.abs(found - values)) <= 0.005 + 1e-12


def test_a_range_that_is_too_wide_for_the_step_takes_a_coarser_one():
    values = np.array([-1e6, 0.0, 3.0, 1e6])
    packer = Packer()
    packer.measured("wide", values, 0.001)
    assert np.abs(unpacked(packer.packed(), "wide") - values).max() <= 2e6 / 65533 / 2 * 1.001


def test_every_sample_is_counted_on_its_side_of_zero():
    rng = np.random.default_rng(1)
    samples, desired = rng.normal(size=400), -rng.random(100)
    found = cone_bins({1: (samples, desired), 2: (np.array([0.0, 1e-9]), np.zeros(0))}, 3)
    assert found is not None
    low, width, codes = found
    safe = round(-low / width)
    shares = codes / 255
    assert codes.shape[2] >= CONE_BINS
    assert shares[1, 0, :safe].sum() == pytest.approx(np.mean(samples <= 0), abs=0.5 * safe / 255)
    assert shares[1, 0].sum() == pytest.approx(1.0, abs=0.05)
    assert not codes[1, 1, safe:].any()
    assert shares[2, 0, safe - 1 : safe + 1].tolist() == pytest.approx([0.5, 0.5], abs=1 / 255)  # 0 itself is safe
    assert not codes[0].any()


def test_ranks_of_a_grid_are_those_of_its_costs():
    v, omega = (
        axis.ravel() for axis in np.meshgrid(np.linspace(0.3, 0.5, 20), np.linspace(-0.4, 0.2, 20), indexing="ij")
    )
    total = np.random.default_rng(2).random(402)
    ranks = candidate_ranks(np.append(v, [0.4, 0.3]), np.append(omega, [0.0, -0.1]), total, (20, 20))
    assert ranks.free is None
    assert ranks.window.tolist() == [0.3, 0.5, -0.4, 0.2]
    cheaper = (total[:, None] > total).sum(axis=1)  # candidates than each
    np.testing.assert_array_equal(ranks.level, (8 * (cheaper[:400] + 1) - 1) // 402)


def test_candidates_that_are_no_grid_keep_their_own_controls():
    rng = np.random.default_rng(3)
    v, omega, total = rng.uniform(0.3, 0.8, 300), rng.uniform(-1.0, 1.0, 300), rng.random(300)
    ranks = candidate_ranks(v, omega, total, (20, 20))
    assert ranks.free.shape == (MAX_FREE, 2)
    assert (np.diff(ranks.level.astype(int)) >= 0).all()
    low, high = ranks.window[::2], ranks.window[1::2]
    cheapest = low + (high - low) * ranks.free[0] / 255
    np.testing.assert_allclose(cheapest, [v[total.argmin()], omega[total.argmin()]], atol=0.01)


def stored(document, name, kind):
    """An array of single bytes as it stands in the page."""
    field, data = document["fields"][name], gzip.decompress(b64decode(document["gzip"]))
    length = int(np.prod(field["shape"]))
    return np.frombuffer(data, kind, length, field["offset"]).reshape(field["shape"])


@pytest.fixture(scope="module")
def predicted(tmp_path_factory):
    path = tmp_path_factory.mktemp("logs") / "arcs.mcap"
    arcs = Path(__file__).parents[3] / "examples" / "predictor" / "arcs.py"
    given = ("physics.engine=kinematic", "time_limit=1", f"prediction.model={arcs}:Arcs")
    mjnav.run(load_scenario("five", given, seed=3), log=path)
    return open_log(path)


def test_they_begin_and_end_where_the_log_has_them(predicted):
    made = playback(predicted)
    document = {"fields": made["fields"], "gzip": made["gzip"]}
    owners, codes = stored(document, "way_of", np.uint8), stored(document, "ways", np.int8)
    positions = unpacked(document, "tracks")[..., :2]
    step = made["fields"]["ways"]["step"]
    ways = 0
    for message in predicted.messages("/scene"):
        entities = [entity for entity in message.value.entities if entity.id.endswith(SUFFIX)]
        for place, entity in enumerate(entities):
            track = owners[message.sequence, place]
            assert made["tracks"][track] == entity.id.removesuffix(SUFFIX)
            moves = codes[message.sequence, place]
            for line, way in zip(entity.lines, moves, strict=True):
                if np.abs(way).max() == 127:
                    continue  # the fastest samples are cut
                path = positions[message.sequence, track] + step * np.cumsum(way.astype(float), axis=0)
                ends = [[point.x, point.y] for point in (line.points[0], line.points[-1])]
                assert np.abs(path[[0, -1]] - ends).max() <= 0.5 * POINTS * step + 1e-3
                ways += 1
    assert ways > 200  # 10 ticks, 3 people, 8 samples


def test_a_run_without_a_model_has_none(tmp_path):
    scenario = load_scenario("crossing1", ("physics.engine=kinematic", "time_limit=0.2"))
    mjnav.run(scenario, log=tmp_path / "plain.mcap")
    assert "ways" not in playback(open_log(tmp_path / "plain.mcap"))["fields"]


def test_a_line_above_its_level_is_a_tick_that_is_not_covered(tmp_path):
    # Estimators that believe in no noise are too sure of themselves, and start again and again.
    keys = ["physics.engine=kinematic", "time_limit=3", "noise.profile=bimodal", "estimation.assumed_profile=none"]
    figures = mjnav.run(load_scenario("crossing1", keys, seed=1), log=tmp_path / "a.mcap").summary
    data = playback(open_log(tmp_path / "a.mcap"))
    document = {"fields": data["fields"], "gzip": data["gzip"]}
    nees, ess = (stored(document, name, np.float32) for name in ("nees", "ess"))
    assert np.isnan([nees[-1], ess[-1]]).all()  # the state at the end, which no belief goes with
    assert (nees[:-1] <= 1.0).mean(axis=0) == pytest.approx([figures["robot_coverage"], figures["people_coverage"]])
    depleted = [figures["robot_depleted_share"], figures["people_depleted_share"]]
    assert (ess[:-1] < DEPLETED).mean(axis=0) == pytest.approx(depleted)
    assert sum(event["name"] == "recovery" for event in data["events"]) == figures["recoveries"] > 0


def test_the_robots_planned_ways_are_those_of_the_log_with_what_it_had_drawn(tmp_path):
    drawing = ("route.planner=shortest", "estimation.map.source=lidar", "time_limit=3")
    mjnav.run(load_scenario("hall-lidar", drawing, seed=1), log=tmp_path / "drawn.mcap")
    log = open_log(tmp_path / "drawn.mcap")
    logged = [message.value for message in log.messages("/way")]
    shown = playback(log)["scene"]["own_ways"]
    assert [way["number"] for way in logged] == list(range(len(logged)))
    assert len(shown) == len(logged) > 3
    for way, value in zip(shown, logged, strict=True):
        np.testing.assert_allclose(way["line"], value["line"], atol=0.005)
        np.testing.assert_allclose(way.get("drawn", value["drawn"]), value["drawn"], atol=0.005)
    assert not shown[0]["drawn"]
    assert len(shown[-1]["drawn"]) > 100


def test_without_a_route_there_is_no_planned_way(predicted):
    assert playback(predicted)["scene"]["own_ways"] == []
    assert "/way" not in predicted.topics
