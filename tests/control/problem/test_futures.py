"""Predicted futures, as every method takes them."""

from dataclasses import replace

import numpy as np
import pytest

from mjnav.control import make_controller, names
from mjnav.control.problem.obstacles import positions_at, straightened
from mjnav.messages import ObstacleSamples

STEP, NUM = 0.5, 12  # as far as the longest horizon


def with_straight_future(obstacle):
    time = STEP * np.arange(1, NUM + 1)[:, None]
    return replace(obstacle, future=obstacle.position[:, None] + time * obstacle.velocity[:, None], step=STEP)


@pytest.mark.parametrize("method", names())
@pytest.mark.parametrize("seed", range(2))
def test_a_future_that_is_a_straight_line_decides_as_none_does(method, seed, observe, small, limits):
    plain = observe(seed, near=0.6, far=2.5)
    ahead = replace(plain, obstacles=tuple(map(with_straight_future, plain.obstacles)))
    # Without velocities of their own: what is taken is the future.
    ahead = replace(ahead, obstacles=tuple(replace(o, velocity=np.full_like(o.velocity, 9.0)) for o in ahead.obstacles))
    decided = [make_controller(method, limits, 0.1, **small(method)).decide(o) for o in (plain, ahead)]
    assert (decided[0].v, decided[0].omega) == pytest.approx((decided[1].v, decided[1].omega), abs=1e-9)
    if decided[0].costs is not None:
        assert decided[0].costs.total == pytest.approx(decided[1].costs.total, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("method", sorted({*names()} - {"dwa"}))  # which takes everybody for standing, as published
def test_who_is_predicted_to_stop_short_of_the_way_is_another_risk_than_who_goes_on(method, alone, small, limits):
    num = 25
    spread = 0.02 * np.random.default_rng(0).standard_normal((num, 2))
    going = ObstacleSamples(np.array([2.0, -1.6]) + spread, np.tile([0.0, 0.6], (num, 1)), 0.3)
    stopping = replace(going, future=np.repeat(going.position[:, None], NUM, axis=1), step=STEP)
    free, met = (
        make_controller(method, limits, 0.1, **small(method)).decide(alone(twist=(0.6, 0.0), obstacles=[person]))
        for person in (stopping, going)
    )
    assert (free.v, free.omega) != (met.v, met.omega)
    assert free.v >= met.v or abs(met.omega) > abs(free.omega)  # slower, or aside


def test_positions_are_linear_between_the_predicted_ones_and_go_straight_on_after_the_last():
    person = ObstacleSamples(
        np.array([[0.0, 0.0]]), np.array([[7.0, 7.0]]), 0.3, future=np.array([[[1.0, 0.0], [1.0, 2.0]]]), step=0.4
    )
    found = positions_at(person, np.array([0.0, 0.2, 0.4, 0.5, 0.8, 1.2]))[:, 0]
    assert found == pytest.approx(np.array([[0, 0], [0.5, 0], [1, 0], [1, 0.5], [1, 2], [1, 4]], float))
    towards = straightened(person, 0.4), straightened(person, 5.0)  # the prediction ends at 0.8 s
    assert [one.velocity.tolist() for one in towards] == [[[2.5, 0.0]], [[1.25, 2.5]]]
    assert all(one.future is None for one in towards)
