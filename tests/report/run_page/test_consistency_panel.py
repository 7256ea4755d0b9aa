"""What a page draws of the beliefs' consistency is what the figures count."""

import numpy as np
import pytest

import mjnav
from mjnav import load_scenario
from mjnav.log import open_log
from mjnav.metrics.consistency import DEPLETED
from mjnav.report.run_page.playback import playback
from tests.report.run_page.test_predicted_ways import stored


def test_a_line_above_its_level_is_a_tick_that_is_not_covered(tmp_path):
    # Estimators that believe in no noise are too sure of themselves, and start again and again.
    keys = ["physics.engine=kinematic", "time_limit=3", "noise.profile=bimodal", "estimation.assumed_profile=none"]
    figures = mjnav.run(load_scenario("crossing1", keys, seed=1), log=tmp_path / "a.mcap").summary
    data = playback(open_log(tmp_path / "a.mcap"))
    document = {"fields": data.fields, "gzip": data.gzip}
    nees, ess = (stored(document, name, np.float32) for name in ("nees", "ess"))
    assert np.isnan([nees[-1], ess[-1]]).all()  # the state at the end, which no belief goes with
    assert (nees[:-1] <= 1.0).mean(axis=0) == pytest.approx([figures["robot_coverage"], figures["people_coverage"]])
    depleted = [figures["robot_depleted_share"], figures["people_depleted_share"]]
    assert (ess[:-1] < DEPLETED).mean(axis=0) == pytest.approx(depleted)
    assert sum(event.name == "recovery" for event in data.events) == figures["recoveries"] > 0
