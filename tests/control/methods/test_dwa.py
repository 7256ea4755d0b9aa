from math import inf, sqrt

import numpy as np
import pytest

from mjnav.control import make_controller
from mjnav.messages import ObstacleSamples, RobotLimits, Status
from mjnav.motion.unicycle import integrate

PERIOD = 0.1
SMALL = {"num_v": 4, "num_omega": 5}
CROWDED = {"spread": 0.2, "near": 0.05, "far": 2.5}


@pytest.fixture(scope="module")
def dwa():
    return make_controller("dwa", RobotLimits(), PERIOD)


def disc(x, y, vx=0.0, vy=0.0, radius=0.3):
    return ObstacleSamples(np.array([[x, y]]), np.array([[vx, vy]]), radius)


def wall_distance(at, ends):
    a, along = ends[0], ends[1] - ends[0]
    s = np.clip((at - a) @ along / (along @ along), 0.0, 1.0)
    return np.hypot(*(at - a - s[:, None] * along).T)


class Literal:
    """The method of the module's docstring, every arc driven in steps of a few millimetres."""

    def __init__(self, o, controller):
        self.o, self.p, self.limits = o, controller.parameters, controller.limits
        heading = np.arctan2(np.sin(o.robot_pose[:, 2]).mean(), np.cos(o.robot_pose[:, 2]).mean())
        self.pose = np.array([*o.robot_pose[:, :2].mean(axis=0), heading])

    def way(self, v, omega, distance, radius):
        """Until `distance` of the robot first falls below R, or below what it is now, if that is less."""
        if v == 0.0:
            return inf
        length = self.p.clearance if omega == 0.0 else min(self.p.clearance, 2.0 * np.pi * abs(v / omega))
        s = np.linspace(0.0, length, 2000)
        gap = distance(integrate(self.pose, v, omega * np.ones_like(s), s / v)[:, :2])
        touching = np.flatnonzero(gap < min(radius, gap[0]) - 1e-7)
        return s[touching[0]] if len(touching) else inf

    def ways(self, v, omega):
        """To every disc, wall and lane boundary."""
        o, r, margin = self.o, self.limits.radius, self.p.safety_margin
        to_disc = [
            self.way(v, omega, lambda at, d=d: np.hypot(*(at - d.position.mean(axis=0)).T), r + d.radius + margin)
            for d in o.obstacles
        ]
        to_wall = [self.way(v, omega, lambda at, e=ends: wall_distance(at, e), r + margin) for ends in o.walls]

        def inside(at, line, noise, side):
            return side * ((at @ line[:2] + line[2]) / np.hypot(*line[:2]) + noise.mean())

        to_left = self.way(v, omega, lambda at: inside(at, o.lanes.left, o.lanes.left_offset, -1.0), r)
        to_right = self.way(v, omega, lambda at: inside(at, o.lanes.right, o.lanes.right_offset, 1.0), r)
        return np.array([*to_disc, *to_wall, to_left, to_right])


@pytest.mark.parametrize("seed", range(12))
def test_every_risk_and_total_is_that_of_arcs_driven_in_small_steps(observe, seed):
    controller = make_controller("dwa", RobotLimits(), PERIOD, **SMALL, clearance=2.0, weight=0.7, moving=False)
    o = observe(seed, num_obstacles=3, num_walls=2, **(CROWDED if seed % 3 == 2 else {}))
    problem, literal = controller.problem(o), Literal(o, controller)
    costs = controller.evaluate(problem)
    for k, (v, omega) in enumerate(zip(costs.v, costs.omega, strict=True)):
        ways = literal.ways(v, omega)
        risk = 1.0 - np.minimum(ways, 2.0) / 2.0
        assert np.concatenate([costs.cone[k], costs.lane[k]]) == pytest.approx(risk, abs=3e-3)
        dist = ways.min()
        stop = max(v * v / 2.0, abs(v * omega) / 6.0)  # accelerations of 1 m/s^2 and 3 rad/s^2
        if abs(stop - dist) < 3e-3:
            continue
        if stop < dist:
            assert costs.total[k] == pytest.approx(costs.goal[k] + 0.7 * risk.max(), abs=3e-3)
        elif controller.decide(o).status != Status.INFEASIBLE:
            assert costs.total[k] == inf


def test_admissible_is_what_can_stop_before_the_contact(alone, dwa):
    gap = 0.17
    o = alone(twist=(0.6, 0.0), obstacles=(disc(gap + 0.22 + 0.05 + 0.3, 0.0),))
    costs = dwa.decide(o).costs
    straight = np.flatnonzero(np.abs(costs.omega) < 1e-12)
    assert len(straight) >= 1
    for k in straight:
        assert (costs.total[k] < inf) == (costs.v[k] <= sqrt(2.0 * gap * 1.0))
    assert {costs.total[k] < inf for k in straight} == {True, False}


def test_where_nothing_is_admissible_it_brakes_and_says_so(alone, dwa):
    decision = dwa.decide(alone(twist=(0.8, 0.0), obstacles=(disc(0.65, 0.0),)))
    assert decision.status == Status.INFEASIBLE
    assert decision.v == pytest.approx(0.7)
    assert np.isfinite(decision.costs.total).any()


def test_people_who_go_on_are_met_unless_they_are_taken_where_they_are(alone):
    blind = make_controller("dwa", RobotLimits(), PERIOD, moving=False, clearance=2.0)
    minding = make_controller("dwa", RobotLimits(), PERIOD, clearance=2.0)
    leaving, coming = disc(1.5, 0.0, vx=1.5), disc(3.5, 0.0, vx=-1.0)
    for body, meets, minded in ((leaving, True, False), (coming, False, True)):
        o = alone(twist=(0.6, 0.0), obstacles=(body,))
        risks = [controller.decide(o).costs.cone.max() for controller in (blind, minding)]
        assert [risk > 0.0 for risk in risks] == [meets, minded]
