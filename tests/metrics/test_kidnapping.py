"""Recovery after kidnappings, on made-up runs with exact answers."""

import numpy as np
import pytest

from mjnav.metrics.consistency import recoveries
from mjnav.scene.faults import Faults, Kidnapping

TICKS = 60  # of 0.1 s; the robot stands at x = 0, from tick 20 on at x = 5


def run(trajectory_through, *, wrong, ticks=TICKS, jump=20, turned=()):
    """The believed x is 1 m off in ticks from `wrong[0]` to before `wrong[1]`, and so on; the heading in `turned`."""
    x = np.where(np.arange(ticks + 1) < jump, 0.0, 5.0)
    trajectory = trajectory_through(np.stack([x, np.zeros(ticks + 1)], axis=1))
    for begin, end in wrong:
        trajectory.estimate[begin:end, 0] += 1.0
    for begin, end in turned:
        trajectory.estimate[begin:end, 2] += 2.0 * np.pi - 0.4
    return trajectory


def of(scenario_with, *times):
    kidnap = tuple(Kidnapping(time, (5.0, 0.0, 0.0)) for time in times)
    return scenario_with(faults=Faults(kidnap))


def test_a_run_without_kidnapping_has_no_recovery(trajectory_through, scenario_with):
    assert recoveries(run(trajectory_through, wrong=[]), scenario_with()) is None


@pytest.mark.parametrize(
    ("wrong", "turned", "expected"),
    [
        ([(20, 35)], [], 1.5),
        ([(20, 35), (40, 45)], [], 2.5),  # right for half a second in between, which is not steady
        ([(20, 35), (45, 50)], [], 1.5),  # right for a second, and lost again
        ([(20, 35)], [(35, 41)], 2.1),  # the heading is off by 0.4 rad for longer
        ([(20, 60)], [], None),
        ([(20, 57)], [], 3.7),  # to the end of the run
        ([], [], 0.0),
    ],
)
def test_recovery_counts_to_the_first_steady_second(trajectory_through, scenario_with, wrong, turned, expected):
    found = recoveries(run(trajectory_through, wrong=wrong, turned=turned), of(scenario_with, 2.0))
    assert found == (expected,)


def test_it_counts_from_when_the_robot_is_seen_elsewhere(trajectory_through, scenario_with):
    found = recoveries(run(trajectory_through, wrong=[(25, 30)], jump=25), of(scenario_with, 2.0))
    assert found == (0.5,)


def test_a_kidnapping_that_the_run_does_not_reach_does_not_count(trajectory_through, scenario_with):
    found = recoveries(run(trajectory_through, wrong=[(20, 25)]), of(scenario_with, 2.0, 99.0))
    assert found == (0.5,)


def test_the_next_kidnapping_ends_the_time_to_recover(trajectory_through, scenario_with):
    trajectory = run(trajectory_through, wrong=[(20, 50)])
    trajectory.robot_pose[40:, 0] = -5.0
    trajectory.estimate[40:, 0] = np.where(np.arange(40, TICKS) < 50, 0.0, -5.0)
    found = recoveries(trajectory, of(scenario_with, 2.0, 4.0))
    assert found == (None, 1.0)
