"""The predicted ways of people on a page."""

import gzip
from base64 import b64decode
from pathlib import Path

import numpy as np
import pytest

import mjnav
from mjnav.log import open_log
from mjnav.log.encode.plan import SUFFIX
from mjnav.loop.prepare import load_scenario
from mjnav.report.run_page.playback import playback
from mjnav.report.run_page.run_frames import POINTS
from tests.report.run_page.test_packed import unpacked


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
    document = {"fields": made.fields, "gzip": made.gzip}
    owners, codes = stored(document, "way_of", np.uint8), stored(document, "ways", np.int8)
    positions = unpacked(document, "tracks")[..., :2]
    step = made.fields["ways"]["step"]
    ways = 0
    for message in predicted.messages("/scene"):
        entities = [entity for entity in message.value.entities if entity.id.endswith(SUFFIX)]
        for place, entity in enumerate(entities):
            track = owners[message.sequence, place]
            assert made.tracks[track] == entity.id.removesuffix(SUFFIX)
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
    assert "ways" not in playback(open_log(tmp_path / "plain.mcap")).fields
