from dataclasses import replace

import numpy as np
import pytest

from mjnav.metrics import progress as arrival
from mjnav.scene.spec import Person, Waypoints
from tests.metrics.conftest import make_scenario, make_trajectory


def walker(*waypoints, loop=False):
    return Person((0.0, 0.0), Waypoints(waypoints, loop=loop))


def test_waypoints_are_passed_in_their_order_also_between_two_ticks():
    along = np.column_stack([[0.0, 1.0, 2.0, 3.0, 4.0, 3.0], np.zeros(6)])
    assert arrival.passings(walker((1.5, 0.1), (4.0, 0.0), (3.1, 0.0)), along).tolist() == [2, 4, 5]
    assert arrival.passings(walker((3.0, 0.0), (1.0, 0.0)), along).tolist() == [3]  # it never comes back that far
    assert arrival.passings(walker((2.0, 0.5)), along).tolist() == []


def test_a_route_that_loops_is_walked_round_and_round():
    to_and_fro = np.column_stack([[0.0, 1.0, 2.0, 1.0, 0.0, 1.0, 2.0], np.zeros(7)])
    assert arrival.passings(walker((2.0, 0.0), (0.0, 0.0), loop=True), to_and_fro).tolist() == [2, 4, 6]


def test_who_is_not_there_passes_nothing():
    along = np.column_stack([[np.nan, np.nan, 2.0, 3.0, np.nan], [np.nan, np.nan, 0.0, 0.0, np.nan]])
    assert arrival.passings(walker((2.0, 0.0), (3.0, 0.0), (4.0, 0.0)), along).tolist() == [2, 3]


def test_the_times_of_all_are_added_once_all_have_arrived():
    scenario = replace(make_scenario(), people=(walker((2.0, 0.0)), walker((9.0, 0.0), (3.0, 0.0), loop=True)))
    people = np.zeros((5, 2, 2))
    people[:, 0, 0] = [0.0, 1.0, 2.0, 2.0, 2.0]
    trajectory = make_trajectory(np.zeros((5, 2)), people=people)
    assert arrival.aggregated_time(trajectory, scenario, outcome="goal") == pytest.approx(0.4 + 0.2)
    assert arrival.aggregated_time(trajectory, scenario, outcome="timeout") is None
    still = make_trajectory(np.zeros((5, 2)), people=np.zeros((5, 2, 2)))
    assert arrival.aggregated_time(still, scenario, outcome="goal") is None
    assert arrival.aggregated_time(trajectory, make_scenario(num_people=2), outcome="goal") is None
