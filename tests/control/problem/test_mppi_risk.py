"""The cost of mppi's rollouts, written down a second time."""

from dataclasses import replace
from math import atan2, cos, hypot, pi, sin

import numpy as np
import pytest

from mjnav.control import make_controller
from mjnav.control.problem.mppi_risk import Surroundings
from mjnav.control.problem.obstacles import Reach
from mjnav.control.rollouts import ControlLimits
from mjnav.messages import RobotLimits

LIMITS = RobotLimits(max_speed=1.1, min_speed=-0.2, max_turn_rate=1.4, max_acceleration=1.5, max_turn_acceleration=4.0)
PERIOD = 0.15
SMALL = {"rollouts": 12, "steps": 6, "step": 0.3, "knots": 3}
CROWDED = {"spread": 0.2, "near": 0.05, "far": 2.5, "num_samples": 7}


def clip(value, low, high):
    return min(max(value, low), high)


def turn(angle):
    return angle - 2.0 * pi * round(angle / (2.0 * pi))


def segment(x, y, ends):
    (ax, ay), (bx, by) = ends.tolist()
    length = hypot(bx - ax, by - ay)
    s = clip(((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length**2, 0.0, 1.0)
    return hypot(x - ax - s * (bx - ax), y - ay - s * (by - ay))


class Literal:
    """One rollout of one observation: its controls, path, and costs, one step and one pair of samples at a time."""

    def __init__(self, observation, parameters, wanted, ahead=0.0, radius=LIMITS.radius):
        self.o, self.p, self.ahead, self.radius = observation, parameters, ahead, radius
        poses = observation.robot_pose
        self.mean = (*poses[:, :2].mean(axis=0), atan2(np.sin(poses[:, 2]).mean(), np.cos(poses[:, 2]).mean()))
        self.controls = self.within_limits(wanted)
        self.path = self.drive()
        steps = range(parameters.steps)
        self.goal = sum(self.goal_cost(t) for t in steps) / parameters.steps
        shares = [[self.share(column, t) for column in self.columns] for t in steps]
        beyond = [[self.share_beyond(side, t) for side in (0, 1)] for t in steps]
        self.cone = [parameters.step * sum(column) for column in zip(*shares, strict=True)]
        self.lane = [parameters.step * sum(side) for side in zip(*beyond, strict=True)]
        self.worst = max(share for row in (*shares, *beyond) for share in row)
        charged = zip(self.lane, parameters.lane_weights, strict=True)
        self.total = self.goal + parameters.weight * sum(self.cone) + sum(w * x for x, w in charged)

    @property
    def columns(self):
        return [*(("disc", j) for j in range(len(self.o.obstacles))), *(("wall", w) for w in range(len(self.o.walls)))]

    def within_limits(self, wanted):
        lows, highs = (LIMITS.min_speed, -LIMITS.max_turn_rate), (LIMITS.max_speed, LIMITS.max_turn_rate)
        found = []
        for t, pair in enumerate(wanted):
            before, duration = (self.o.twist, PERIOD) if t == 0 else (found[-1], self.p.step)
            most = (LIMITS.max_acceleration * duration, LIMITS.max_turn_acceleration * duration)
            before = [clip(b, low, high) for b, low, high in zip(before, lows, highs, strict=True)]
            found.append(
                [clip(clip(pair[c], before[c] - most[c], before[c] + most[c]), lows[c], highs[c]) for c in (0, 1)]
            )
        return found

    def drive(self):
        x, y, heading = self.mean
        path = []
        for v, omega in self.controls:
            after = heading + omega * self.p.step
            if omega == 0.0:
                x, y = x + v * self.p.step * cos(heading), y + v * self.p.step * sin(heading)
            else:
                x, y = x + v / omega * (sin(after) - sin(heading)), y - v / omega * (cos(after) - cos(heading))
            heading = after
            path.append((x, y, heading))
        return path

    def goal_cost(self, t):
        p, (x, y, heading), (v, omega) = self.p, self.path[t], self.controls[t]
        before, duration = (self.o.twist, PERIOD) if t == 0 else (self.controls[t - 1], p.step)
        dx, dy = self.o.goal[0] - x, self.o.goal[1] - y
        bearing, speed = atan2(dy, dx), min(p.preferred_speed, hypot(dx, dy) / p.approach_time)
        ex, ey = v * cos(heading) - speed * cos(bearing), v * sin(heading) - speed * sin(bearing)
        dv = (v - before[0]) / (LIMITS.max_acceleration * duration)
        domega = (omega - before[1]) / (LIMITS.max_turn_acceleration * duration)
        change = p.speed_change_weight * dv**2 + p.turn_change_weight * domega**2
        return ex**2 + ey**2 + p.heading_weight * (turn(heading - bearing) / pi) ** 2 + change

    def robots(self, t, ahead=0.0):
        """Where a point `ahead` of the centre of every sample of the robot is at the end of step t."""
        dx, dy = self.path[t][0] - self.mean[0], self.path[t][1] - self.mean[1]
        dx, dy = dx + ahead * cos(self.path[t][2]), dy + ahead * sin(self.path[t][2])
        for (x, y, heading), (dv, _) in zip(self.o.robot_pose, self.o.control_noise, strict=True):
            yield x + dx + dv * PERIOD * cos(heading), y + dy + dv * PERIOD * sin(heading)

    def share(self, column, t):
        kind, j = column
        margin = self.radius + self.p.safety_margin
        if kind == "wall":
            hits = [segment(x, y, self.o.walls[j]) < margin for x, y in self.robots(t, self.ahead)]
        else:
            disc, ahead = self.o.obstacles[j], (t + 1) * self.p.step
            hits = [
                hypot(x - px - ahead * vx, y - py - ahead * vy) < margin + disc.radius
                for x, y in self.robots(t, self.ahead)
                for (px, py), (vx, vy) in zip(disc.position, disc.velocity, strict=True)
            ]
        return sum(hits) / len(hits)

    def share_beyond(self, side, t):
        lanes = self.o.lanes
        if lanes is None:
            return 0.0
        a, b, c = (lanes.left, lanes.right)[side]
        noise = (lanes.left_offset, lanes.right_offset)[side]
        d = [(a * x + b * y + c) / hypot(a, b) + n for (x, y), n in zip(self.robots(t), noise, strict=True)]
        return sum(x + LIMITS.radius > 0.0 if side == 0 else x - LIMITS.radius < 0.0 for x in d) / len(d)


@pytest.mark.parametrize("sizes", [{}, CROWDED, {"lanes": False, "num_walls": 0}, {"num_obstacles": 0}, {"most": 1}])
@pytest.mark.parametrize("seed", range(5))
def test_every_rollout_costs_what_is_written_down(observe, seed, sizes):
    o = observe(seed, **sizes)
    controller = make_controller("mppi", LIMITS, PERIOD, **SMALL, lane_weights=[3.0, 7.0])
    problem = controller.problem(o)
    everything = Reach(tuple(range(len(o.obstacles))), tuple(range(len(o.walls))))
    wanted = np.random.default_rng(seed).normal([[[0.4]], [[0.0]]], [[[0.6]], [[1.2]]], size=(2, 6, 9))
    wanted[1, :, 0] = 0.0
    limits = ControlLimits.of(o.twist, LIMITS, PERIOD, 0.3)
    found = controller.costs(problem, Surroundings.of(problem, everything, 6, 0.3), limits, wanted)
    for k in range(9):
        literal = Literal(o, controller.parameters, wanted[:, :, k].T.tolist())
        assert np.allclose(found.rollouts.controls[:, :, k].T, literal.controls, rtol=0.0, atol=1e-12)
        assert found.goal[k] == pytest.approx(literal.goal)
        assert found.risk.cone[k] == pytest.approx(literal.cone, abs=1e-12)
        assert found.risk.lane[k] == pytest.approx(literal.lane, abs=1e-12)
        assert found.risk.worst[k] == pytest.approx(literal.worst, abs=1e-12)
        assert found.total[k] == pytest.approx(literal.total)


@pytest.mark.parametrize("seed", range(3))
def test_with_each_body_the_disc_of_the_robot_counts_that_is_longest_in_collision(observe, seed):
    o, cover = observe(seed, **CROWDED, lanes=False), ((-0.2, 0.15), (0.25, 0.2))
    of_discs = replace(LIMITS, cover=cover)
    controller = make_controller("mppi", of_discs, PERIOD, **SMALL)
    everything = Reach(tuple(range(len(o.obstacles))), tuple(range(len(o.walls))))
    wanted = np.random.default_rng(seed).normal([[[0.4]], [[0.0]]], [[[0.6]], [[1.2]]], size=(2, 6, 9))
    surroundings = Surroundings.of(controller.problem(o), everything, 6, 0.3)
    found = controller.costs(
        controller.problem(o), surroundings, ControlLimits.of(o.twist, LIMITS, PERIOD, 0.3), wanted
    )
    for k in range(9):
        literal = [Literal(o, controller.parameters, wanted[:, :, k].T.tolist(), *disc) for disc in cover]
        assert found.risk.cone[k] == pytest.approx(np.max([one.cone for one in literal], axis=0), abs=1e-12)
        assert found.risk.worst[k] == pytest.approx(max(one.worst for one in literal), abs=1e-12)
