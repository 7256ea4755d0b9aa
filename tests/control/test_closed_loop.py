"""Closed loops of the methods without samples of f, which share no code with `rkhs`: they arrive and touch nothing."""

import numpy as np
import pytest

from mjnav.control import make_controller
from mjnav.messages import RobotLimits


@pytest.fixture(params=["dwa", "mppi", "orca"])
def controller(request):
    return make_controller(request.param, RobotLimits(), 0.1)


@pytest.mark.parametrize("goal", [(4.0, 0.0), (3.0, 3.0), (-3.0, 0.5), (-4.0, 0.0), (0.0, 2.0)])
def test_a_goal_in_the_open_is_reached_wherever_it_lies(drive, controller, goal):
    assert drive(controller, goal, seconds=20.0)[0]


@pytest.mark.parametrize("aside", [-0.3, -0.1, 0.05, 0.2])
def test_a_pillar_at_rest_is_passed(drive, controller, aside):
    reached, clearance = drive(controller, (6.0, 0.0), discs=[((3.0, aside), (0.0, 0.0), 0.3)])
    assert reached
    assert clearance > 0.0


def test_the_way_leads_along_a_wall_and_ends_before_one_that_blocks_it(drive, controller):
    assert drive(controller, (4.0, 0.0), walls=[[[-2.0, 0.4], [8.0, 0.4]]], seconds=15.0)[0]
    reached, clearance = drive(controller, (4.0, 0.0), walls=[[[2.0, -50.0], [2.0, 50.0]]], seconds=20.0)
    assert not reached
    assert clearance > 0.0


def test_mppi_finds_a_gap_in_a_wall(drive):
    walls = np.array([[[2.5, -3.0], [2.5, 0.3]], [[2.5, 1.3], [2.5, 3.0]]])
    reached, clearance = drive(make_controller("mppi", RobotLimits(), 0.1), (5.0, 0.0), walls=walls)
    assert reached
    assert clearance > 0.0
