"""Guides lead where they are to lead, within the robot's limits."""

from math import cos, pi, sin

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mjnav.control.problem.fan import guided, guides
from mjnav.control.rollouts import ControlLimits, Rollouts
from mjnav.geometry.floor import Floor
from mjnav.geometry.way_field import WayField
from mjnav.messages import RobotLimits

STEP, PERIOD = 0.2, 0.1
EMPTY = Floor(np.zeros((0, 3)), np.zeros((0, 6)))
headings = st.floats(-pi, pi)
goals = st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))


def controls(rows, pose, goal, limits, steps, twist=(0.0, 0.0)):
    """Of guides (G, 4), and where they lead."""
    way = WayField.of(EMPTY, goal, 0.25).grid
    within = ControlLimits.of(np.array(twist), limits, PERIOD, STEP)
    found = guided(np.array(rows, float), np.array(pose), way, within, 1.0, 0.4, STEP, steps)
    return found, Rollouts.of(found, pose[2], within, STEP)


@given(st.sampled_from([0.8, 1.6, 2.4]), headings, goals)
def test_a_waiting_guide_stands_as_long_as_it_waits_and_then_goes(wait, heading, goal):
    found, r = controls([(wait, 0.0, 0.0, 0.8)], (0.0, 0.0, heading), goal, RobotLimits(), 80)
    waits = round(wait / STEP)
    assert not found[:, :waits].any()
    if np.hypot(*goal) > 0.1:
        assert found[:, waits].any()
        assert np.hypot(goal[0] - r.x[-1, 0], goal[1] - r.y[-1, 0]) < 0.05


@given(headings, st.floats(-0.5, 0.5))
def test_a_reversing_guide_backs_off(heading, aside):
    back = [(0.0, 2.8, heading + pi + aside, -0.5)]
    found, r = controls(back, (0.0, 0.0, heading), (4.0, 1.0), RobotLimits(min_speed=-0.5), 14)
    assert (found[0] <= 0.0).all()
    along = r.x[-1, 0] * cos(heading + pi + aside) + r.y[-1, 0] * sin(heading + pi + aside)
    assert 0.8 < along <= 1.4


def test_what_lies_straight_behind_is_turned_to_on_the_left_whatever_the_last_bit_of_the_heading():
    for heading in np.random.default_rng(0).uniform(-pi, pi, 200):
        behind = [(0.0, 2.8, heading + turns * pi, 0.5) for turns in (-3.0, -1.0, 1.0)]
        found, _ = controls(behind, (0.0, 0.0, heading), (4.0, 1.0), RobotLimits(), 4)
        assert (found[1, 0] > 0.0).all()


@settings(max_examples=30)
@given(headings, goals, st.tuples(st.floats(-0.5, 1.0), st.floats(-1.5, 1.5)), st.sampled_from([0.0, 0.5]))
def test_every_guide_is_within_the_limits(heading, goal, twist, back):
    limits = RobotLimits(min_speed=-back, max_acceleration=0.7, max_turn_acceleration=1.3)
    rows = guides(heading, heading + 1.0, 0.8, back)
    assert len(rows) == 1 + 42 + 3 + 24 + (10 if back else 0)
    found, driven = controls(rows, (0.0, 0.0, heading), goal, limits, 12, (max(twist[0], -back), twist[1]))
    assert np.abs(driven.controls - found).max() < 1e-12
