"""The worst moments of runs that were made to have them."""

from dataclasses import replace

import numpy as np
import pytest

from mjnav.log.read.ticks import LoggedRun
from mjnav.messages import PHASES, Contact
from mjnav.report.worst_moments import worst_moments
from tests.metrics.conftest import make_scenario, make_trajectory

TICKS = 40


def make_run(*, ticks=None, timing=None, **changes) -> LoggedRun:
    """Four seconds along the x axis in which nothing is wrong but what `changes` say of the trajectory."""
    route = np.column_stack([np.linspace(0.0, 4.0, TICKS + 1), np.zeros(TICKS + 1)])
    trajectory = make_trajectory(route)
    trajectory = replace(trajectory, **{"estimate": trajectory.robot_pose[:-1], "status": ("ok",) * TICKS, **changes})
    return LoggedRun(
        trajectory,
        ticks=np.arange(TICKS + 1) if ticks is None else ticks,
        timing=np.zeros((0, len(PHASES) + 2), np.int64) if timing is None else timing,
        deadline_misses=0,
    )


def only(kind, moments):
    (found,) = (moment for moment in moments if moment.kind == kind)
    return found


def test_the_closest_approach_names_the_body_and_the_step():
    from mjnav.scene.spec import Pillar

    scenario = replace(make_scenario(), pillars=(Pillar((1.55, 0.9)), Pillar((3.05, -0.7))))
    moment = only("clearance", worst_moments(make_run(), scenario))
    radius = scenario.pillars[1].radius + scenario.robot.radius
    assert moment.value == pytest.approx(0.7 - radius)
    assert (moment.tick, moment.time_s) == (30, pytest.approx(make_run().trajectory.time[30]))
    assert moment.text.endswith("from pillar1")


def test_the_longest_infeasible_stretch_ends_where_ticks_are_missing():
    status = ["ok"] * TICKS
    for row in (3, 4, 5, 10, 11, 12, 13, 30):
        status[row] = "infeasible" if row % 2 else "infeasible_nominal"
    run = make_run(status=tuple(status))
    moment = only("infeasible", worst_moments(run, make_scenario()))
    assert (moment.tick, moment.value) == (10, pytest.approx(4 * make_scenario().control.period))
    gap = np.arange(TICKS + 1) + 5 * (np.arange(TICKS + 1) >= 12)
    moment = only("infeasible", worst_moments(make_run(status=tuple(status), ticks=gap), make_scenario()))
    assert (moment.tick, moment.text) == (3, "for 3 ticks no control met the constraints")


def test_the_longest_and_the_latest_tick_say_how_long_and_by_which_phase():
    timing = np.zeros((TICKS, len(PHASES) + 2), np.int64)
    timing[:, 0] = np.arange(TICKS)
    timing[:, 1 : 1 + len(PHASES)] = 200_000
    timing[7, 1 + PHASES.index("control")] = 9_000_000
    timing[8, -1] = 3_000_000
    moments = worst_moments(make_run(timing=timing), make_scenario())
    longest, latest = only("tick", moments), only("lateness", moments)
    assert (longest.tick, longest.value) == (7, pytest.approx(9.8))
    assert longest.text == "took 9.80 ms, most of all control 9.00 ms"
    assert (latest.tick, latest.value, latest.unit) == (8, pytest.approx(3.0), "ms")


def test_estimates_furthest_off_and_fewest_particles_are_found():
    run = make_run()
    estimate = run.trajectory.estimate.copy()
    estimate[17, 1] += 0.3
    ess = np.full(TICKS, 400.0)
    ess[25] = 3.0
    moments = worst_moments(make_run(estimate=estimate, robot_ess=ess), make_scenario())
    assert (only("localization", moments).tick, only("localization", moments).value) == (17, pytest.approx(0.3))
    assert (only("ess", moments).tick, only("ess", moments).value) == (25, 3.0)


def test_the_hardest_contact_comes_first_and_clearance_then_says_nothing_new():
    contacts = (Contact("table", "table0", 5.0, 0.55), Contact("wall", "wall1", 80.0, 1.23))
    moments = worst_moments(make_run(contacts=contacts), make_scenario())
    assert (moments[0].kind, moments[0].time_s, moments[0].text) == (
        "contact",
        1.23,
        "the robot touches wall1 with 80 N",
    )
    assert "clearance" not in [moment.kind for moment in moments]
