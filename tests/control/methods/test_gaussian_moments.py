"""mean(f) + k std(f) <= 0 against the equation written down a second time, and what must be true of it."""

from math import cos, inf, pi, sin, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.linalg import sqrtm
from scipy.stats import norm

from mjnav.constraints import collision_cone, lane_distance, wall_clearance
from mjnav.control import make_controller
from mjnav.control.methods.gaussian_moments import deviations, gaussian, white
from mjnav.messages import RobotLimits
from mjnav.rng import stream

NAME = "gaussian-moments"
LIMITS = RobotLimits(max_speed=1.1, min_speed=-0.2, max_turn_rate=1.4, max_acceleration=1.5, max_turn_acceleration=4.0)
SMALL = {"num_v": 4, "num_omega": 5}


def standard_normal(body, num, size):
    """The draws, with mean 0 and covariance 1."""
    draws = stream(0, "gaussian-moments", body).standard_normal((num, size))
    draws = draws - draws.mean(axis=0)
    return draws @ np.linalg.inv(np.real(sqrtm(np.cov(draws.T, bias=True))))


def fitted(states, draws):
    """Samples of the Gaussian that has the mean and covariance of the states."""
    root = np.real(sqrtm(np.cov(states.T, bias=True) + 1e-18 * np.eye(states.shape[1])))
    return np.array([states.mean(axis=0) + root @ z for z in draws])


class Literal:
    """The risk of one candidate, pair by pair, in a frame that stands at the mean robot."""

    def __init__(self, o, p):
        self.allowed = True  # so far
        self.o, self.p = o, p
        headings = o.robot_pose[:, 2]
        self.heading = np.arctan2(np.sin(headings).mean(), np.cos(headings).mean())
        c, s = cos(self.heading), sin(self.heading)
        self.centre, self.into = o.robot_pose[:, :2].mean(axis=0), np.array([[c, s], [-s, c]])
        states = [
            [
                *(self.into @ (pose[:2] - self.centre)),
                (pose[2] - self.heading + pi) % (2 * pi) - pi,
                *noise,
                left,
                right,
            ]
            for pose, noise, left, right in zip(
                o.robot_pose, o.control_noise, o.lanes.left_offset, o.lanes.right_offset, strict=True
            )
        ]
        self.robot = fitted(np.array(states), standard_normal("robot", p.samples, 7))
        self.discs = []
        for disc in o.obstacles:
            states = np.array(
                [
                    [*(self.into @ (position - self.centre)), *(self.into @ velocity)]
                    for position, velocity in zip(disc.position, disc.velocity, strict=True)
                ]
            )
            several = len(states) > 1
            self.discs.append(fitted(states, standard_normal("obstacle", p.samples, 4)) if several else states)

    def velocity(self, state, u):
        heading = state[2] + (u[1] + state[4]) * self.p.preview
        return (u[0] + state[3]) * np.array([cos(heading), sin(heading)])

    def risk(self, f):
        f = [max(value, -self.p.clip) for value in f]
        average = sum(f) / len(f)
        std = sqrt(sum((x - average) ** 2 for x in f) / len(f))
        self.allowed &= average + deviations(self.p.eta, self.p.tail) * std <= 0.0
        return norm.cdf(average / std) if std > 1e-12 else float(average > 0.0)

    def disc(self, j, u):
        radius = LIMITS.radius + self.o.obstacles[j].radius + self.p.safety_margin
        f = []
        for state in self.robot:
            for other in self.discs[j]:
                q = self.velocity(state, u) - other[2:]
                f.append(collision_cone(state[:2] - other[:2], q, radius, form=self.p.form, horizon=self.p.horizon))
        return self.risk([x / radius**2 if self.p.normalise else x for x in f])

    def wall(self, ends, u):
        radius, (start, end) = LIMITS.radius + self.p.safety_margin, (ends - self.centre) @ self.into.T
        f = [
            wall_clearance(state[:2], self.velocity(state, u), start, end, radius, self.p.wall_horizon)
            for state in self.robot
        ]
        return self.risk([x / radius**2 if self.p.normalise else x for x in f])

    def lane(self, side, u):
        f = []
        for state in self.robot:
            there = self.centre + self.into.T @ (state[:2] + self.p.lane_horizon * self.velocity(state, u))
            d = lane_distance(there, (self.o.lanes.left, self.o.lanes.right)[side]) + state[5 + side]
            f.append(d + LIMITS.radius if side == 0 else -(d - LIMITS.radius))
        return self.risk([x / LIMITS.radius if self.p.normalise else x for x in f])


@pytest.mark.parametrize(
    "parameters",
    [
        {"eta": 0.9},
        {"eta": 0.8, "tail": "quantile", "normalise": False, "clip": inf},
        {"eta": 0.3, "form": "line", "samples": 8},
    ],
)
@pytest.mark.parametrize("seed", range(3))
def test_the_risk_is_the_one_written_down(observe, seed, parameters):
    o = observe(seed, num_samples=9, most=9, num_obstacles=2)
    controller = make_controller(NAME, LIMITS, 0.2, **{"samples": 10, **SMALL, **parameters})
    costs, literal = controller.decide(o).costs, Literal(o, controller.parameters)
    for k in range(0, len(costs.v), 3):
        u, literal.allowed = (costs.v[k], costs.omega[k]), True
        for j in range(len(o.obstacles)):
            assert costs.cone[k, j] == pytest.approx(literal.disc(j, u), rel=1e-6, abs=1e-7)
        for j, ends in enumerate(o.walls, start=len(o.obstacles)):
            if costs.cone[:, j].any():  # else out of reach
                assert costs.cone[k, j] == pytest.approx(literal.wall(ends, u), rel=1e-6, abs=1e-7)
        for side in (0, 1):
            assert costs.lane[k, side] == pytest.approx(literal.lane(side, u), rel=1e-6, abs=1e-7)
        assert literal.allowed == (max(costs.cone[k].max(), costs.lane[k].max()) <= controller.bound)


@given(arrays(float, (6, 3), elements=st.floats(-5.0, 5.0)), st.integers(4, 30))
def test_the_fit_has_the_mean_and_covariance_of_the_samples_exactly(states, num):
    drawn = gaussian(states, white(np.random.default_rng(num).standard_normal((num, 3))))
    assert drawn.mean(axis=0) == pytest.approx(states.mean(axis=0), abs=1e-12)
    assert np.cov(drawn.T, bias=True) == pytest.approx(np.cov(states.T, bias=True), abs=1e-11)


@pytest.mark.parametrize("num", [2, 3, 4])
def test_draws_too_few_for_a_covariance_have_mean_0_and_variance_1(num):
    draws = white(np.random.default_rng(num).standard_normal((num, 4)))
    assert draws.mean(axis=0) == pytest.approx(np.zeros(4), abs=1e-15)
    assert draws.var(axis=0) == pytest.approx(np.ones(4))
