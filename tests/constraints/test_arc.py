from math import hypot, inf, pi, sqrt

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from mjnav.constraints.arc import contact_distance, contact_distance_moving

STEPS = 4000
LONGEST = 5.0  # [m] of way that is stepped
# [m] In whole centimetres: steps cannot tell whether what overlaps and lies abeam to 1e-9 m comes nearer at first.
COORDINATE = st.integers(-200, 200).map(lambda centimetres: centimetres / 100.0)
PLACE = st.tuples(COORDINATE, COORDINATE)
SPEED = st.one_of(st.floats(0.05, 1.0), st.floats(-1.0, -0.05))
TURN = st.one_of(st.floats(-1.5, 1.5), st.sampled_from([0.0, 1e-12, -1e-9, 1e-6, -1e-4]))
RADIUS = st.floats(0.05, 0.8)
NOTHING = np.zeros((0, 3)), np.zeros((0, 5)), np.zeros((0, 4))


def to_disc(v, omega, x, y, radius):
    return float(contact_distance([v], [omega], [[x, y, radius]], *NOTHING[1:])[0, 0])


def to_wall(v, omega, start, end, radius):
    return float(contact_distance([v], [omega], NOTHING[0], [[*start, *end, radius]], NOTHING[2])[0, 0])


def to_line(v, omega, normal, e, radius):
    return float(contact_distance([v], [omega], *NOTHING[:2], [[*normal, e, radius]])[0, 0])


def stepped(v, omega, distance, radius):
    """The first way at which `distance` of the position falls below R, or shrinks from below R; the ways stepped."""
    longest = min(LONGEST, 0.999 * 2.0 * pi * abs(v / omega)) if omega != 0.0 else LONGEST
    t = np.linspace(0.0, longest / abs(v), STEPS)
    half = 0.5 * omega * t  # the chord's direction
    chord = v * t * np.sinc(half / pi)
    d = distance(chord * np.cos(half), chord * np.sin(half))
    assume(d[0] > 1e-3)  # in the very middle of what it overlaps, every direction leads out
    near = min(radius, d[0])
    assume(abs(d.min() - near) > 1e-4 or d.argmin() == 0)  # whether a graze is a contact, steps cannot tell
    touching = np.flatnonzero(d[1:] < near - 1e-9)
    return (abs(v) * t[touching[0]] if len(touching) else inf), longest


def assert_agrees(found, reference):
    expected, longest = reference
    if expected == inf:
        assert found >= longest * (1.0 - 1e-6)
    else:
        # A contact at a shallow angle to what is touched is seen late by steps.
        assert expected - 1e-6 <= found <= expected + 2.0 * longest / STEPS + 1e-6


@given(SPEED, TURN, PLACE, RADIUS)
def test_the_way_to_a_disc_is_that_of_small_steps(v, omega, place, radius):
    x, y = place
    found = to_disc(v, omega, x, y, radius)
    assert_agrees(found, stepped(v, omega, lambda px, py: np.hypot(px - x, py - y), radius))


@given(SPEED, TURN, PLACE, PLACE, RADIUS)
def test_the_way_to_a_wall_is_that_of_small_steps(v, omega, start, end, radius):
    (ax, ay), (wx, wy) = start, (end[0] - start[0], end[1] - start[1])
    assume(hypot(wx, wy) > 1e-3)

    def distance(px, py):
        s = np.clip(((px - ax) * wx + (py - ay) * wy) / (wx * wx + wy * wy), 0.0, 1.0)
        return np.hypot(px - ax - s * wx, py - ay - s * wy)

    assert_agrees(to_wall(v, omega, start, end, radius), stepped(v, omega, distance, radius))


@given(SPEED, TURN, st.floats(-pi, pi), st.floats(0.01, 2.0), RADIUS)
def test_the_way_to_a_line_is_that_of_small_steps(v, omega, angle, e, radius):
    m = np.cos(angle), np.sin(angle)
    found = to_line(v, omega, m, e, radius)
    assert_agrees(found, stepped(v, omega, lambda px, py: m[0] * px + m[1] * py + e, radius))


@given(SPEED, PLACE, RADIUS)
def test_the_straight_line_is_the_limit_of_the_arcs(v, place, radius):
    assume(abs(abs(place[1]) - radius) > 1e-3)  # a graze has no limit
    x, y = place
    straight = to_disc(v, 0.0, x, y, radius)
    for omega in (1e-15, -1e-15, 1e-11, -1e-11):
        bent = to_disc(v, omega, x, y, radius)
        assert bent == pytest.approx(straight, abs=1e-6) if straight < inf else bent > 1e6


def test_exact_answers():
    assert to_disc(1.0, 0.0, 3.0, 0.0, 1.0) == 2.0
    assert to_disc(0.2, 0.0, 3.0, 0.6, 1.0) == pytest.approx(3.0 - 0.8)
    assert to_disc(-1.0, 0.0, -3.0, 0.0, 1.0) == 2.0
    assert to_disc(1.0, 0.0, -3.0, 0.0, 1.0) == inf
    assert to_disc(1.0, 0.0, 3.0, 1.5, 1.0) == inf
    # A quarter of the circle of radius 1 about (0, 1) ends at (1, 1), heading up.
    assert to_wall(1.0, 1.0, (-5.0, 1.5), (5.0, 1.5), 0.5) == pytest.approx(pi / 2)
    assert to_wall(1.0, -1.0, (-5.0, -1.5), (5.0, -1.5), 0.5) == pytest.approx(pi / 2)
    assert to_wall(1.0, 0.0, (2.0, -1.0), (2.0, 1.0), 0.5) == pytest.approx(1.5)
    assert to_wall(1.0, 0.0, (2.0, -0.3), (2.0, 0.3), 0.1) == pytest.approx(1.9)  # short, between its ends
    assert to_wall(1.0, 0.0, (2.0, 0.3), (2.0, 1.0), 0.5) == pytest.approx(2.0 - 0.4)  # its end
    assert to_wall(1.0, 0.0, (2.0, 0.0), (4.0, 0.0), 0.5) == pytest.approx(1.5)
    assert to_line(1.0, 0.0, (-1.0, 0.0), 2.0, 0.5) == 1.5
    assert to_line(0.5, 0.0, (-sqrt(0.5), sqrt(0.5)), 2.0, 0.5) == pytest.approx(1.5 * sqrt(2.0))
    assert to_line(1.0, 0.0, (0.0, 1.0), 2.0, 0.5) == inf


def test_a_robot_that_touches_already_may_leave_but_come_no_nearer():
    assert to_disc(1.0, 0.0, 0.3, 0.1, 0.5) == 0.0
    assert to_disc(1.0, 0.0, -0.3, 0.1, 0.5) == inf
    assert to_disc(1.0, 1.0, -0.3, 0.1, 0.5) > pi  # nearly all the way round
    assert to_disc(1.0, 0.5, 0.0, 0.0, 0.5) == inf
    for side in (-1.0, 1.0):
        wall = (-3.0, side * 0.3), (3.0, side * 0.3)
        assert to_wall(1.0, 0.0, *wall, 0.5) == inf  # along it
        assert to_wall(1.0, 0.1 * side, *wall, 0.5) == 0.0
        assert to_wall(1.0, -0.1 * side, *wall, 0.5) > 10.0
        line = (0.0, -side)
        for e in (0.3, -0.3):
            assert to_line(1.0, 0.0, line, e, 0.5) == inf
            assert to_line(1.0, 0.1 * side, line, e, 0.5) == 0.0
            assert to_line(1.0, -0.1 * side, line, e, 0.5) == inf


def test_a_robot_that_turns_on_the_spot_touches_nothing():
    for v in (0.0, 1e-300, -1e-17):
        for omega in (0.0, 1.0):
            assert to_disc(v, omega, 0.1, 0.0, 0.5) == inf
    assert to_disc(1e-9, 0.0, 2.0, 0.0, 0.5) == 1.5  # from STANDSTILL on it drives


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_an_arc_meets_a_wall_only_between_its_ends_and_else_the_end_that_is_nearer(side):
    # A quarter of the circle of radius 2 ends at (2, 2), 0.5 m before the wall's line.
    for end in (1.9, 1.0, 2.0):
        assert to_wall(1.0, side * 0.5, (end, side * 2.5), (5.0, side * 2.5), 0.5) == pytest.approx(pi)
    beyond = to_wall(1.0, side * 0.5, (2.1, side * 2.5), (5.0, side * 2.5), 0.5)
    assert beyond == to_disc(1.0, side * 0.5, 2.1, side * 2.5, 0.5)
    assert beyond != pytest.approx(pi)


@given(SPEED, st.floats(-1.5, 1.5), PLACE, st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), RADIUS)
def test_a_disc_that_moves_is_met_where_it_is_then(v, omega, place, vx, vy, radius):
    assume(hypot(*place) > radius + 1e-3)
    times = 0.01 * np.arange(1, 301)
    way = contact_distance_moving(
        np.array([v]), np.array([omega]), np.array([[*place, radius]]), np.array([[vx, vy]]), times
    )
    heading = omega * times
    x, y = (np.cumsum(v * 0.01 * turn(heading - 0.005 * omega)) for turn in (np.cos, np.sin))
    gap = np.hypot(place[0] + vx * times - x, place[1] + vy * times - y) - radius
    assume(np.abs(gap).min() > 1e-3)
    met = np.flatnonzero(gap < 0.0)
    assert way[0, 0] == (pytest.approx(abs(v) * (times[met[0]] - 0.01)) if len(met) else inf)


def test_columns_are_discs_then_walls_then_lines():
    discs = [[2.0, 0.0, 0.5], [3.0, 0.0, 0.5]]
    walls = [[4.0, -1.0, 4.0, 1.0, 0.5], [5.0, -1.0, 5.0, 1.0, 0.5], [6.0, -1.0, 6.0, 1.0, 0.5]]
    lines = [[-1.0, 0.0, 7.0, 0.5], [-1.0, 0.0, 8.0, 0.5]]
    ways = contact_distance([1.0, 0.5], [0.0, 0.0], discs, walls, lines)
    assert ways == pytest.approx(np.tile([1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5], (2, 1)))
    assert contact_distance([1.0], [0.0], *NOTHING).shape == (1, 0)
