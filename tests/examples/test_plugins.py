"""The examples of plug-ins: each runs as its first lines say, and the same seed ends in the same result."""

from pathlib import Path

import numpy as np
import pytest

import mjnav
from mjnav.metrics import OwnMetrics

EXAMPLES = Path(__file__).parents[2] / "examples"
QUICK = {"physics.engine": "kinematic", "time_limit": 2.0}
RUNS = {
    "controller": ("crossing1", {"controller": f"{EXAMPLES}/controller/worst_case.py:WorstCase"}),
    "localizer": ("crossing1", {"localizer": f"{EXAMPLES}/localizer/dead_reckoning.py:DeadReckoning"}),
    "tracker": ("crossing1", {"tracker": f"{EXAMPLES}/tracker/alpha_beta.py:AlphaBeta"}),
    "localizer by scans": ("table", {"localizer": f"{EXAMPLES}/localizer/scan_fit.py:ScanFit"}),
    "tracker by scans": ("crossing1", {"tracker": f"{EXAMPLES}/tracker/nearest_return.py:NearestReturn"}),
    "predictor": ("crossing1", {"overrides": {**QUICK, "prediction.model": f"{EXAMPLES}/predictor/arcs.py:Arcs"}}),
    "behaviour": (EXAMPLES / "behaviour" / "wander.toml", {}),
    "distribution": (EXAMPLES / "distribution" / "laplace.toml", {}),
}


@pytest.mark.parametrize("kind", RUNS)
def test_an_example_runs_and_its_log_is_replayed_where_it_is_trusted(kind, tmp_path):
    scene, own = RUNS[kind]
    scenario = mjnav.load_scenario(scene, **{"overrides": QUICK, **own})
    result = mjnav.run(scenario, seed=1, log=tmp_path / "a.mcap")
    plain = mjnav.run(mjnav.load_scenario("crossing1", QUICK), seed=1)
    assert result.summary["ticks"] == 20
    assert result.summary["state_hash"] != plain.summary["state_hash"]
    log = mjnav.open_log(tmp_path / "a.mcap")
    assert log.run["sources.controller"].count(".py") == 1  # the file of the example, and no other
    with pytest.raises(mjnav.errors.InputError, match="code that a replay imports and runs: trust=True allows it"):
        mjnav.replay(log)
    assert mjnav.replay(log, trust=True).identical


def test_figures_of_the_metric_are_the_same_from_the_log_and_nothing_imports_it_unasked(tmp_path):
    scenario = mjnav.load_scenario("crossing1", QUICK, metrics=[f"{EXAMPLES}/metric/personal_space.py:PersonalSpace"])
    result = mjnav.run(scenario, seed=1, log=tmp_path / "a.mcap")
    plain = mjnav.run(mjnav.load_scenario("crossing1", QUICK), seed=1)
    assert result.summary["state_hash"] == plain.summary["state_hash"]
    found, t = result.summary["metrics"], result.trajectory
    apart = np.hypot(*(t.people_position[:, 0] - t.robot_pose[:, :2]).T)
    assert found["personal_space_s"] == 0.0
    assert found["closest_speed_m_s"] == t.robot_twist[apart.argmin(), 0]
    log = mjnav.open_log(tmp_path / "a.mcap")
    assert log.result["metrics"] == found
    assert OwnMetrics(log.scenario()).measured(log.trajectory()).values == pytest.approx(found, rel=1e-9)
    assert "personal_space.py" in log.run["sources.controller"]
    untrusted = mjnav.replay(log)
    assert untrusted.identical
    assert "its own metrics, which are code, were left out" in untrusted.warnings
    assert mjnav.replay(log, trust=True).identical
