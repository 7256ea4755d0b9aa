"""Metrics of a user's own: what they give stands under their names, and what goes wrong in one ends no run."""

import json
import pickle
from math import inf, nan

import numpy as np
import pyarrow as pa
import pytest

import mjnav
from mjnav.errors import InvalidValue
from mjnav.metrics import Figure
from mjnav.study.cells import Cell
from mjnav.study.compare.cell_rows import cell_rows
from mjnav.study.compare.study_comparison import compare
from mjnav.study.store import Row

QUICK = {"physics.engine": "kinematic", "time_limit": 0.3}


def figures_named(*names):
    return {name: Figure("", f"The figure {name}.") for name in names}


class Duration:
    figures = figures_named("ticks", "nothing")

    def measure(self, trajectory, scenario):
        return {"ticks": np.int64(len(trajectory.status)), "nothing": None}


class Raises:
    figures = figures_named("raised")

    def measure(self, trajectory, scenario):
        raise ValueError("no figure today")


class Wrong:
    figures = figures_named("nan", "infinite", "text", "truth", "absent")

    def measure(self, trajectory, scenario):
        return {"nan": nan, "infinite": inf, "text": "1", "truth": True, "other": 1.0}


class Writes:
    figures = figures_named("written")

    def measure(self, trajectory, scenario):
        trajectory.robot_pose[:] = 0.0
        return {"written": 1.0}


def test_figures_stand_in_the_summary_under_their_names():
    result = mjnav.run(mjnav.load_scenario("crossing1", QUICK), metrics=[Duration])
    assert result.summary["metrics"] == {"ticks": 3.0, "nothing": None}
    assert result.metrics.faults == ()
    assert pickle.loads(pickle.dumps(result)).summary == result.summary
    with mjnav.Simulation(mjnav.load_scenario("crossing1", QUICK), metrics=[Duration()]) as simulation:
        simulation.step(0.1, 0.0)
        assert simulation.summary["metrics"]["ticks"] == 1.0
        assert simulation.copy().summary["metrics"]["ticks"] == 1.0


def test_a_metric_that_fails_is_null_and_an_event_and_the_run_goes_on(tmp_path):
    scenario = mjnav.load_scenario("crossing1", QUICK | {"metrics": [Duration, Raises, Wrong, Writes]})
    result = mjnav.run(scenario, log=tmp_path / "a.mcap")
    assert result.summary["outcome"] == "timeout"
    values = json.loads(json.dumps(result.summary["metrics"], allow_nan=False))
    assert {name for name, value in values.items() if value is not None} == {"ticks"}
    assert len(result.metrics.faults) == 1 + 6 + 1
    events = [m.value for m in mjnav.open_log(tmp_path / "a.mcap").messages("/events")]
    assert tuple(event.message for event in events if event.name == "metric") == result.metrics.faults
    assert any("ValueError: no figure today" in fault and "test_own.py" in fault for fault in result.metrics.faults)


class NoMapping:
    figures = figures_named("none")

    def measure(self, trajectory, scenario):
        return None


def test_a_metric_that_returns_no_mapping_is_told_so():
    result = mjnav.run(mjnav.load_scenario("crossing1", QUICK), metrics=[NoMapping])
    assert result.metrics.faults == (f"{__name__}:NoMapping: measure() returned None in place of a mapping",)


class NoFigures:
    def measure(self, trajectory, scenario):
        return {}


@pytest.mark.parametrize(
    ("metrics", "found"),
    [([Duration, Duration], "different names"), ([NoFigures], "figures"), ([3], "metrics.0"), (["here"], "metrics.0")],
)
def test_what_is_no_metric_is_refused_before_the_run(metrics, found):
    with pytest.raises(InvalidValue, match=found):
        mjnav.load_scenario("crossing1", QUICK, metrics=metrics)


def test_a_table_compares_a_metric_as_it_does_other_figures():
    rows = [_row(method, seed, seed + 10.0 * (method == "b")) for method in "ab" for seed in range(4)]
    columns = ("scene", "setting", "method", "seed", "metrics", "success", "ticks", "infeasible_ticks")
    columns = (*columns, *(f"collisions_{kind}" for kind in ("person", "table", "wall", "pillar")))
    others = {"compute_ms_control_p50": 1.0, "compute_ms_control_p99": 2.0, "time_s": 3.0}
    values = [row.values() | others for row in rows]
    table = pa.table({name: [one[name] for one in values] for name in (*columns, *others)})
    (comparison,) = compare(cell_rows(table), figures=["metrics_gap"])
    first, second = comparison.rows
    assert (first.figures["metrics_gap"].value, second.figures["metrics_gap"].value) == (1.5, 11.5)
    assert second.differences["metrics_gap"].estimate.value == 10.0


def _row(method, seed, gap):
    cell = Cell("s", "default", method, "rkhs", "{}", "")
    figures = {"success": True, "ticks": 1, "infeasible_ticks": 0}
    figures |= {f"collisions_{kind}": 0 for kind in ("person", "table", "wall", "pillar")}
    named = {
        name: getattr(cell, name) for name in ("scene", "setting", "method", "controller", "parameters", "control")
    }
    origin = {"machine": "", "revision": "", "wall_s": 1.0, "made_with": {}, "figures": figures}
    return Row(id="", study="", seed=seed, scenario="", metrics=json.dumps({"gap": gap}), **named, **origin)
