"""The linearised chance constraints against the equation written down a second time, and what must be true of them."""

from dataclasses import replace
from math import atan2, cos, hypot, inf, sin, sqrt

import numpy as np
import pytest
from scipy.special import erfinv
from scipy.stats import norm

from mjnav.control import make_controller
from mjnav.messages import ObstacleSamples, RobotLimits

NAME = "gaussian-linearised"
LIMITS = RobotLimits(max_speed=1.1, min_speed=-0.2, max_turn_rate=1.4, max_acceleration=1.5, max_turn_acceleration=4.0)
SMALL = {"num_v": 4, "num_omega": 5}


def mean(values):
    return sum(values) / len(values)


class Literal:
    """The risk of one candidate u, one constraint at a time; every variance is that of the samples' departures."""

    def __init__(self, o, p, u):
        self.o, self.p = o, p
        heading = atan2(mean([sin(h) for h in o.robot_pose[:, 2]]), mean([cos(h) for h in o.robot_pose[:, 2]]))
        dv, domega = o.control_noise.T
        self.x, self.y = mean(o.robot_pose[:, 0]), mean(o.robot_pose[:, 1])
        angle = heading + (u[1] + mean(domega)) * p.preview
        self.e, self.speed = (cos(angle), sin(angle)), u[0] + mean(dv)
        self.q = (self.speed * self.e[0], self.speed * self.e[1])
        self.departures = []  # of each sample: in position, and in velocity to first order
        for (x, y, theta), v, w in zip(o.robot_pose, dv, domega, strict=True):
            turn = atan2(sin(theta - heading), cos(theta - heading)) + w * p.preview
            turn -= mean([atan2(sin(t - heading), cos(t - heading)) for t in o.robot_pose[:, 2]])
            turn -= mean(domega) * p.preview
            faster = v - mean(dv)
            velocity = (
                self.e[0] * faster - self.speed * self.e[1] * turn,
                self.e[1] * faster + self.speed * self.e[0] * turn,
            )
            self.departures.append((x - self.x, y - self.y, *velocity))

    @staticmethod
    def variance(departures, a, t):
        """Of a . (position + t velocity)."""
        return mean([(a[0] * (x + t * vx) + a[1] * (y + t * vy)) ** 2 for x, y, vx, vy in departures])

    def probability(self, excess, variance):
        """That excess + noise > 0; the published inequality says the same."""
        std = sqrt(variance)
        probability = norm.cdf(excess / std)
        allowed = -excess >= erfinv(1.0 - 2.0 * self.p.delta) * sqrt(2.0) * std
        assert allowed == (probability <= self.p.delta)
        return probability

    def collides(self, radius, d, t, others=()):
        distance = hypot(*d)
        a = (d[0] / distance, d[1] / distance)
        variance = self.variance(self.departures, a, t) + (self.variance(others, a, t) if others else 0.0)
        return self.probability(radius - distance, variance)

    def disc(self, disc):
        (ox, oy), (ovx, ovy) = disc.position.mean(axis=0), disc.velocity.mean(axis=0)
        rx, ry, qx, qy = self.x - ox, self.y - oy, self.q[0] - ovx, self.q[1] - ovy
        t = min(max(-(rx * qx + ry * qy) / (qx * qx + qy * qy), 0.0), self.p.horizon)
        others = [
            (x - ox, y - oy, vx - ovx, vy - ovy) for (x, y), (vx, vy) in zip(disc.position, disc.velocity, strict=True)
        ]
        radius = LIMITS.radius + disc.radius + self.p.safety_margin
        return self.collides(radius, (rx + t * qx, ry + t * qy), t, others)

    def wall(self, ends):
        """Where path and wall do not cross; at the ends of the path, and where it is nearest to the wall's ends."""
        (ax, ay), (bx, by) = ends.tolist()
        wx, wy, horizon, qq = bx - ax, by - ay, self.p.wall_horizon, self.q[0] ** 2 + self.q[1] ** 2
        times = [0.0, horizon]
        for ex, ey in ends.tolist():
            t = ((ex - self.x) * self.q[0] + (ey - self.y) * self.q[1]) / qq
            times.append(min(max(t, 0.0), horizon))
        risks = []
        for t in times:
            x, y = self.x + t * self.q[0], self.y + t * self.q[1]
            share = min(max(((x - ax) * wx + (y - ay) * wy) / (wx * wx + wy * wy), 0.0), 1.0)
            risks.append(
                self.collides(LIMITS.radius + self.p.safety_margin, (x - ax - share * wx, y - ay - share * wy), t)
            )
        return max(risks)

    def crossed(self, ends):
        """The share of the path at which it crosses the wall, or None."""
        (ax, ay), (bx, by) = ends.tolist()
        matrix = np.array([[self.q[0] * self.p.wall_horizon, ax - bx], [self.q[1] * self.p.wall_horizon, ay - by]])
        path, wall = np.linalg.solve(matrix, [ax - self.x, ay - self.y])
        return path if 0.0 < path < 1.0 and 0.0 < wall < 1.0 else None

    def wall_crossed(self, ends, path):
        t, (wx, wy), radius = path * self.p.wall_horizon, ends[1] - ends[0], LIMITS.radius + self.p.safety_margin
        normal = (-wy / hypot(wx, wy), wx / hypot(wx, wy))
        return max(self.wall(ends), self.probability(radius, self.variance(self.departures, normal, t)))

    def lane(self, side):
        lanes, t, margin = self.o.lanes, self.p.lane_horizon, LIMITS.radius
        a, b, c = (lanes.left, lanes.right)[side]
        offsets = (lanes.left_offset, lanes.right_offset)[side]
        norm_ = sqrt(a * a + b * b)
        d = (a * (self.x + t * self.q[0]) + b * (self.y + t * self.q[1]) + c) / norm_ + mean(offsets)
        variance = self.variance(self.departures, (a / norm_, b / norm_), t)
        variance += mean([(o - mean(offsets)) ** 2 for o in offsets])
        return self.probability(d + margin if side == 0 else -(d - margin), variance)


@pytest.fixture
def blocked(observe):
    """blocked(seed) -> a random observation with one wall more, right before the robot."""

    def build(seed):
        o = observe(seed, spread=0.2, num_samples=7)
        x, y, heading = o.robot_pose.mean(axis=0)
        ahead = np.array([x + 0.5 * cos(heading), y + 0.5 * sin(heading)])
        half = np.array([cos(heading + 1.0), sin(heading + 1.0)])
        return replace(o, walls=np.concatenate([o.walls, [[ahead - half, ahead + half]]]))

    return build


@pytest.mark.parametrize("delta", [0.001, 0.05, 0.5])
@pytest.mark.parametrize("normalise", [True, False])
@pytest.mark.parametrize("seed", range(6))
def test_the_risk_is_the_one_written_down(blocked, seed, normalise, delta):
    o = blocked(seed)
    controller = make_controller(
        NAME, LIMITS, 0.2, **SMALL, delta=delta, normalise=normalise, horizon=1.0 + seed, window="bounds"
    )
    costs = controller.decide(o).costs
    for k, u in enumerate(zip(costs.v, costs.omega, strict=True)):
        literal = Literal(o, controller.parameters, u)
        for j, disc in enumerate(o.obstacles):
            assert costs.cone[k, j] == pytest.approx(literal.disc(disc), rel=1e-9, abs=1e-12)
        for j, ends in enumerate(o.walls, start=len(o.obstacles)):
            crossed = literal.crossed(ends)
            expected = literal.wall(ends) if crossed is None else literal.wall_crossed(ends, crossed)
            if costs.cone[:, j].any():  # else out of reach
                assert costs.cone[k, j] == pytest.approx(expected, rel=1e-9, abs=1e-12)
        for side in (0, 1):
            assert costs.lane[k, side] == pytest.approx(literal.lane(side), rel=1e-9, abs=1e-12)


def test_the_risk_is_the_share_that_collides_where_the_spread_is_small(observe):
    """The half-plane is the disc's own edge then."""
    rng = np.random.default_rng(0)
    checked, n = 0, 20_000
    for seed in range(12):
        o = observe(seed, num_samples=1, most=1, num_obstacles=1, num_walls=0, lanes=False)
        spread = 0.004 * rng.normal(size=(4, 4))
        disc = o.obstacles[0]
        state = np.concatenate([disc.position, disc.velocity], axis=1) + rng.normal(size=(n, 4)) @ spread
        o = replace(o, obstacles=(ObstacleSamples(state[:, :2], state[:, 2:], disc.radius),))
        risk = make_controller(NAME, LIMITS, 0.2, horizon=3.0, safety_margin=0.05).decide(o).costs.cone[:, 0]
        problem = make_controller("cvar", LIMITS, 0.2, horizon=3.0, clip=inf, safety_margin=0.05).problem(o)
        near = np.flatnonzero((risk > 0.02) & (risk < 0.98))[:5]
        if not len(near):
            continue
        samples = problem.cone.samples(0, problem.candidates.v[near], problem.candidates.omega[near])
        assert (samples > 0.0).mean(axis=0) == pytest.approx(risk[near], abs=0.02)
        checked += len(near)
    assert checked >= 10
