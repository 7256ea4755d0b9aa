"""What a page has of a method that plans ahead is what its log has."""

import numpy as np
import pytest

from mjnav.log import open_log
from mjnav.report.inspection import inspect
from mjnav.report.run_page.layers import FAN_POINTS
from mjnav.report.run_page.page import page
from mjnav.report.run_page.playback import playback
from tests.report.planning import NUM_TICKS, written
from tests.report.run_page.test_packed import unpacked
from tests.report.run_page.test_predicted_ways import stored


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    """The plans by tick, the log and its playback."""
    path = tmp_path_factory.mktemp("logs") / "plan.mcap"
    plans = {tick: plan for tick, plan in enumerate(written(path)) if plan is not None}
    return plans, open_log(path), playback(open_log(path))


def test_plan_and_fan_are_those_of_the_log(shown):
    plans, _, data = shown
    document = {"fields": data.fields, "gzip": data.gzip}
    paths, feasible = unpacked(document, "plan"), stored(document, "plan_feasible", np.uint8)
    assert feasible[:, None].tolist() == [[1], [255], [1], [0], [255]]  # none in one tick and at the end
    moves, step = stored(document, "fan", np.int8), data.fields["fan"]["step"]
    kept = np.linspace(0, 19, FAN_POINTS).astype(int)
    for tick, plan in plans.items():
        np.testing.assert_allclose(paths[tick], plan.path, atol=1e-3)
        fan = plan.path[0] + step * np.cumsum(moves[tick].astype(float), axis=1)
        np.testing.assert_allclose(fan, plan.fan[:, kept], atol=0.5 * step + 1e-3)  # errors do not add up
    assert (moves[1] == -128).all()
    assert data.plan == {"fan": [32, FAN_POINTS], "bin": 0.1, "violation": True}


def test_violations_are_counted_at_0_and_by_tenths_from_the_low_end_on(shown):
    _, _, data = shown
    document = {"fields": data.fields, "gzip": data.gzip}
    shares = stored(document, "violation", np.uint8)[0] / 255
    assert shares[[0, 1, 10, 11, 20]] == pytest.approx([0.5, 0.125, 0.125, 0.125, 0.125], abs=0.003)
    assert np.count_nonzero(shares) == 5
    np.testing.assert_allclose(unpacked(document, "violation_shares")[0], [0.5, 0.25], atol=1e-3)
    assert data.cone is None  # its panel gives way


def test_a_page_has_the_legend_of_plans_where_there_are_some(shown, tmp_path):
    _, log, data = shown
    with_plans = page([(inspect(log), data)])
    written(tmp_path / "b.mcap", plans=False)
    other = open_log(tmp_path / "b.mcap")
    without = page([(inspect(other), playback(other))])
    assert ('<li ><i class="mark plan">' in with_plans, '<li hidden><i class="mark plan">' in without) == (True, True)
    assert 'data-layer="candidates" checked' in without
    assert 'data-layer="candidates" checked' not in with_plans
    assert data.ticks == NUM_TICKS
