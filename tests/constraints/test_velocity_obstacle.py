from math import cos, hypot, inf, nan, pi, sin

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from mjnav.constraints.velocity_obstacle import velocity_obstacle_exits
from mjnav.errors import InvalidValue

VECTOR = st.tuples(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0))
RADIUS, HORIZON = st.floats(0.05, 1.5), st.floats(0.5, 6.0)
PERIOD = 0.1


def exit_of(r, q, radius, horizon):
    normal, depth = velocity_obstacle_exits([r], [q], [radius], horizon, PERIOD)
    return normal[0], float(depth[0])


def margin(w, r, radius, horizon):
    """Least distance in the horizon at relative velocity w, less R."""
    ww = w[0] ** 2 + w[1] ** 2
    t = min(max((w[0] * r[0] + w[1] * r[1]) / ww, 0.0), horizon) if ww > 0.0 else 0.0
    return hypot(t * w[0] - r[0], t * w[1] - r[1]) - radius


@given(VECTOR, VECTOR, RADIUS, HORIZON, st.floats(0.0, 5.0), st.floats(-5.0, 5.0))
def test_whatever_obeys_the_half_plane_keeps_clear_for_the_horizon(r, q, radius, horizon, beyond, aside):
    assume(hypot(*r) > radius)
    n, depth = exit_of(r, q, radius, horizon)
    w = np.array(q) + (depth + beyond) * n + aside * np.array([-n[1], n[0]])
    t = np.linspace(0.0, horizon, 301)
    assert np.hypot(t * w[0] - r[0], t * w[1] - r[1]).min() >= radius - 1e-7


@given(VECTOR, VECTOR, RADIUS, HORIZON)
def test_no_smaller_change_of_velocity_enters_or_leaves_the_obstacle(r, q, radius, horizon):
    assume(hypot(*r) > radius + 1e-3)
    n, depth = exit_of(r, q, radius, horizon)
    assume(abs(depth) > 1e-3)
    assert hypot(*n) == pytest.approx(1.0)
    assert (margin(q, r, radius, horizon) < 0.0) == (depth > 0.0)
    for angle in np.arange(0.0, 2.0 * pi, pi / 60.0):
        near = (q[0] + 0.999 * depth * cos(angle), q[1] + 0.999 * depth * sin(angle))
        # Tips of the circle come within rounding of the boundary.
        assert margin(near, r, radius, horizon) * depth < 1e-9
    across = np.array(q) + depth * n
    assert margin(across, r, radius, horizon) == pytest.approx(0.0, abs=1e-6)


@given(VECTOR, st.floats(0.05, 1.0), st.floats(0.0, 0.99), st.floats(-pi, pi))
@example((0.0, 1.0), 0.5, 1.0, 0.0)  # they touch
def test_what_overlaps_parts_within_one_period(q, radius, share, angle):
    r = (share * radius * cos(angle), share * radius * sin(angle))
    n, depth = exit_of(r, q, radius, 3.0)
    w = np.array(q) + depth * n
    assert hypot(PERIOD * w[0] - r[0], PERIOD * w[1] - r[1]) == pytest.approx(radius)


def test_exact_answers():
    # A robot at rest before a disc at rest may drive at it at (4 - 1) / 2 m/s.
    n, depth = exit_of((4.0, 0.0), (0.0, 0.0), 1.0, 2.0)
    assert (tuple(n), depth) == ((-1.0, 0.0), -1.5)
    # Fast and just left of the middle it leaves by the left leg, 30 degrees off the line between the centres.
    n, depth = exit_of((2.0, 0.0), (10.0, 0.01), 1.0, 2.0)
    assert n == pytest.approx([-sin(pi / 6), cos(pi / 6)])
    assert depth == pytest.approx(10.0 * sin(pi / 6) - 0.01 * cos(pi / 6))
    n, depth = exit_of((2.0, 0.0), (10.0, -0.01), 1.0, 2.0)
    assert n == pytest.approx([-sin(pi / 6), -cos(pi / 6)])


@pytest.mark.parametrize("angle", [0.0, pi / 2, pi, -pi / 2])
def test_two_that_drive_straight_at_one_another_both_keep_to_the_right(angle):
    ahead = np.array([round(cos(angle)), round(sin(angle))])
    n, _ = exit_of(2.0 * ahead, 10.0 * ahead, 1.0, 2.0)
    right = np.array([ahead[1], -ahead[0]])
    assert n @ right == pytest.approx(cos(pi / 6))


def test_where_no_direction_is_the_nearest_one_is_taken_all_the_same():
    n, depth = exit_of((0.0, 0.0), (0.0, 0.0), 0.5, 3.0)
    assert (tuple(n), depth) == ((-1.0, 0.0), 5.0)
    n, depth = exit_of((0.0, 0.25), (0.0, 2.5), 0.5, 3.0)  # q is the middle of the disc of one period
    assert n == pytest.approx([0.0, -1.0])
    assert depth == pytest.approx(5.0)
    n, depth = exit_of((0.1875, 0.25), (1.875, 2.5), 0.5, 3.0)
    assert n == pytest.approx([-0.6, -0.8])
    assert depth == pytest.approx(5.0)


def test_no_obstacles_no_half_planes():
    normal, depth = velocity_obstacle_exits(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0), 3.0, PERIOD)
    assert (normal.shape, depth.shape) == ((0, 2), (0,))


@pytest.mark.parametrize("value", [0.0, -1.0, inf, nan])
@pytest.mark.parametrize("key", ["horizon", "period"])
def test_times_that_are_none_are_refused(key, value):
    times = {"horizon": 3.0, "period": 0.1, key: value}
    with pytest.raises(InvalidValue, match=f"{key}: found"):
        velocity_obstacle_exits([(1.0, 0.0)], [(0.0, 0.0)], [0.3], **times)
