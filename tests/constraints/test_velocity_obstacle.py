from itertools import combinations
from math import cos, hypot, pi, sin
from typing import Any

import numpy as np
import pytest
import scipy.optimize
from hypothesis import assume, example, given
from hypothesis import strategies as st

from mjnav.constraints.velocity_obstacle import nearest_velocity, velocity_obstacle_exits

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


def test_exact_half_planes():
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


linprog: Any = scipy.optimize.linprog  # of a type that pyright would take as long to infer as of a tenth of mjnav
BOX = ((-1.0, -1.0), (1.0, 1.0))


def corners(planes, preferred):
    """All points at which the nearest of a polygon may lie: the target, its feet on the edges, the corners."""
    yield preferred
    for a, b, c in planes:
        gap = c - a * preferred[0] - b * preferred[1]
        yield preferred[0] + gap * a, preferred[1] + gap * b
    for (a, b, c), (d, e, f) in combinations(planes, 2):
        det = a * e - b * d
        if abs(det) > 1e-12:
            yield (c * e - b * f) / det, (a * f - c * d) / det


def nearest(planes, preferred, slack=1e-8):
    """The nearest to `preferred` of the points that obey a x + b y >= c for all planes; None where there is none."""
    obedient = [p for p in corners(planes, preferred) if all(a * p[0] + b * p[1] >= c - slack for a, b, c in planes)]
    return min(obedient, key=lambda p: hypot(p[0] - preferred[0], p[1] - preferred[1]), default=None)


def sides(low, high):
    return [(1.0, 0.0, low[0]), (0.0, 1.0, low[1]), (-1.0, 0.0, -high[0]), (0.0, -1.0, -high[1])]


def random_problem(seed):
    rng = np.random.default_rng(seed)
    num = int(rng.integers(0, 13))
    angle = rng.uniform(-pi, pi, num)
    normal = np.column_stack([np.cos(angle), np.sin(angle)])
    offset = 0.5 * rng.normal(size=num) - rng.choice([0.0, 0.4])
    return normal, offset, -rng.uniform(0.05, 1.0, 2), rng.uniform(0.05, 1.0, 2), rng.normal(size=2)


def test_the_velocity_is_the_nearest_that_the_half_planes_and_the_box_leave():
    solved = 0
    for seed in range(400):
        normal, offset, low, high, preferred = random_problem(seed)
        velocity, violation = nearest_velocity(normal, offset, low, high, preferred)
        planes = [(a, b, c) for (a, b), c in zip(normal, offset, strict=True)] + sides(low, high)
        expected = nearest(planes, preferred)
        if expected is not None:
            assert violation <= 1e-8
            assert velocity == pytest.approx(expected, abs=1e-6)
            solved += violation == 0.0
    assert 100 < solved < 390


def test_without_a_solution_the_nearest_velocity_of_least_violation_is_taken():
    conflicts = 0
    for seed in range(400):
        normal, offset, low, high, preferred = random_problem(seed)
        if not len(offset):
            continue
        velocity, violation = nearest_velocity(normal, offset, low, high, preferred)
        rows = np.column_stack([-normal, -np.ones(len(offset))])
        bounds = [*zip(low, high, strict=True), (0.0, None)]
        least = linprog([0.0, 0.0, 1.0], A_ub=rows, b_ub=-offset, bounds=bounds).fun
        assert violation == pytest.approx(least, abs=1e-7)
        assert np.maximum(offset - normal @ velocity, 0.0).max() == pytest.approx(least, abs=1e-7)
        planes = [(a, b, c - least) for (a, b), c in zip(normal, offset, strict=True)] + sides(low, high)
        # Where two planes are nearly parallel, the slack of rounding goes far along them.
        assert velocity == pytest.approx(nearest(planes, preferred, 1e-7), abs=1e-4)
        conflicts += violation > 0.0
    assert conflicts > 100


def test_exact_answers():
    def solve(normal, offset, preferred):
        velocity, violation = nearest_velocity(np.reshape(normal, (-1, 2)), offset, *BOX, preferred)
        return *velocity.tolist(), violation

    assert solve([], [], (0.3, -0.2)) == (0.3, -0.2, 0.0)
    assert solve([], [], (3.0, -0.2)) == (1.0, -0.2, 0.0)
    assert solve([(1.0, 0.0)], [0.5], (0.0, 0.25)) == (0.5, 0.25, 0.0)
    assert solve([(1.0, 0.0), (0.0, 1.0)], [0.5, 0.5], (0.0, 0.0)) == (0.5, 0.5, 0.0)
    assert solve([(0.6, 0.8)], [1.0], (0.0, 0.0)) == pytest.approx((0.6, 0.8, 0.0))
    # Two that face each other: half way; the other axis stays free.
    assert solve([(1.0, 0.0), (-1.0, 0.0)], [0.75, 0.25], (0.0, 0.1)) == pytest.approx((0.25, 0.1, 0.5), abs=1e-8)
    # Three that point outwards from the middle.
    star = [(cos(a), sin(a)) for a in (0.0, 2.0 * pi / 3.0, -2.0 * pi / 3.0)]
    assert solve(star, [0.5, 0.5, 0.5], (0.9, 0.0)) == pytest.approx((0.0, 0.0, 0.5), abs=1e-8)
    # One that the box does not reach: its nearest edge.
    assert solve([(1.0, 0.0)], [3.0], (-0.5, 0.2)) == pytest.approx((1.0, 0.2, 2.0), abs=1e-8)


def test_the_box_is_kept_to_the_last_bit_even_where_it_has_no_size():
    for seed in range(100):
        normal, offset, low, high, preferred = random_problem(seed)
        for high_ in (high, low):
            velocity, _ = nearest_velocity(normal, offset, low, high_, preferred)
            assert (low <= velocity).all()
            assert (velocity <= high_).all()


def test_a_problem_moved_by_a_velocity_has_the_answer_moved_by_it():
    for seed in range(100):
        normal, offset, low, high, preferred = random_problem(seed)
        velocity, violation = nearest_velocity(normal, offset, low, high, preferred)
        for shift in ((0.0, 3.0), (3.0, 0.0), (0.0, -3.0), (-3.0, 0.0)):
            moved, same = nearest_velocity(
                normal, offset + normal @ shift, low + shift, high + shift, preferred + shift
            )
            assert same == pytest.approx(violation, abs=1e-8)
            assert moved - shift == pytest.approx(velocity, abs=1e-5)


def test_of_all_velocities_of_the_least_violation_the_nearest_is_taken():
    # The last two face each other and allow the first its violation of 0.3, which the search obeyed on its way.
    normal, offset, preferred = np.array([(0.0, 1.0), (1.0, 0.0), (-1.0, 0.0)]), [0.3, 0.75, 0.25], np.array([0.1, 0.0])
    velocity, violation = nearest_velocity(normal, offset, *BOX, preferred)
    assert (*velocity, violation) == pytest.approx((0.25, 0.0, 0.5), abs=1e-8)
    velocity, violation = nearest_velocity(normal[:, ::-1], offset, *BOX, preferred[::-1])
    assert (*velocity, violation) == pytest.approx((0.0, 0.25, 0.5), abs=1e-8)
