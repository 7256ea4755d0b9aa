from dataclasses import replace

import numpy as np
import pytest

from mjnav.metrics.social import Detour, detour
from mjnav.scene.spec import ConstantVelocity, Person, Waypoints
from tests.metrics.conftest import make_scenario, make_trajectory


def compared(people, with_robot, without):
    """The detour of people who are at these places (T + 1, P, 2) with the robot and without it."""
    scenario = replace(make_scenario(), people=tuple(people))
    with_robot = np.asarray(with_robot, float)
    return detour(
        make_trajectory(np.zeros((len(with_robot), 2)), people=with_robot), np.asarray(without, float), scenario
    )


def test_the_way_round_the_robot_by_hand():
    walker = Person((0.0, 0.0), Waypoints(((2.0, 0.0),), loop=False))
    without = [[0, 0], [1, 0], [2, 0], [2, 0], [2, 0]]
    round_it = [[0, 0], [0, 1], [1, 1], [2, 1], [2, 0]]
    found = compared([walker], np.array(round_it)[:, None], np.array(without)[:, None])
    assert (found.path_m, found.delay_s) == pytest.approx((4.0 - 2.0, 0.2))
    assert found.displacement_m == pytest.approx((0.0 + np.sqrt(2.0) + np.sqrt(2.0) + 1.0 + 0.0) / 5.0)


def test_a_route_is_compared_up_to_the_last_waypoint_reached_in_both():
    walker = Person((0.0, 0.0), Waypoints(((1.0, 0.0), (2.0, 0.0), (4.0, 0.0)), loop=False))
    without = np.column_stack([[0.0, 1.0, 2.0, 3.0, 4.0], np.zeros(5)])
    held_up = np.column_stack([[0.0, 0.5, 1.0, 1.5, 2.0], np.zeros(5)])
    found = compared([walker], held_up[:, None], without[:, None])
    assert (found.path_m, found.delay_s) == pytest.approx((0.0, 0.2))


def test_without_waypoints_only_the_places_are_compared_and_only_while_they_are_there_in_both():
    walker = Person((0.0, 0.0), ConstantVelocity((1.0, 0.0)))
    nobody = [np.nan, np.nan]
    without = np.array([nobody, [0, 0], [1, 0], nobody, [5, 5]])[:, None]
    pushed = np.array([nobody, [0, 0], [1, 0.5], [2, 0.5], [3, 0.5]])[:, None]
    assert compared([walker], pushed, without) == Detour(None, None, 0.25)


def test_nobody_has_none():
    assert compared([], np.zeros((3, 0, 2)), np.zeros((3, 0, 2))) == Detour()
