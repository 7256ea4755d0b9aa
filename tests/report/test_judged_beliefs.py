"""What inspection says of each belief adds up to the figures of the run."""

import numpy as np
import pytest

import mjnav
from mjnav import load_scenario
from mjnav.metrics.summary import summarise
from mjnav.report.inspection import judged_beliefs


def test_the_figures_of_the_run_are_those_of_its_bodies():
    keys = [
        "physics.engine=kinematic",
        "time_limit=3",
        "estimation.robot.filter=ekf",
        "estimation.obstacles.source=direct",
    ]
    scenario = load_scenario("crossing3", keys, seed=2)
    trajectory = mjnav.run(scenario, log=False).trajectory
    figures = summarise(trajectory, scenario, outcome="timeout")
    robot, *people = judged_beliefs(trajectory, scenario)
    assert [(one.body, one.by) for one in (robot, *people)] == [
        ("robot", "pose, ekf"),
        *((f"person{i}", "direct") for i in range(3)),
    ]
    assert (robot.nees, robot.coverage, robot.rmse_m) == (
        figures["robot_nees"],
        figures["robot_coverage"],
        figures["localization_rmse_m"],
    )
    assert sum(one.ticks for one in people) == 3 * len(trajectory.status)
    assert figures["people_nees"] == pytest.approx(np.mean([one.nees or 0.0 for one in people]))
    assert figures["people_coverage"] == pytest.approx(np.mean([one.coverage or 0.0 for one in people]))
    assert figures["tracking_rmse_m"] == pytest.approx(np.sqrt(np.mean([(one.rmse_m or 0.0) ** 2 for one in people])))
    assert figures["ess_min"] == {"robot": robot.ess_min, "people": min(one.ess_min for one in people)}
