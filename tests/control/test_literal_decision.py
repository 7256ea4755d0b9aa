"""Whole decisions against the method written down a second time: one candidate, one obstacle, one pair at a time."""

from math import atan2, cos, hypot, inf, pi, sin, sqrt

import numpy as np
import pytest

from mjnav.constraints import collision_cone, wall_clearance
from mjnav.control import make_controller
from mjnav.messages import RobotLimits, Status

LIMITS = RobotLimits(max_speed=1.1, min_speed=-0.2, max_turn_rate=1.4, max_acceleration=1.5, max_turn_acceleration=4.0)
PERIOD = 0.2
SMALL = {"num_v": 4, "num_omega": 5}
CROWDED = {"spread": 0.2, "near": 0.05, "far": 2.5, "num_samples": 9, "num_walls": 1}


def turn(angle):
    """Into [-pi, pi], by whole turns."""
    return angle - 2.0 * pi * round(angle / (2.0 * pi))


def gram_mmd(x, y, p):
    """The definition with Gram matrices, in extended precision: unscaled f of many metres cancel badly in cubes."""
    x, y = np.asarray(x, np.longdouble), np.asarray(y, np.longdouble)

    def k(a, b):
        return ((p.scale * np.outer(a, b) + p.offset) ** p.degree).mean()

    squared = float(k(x, x) - 2.0 * k(x, y) + k(y, y))
    return sqrt(max(squared, 0.0)) if p.root else squared


class Literal:
    """One decision of an observation under parameters; what is costed is costed for every candidate."""

    def __init__(self, o, p):
        self.o, self.p, poses = o, p, o.robot_pose
        n = len(poses)
        heading = atan2(sum(map(sin, poses[:, 2])), sum(map(cos, poses[:, 2])))
        self.mean = [sum(poses[:, 0]) / n, sum(poses[:, 1]) / n, heading]
        self.mean_noise = [sum(o.control_noise[:, 0]) / n, sum(o.control_noise[:, 1]) / n]
        self.controls = self.candidates()
        self.discs = self.discs_in_reach()
        self.goal = [self.goal_cost(u, self.mean) for u in self.controls]
        self.nominal = self.nominal_at(0.0, 0.0)
        self.feasible = self.violation(self.controls[self.nominal], self.mean) == 0.0

    def candidates(self):
        p, grid, keep, brake = self.p, [], [], []
        bounds = [
            (LIMITS.min_speed, LIMITS.max_speed, LIMITS.max_acceleration, p.num_v),
            (-LIMITS.max_turn_rate, LIMITS.max_turn_rate, LIMITS.max_turn_acceleration, p.num_omega),
        ]
        for value, (lower, upper, acceleration, number) in zip(self.o.twist, bounds, strict=True):
            value = min(max(value, lower), upper)
            low, high = max(lower, value - acceleration * PERIOD), min(upper, value + acceleration * PERIOD)
            keep.append(value)
            brake.append(min(max(0.0, low), high))
            if p.window == "bounds":
                low, high = lower, upper
            grid.append([low + (high - low) * i / (number - 1) for i in range(number)])
        return [(v, omega) for v in grid[0] for omega in grid[1]] + [tuple(keep), tuple(brake)]

    def goal_cost(self, u, pose):
        p, o = self.p, self.o
        dx, dy = o.goal[0] - pose[0], o.goal[1] - pose[1]
        speed = min(p.preferred_speed, LIMITS.max_speed, hypot(dx, dy) / p.approach_time)
        desired = (speed * dx / hypot(dx, dy), speed * dy / hypot(dx, dy))
        heading = pose[2] + u[1] * p.preview
        cost = (u[0] * cos(heading) - desired[0]) ** 2 + (u[0] * sin(heading) - desired[1]) ** 2
        cost += p.heading_weight * (turn(heading - atan2(dy, dx)) / pi) ** 2
        cost += p.speed_change_weight * ((u[0] - o.twist[0]) / (LIMITS.max_acceleration * PERIOD)) ** 2
        cost += p.turn_change_weight * ((u[1] - o.twist[1]) / (LIMITS.max_turn_acceleration * PERIOD)) ** 2
        return cost

    def discs_in_reach(self):
        gaps = []
        for j, disc in enumerate(self.o.obstacles):
            x, y = disc.position.mean(axis=0)
            gap = hypot(x - self.mean[0], y - self.mean[1]) - disc.radius
            if gap <= (7.0 if self.p.sensing_range is None else self.p.sensing_range):
                gaps.append((gap, j))
        return [j for _, j in sorted(gaps)[: self.p.max_obstacles]]

    def velocity(self, u, heading, noise):
        direction = heading + (u[1] + noise[1]) * self.p.preview
        return (u[0] + noise[0]) * cos(direction), (u[0] + noise[0]) * sin(direction)

    def disc_f(self, disc, pose, velocity, position, obstacle_velocity):
        radius = LIMITS.radius + disc.radius + self.p.safety_margin
        r, q = np.subtract(pose[:2], position), np.subtract(velocity, obstacle_velocity)
        f = float(collision_cone(r, q, radius, form=self.p.form, horizon=self.p.horizon))
        return f / radius**2 if self.p.normalise else f

    def wall_f(self, ends, pose, velocity):
        radius = LIMITS.radius + self.p.safety_margin
        f = float(wall_clearance(pose[:2], velocity, ends[0], ends[1], radius, self.p.wall_horizon))
        return f / radius**2 if self.p.normalise else f

    def lane_f(self, side, u, pose, noise, offset):
        lanes = self.o.lanes
        vx, vy = self.velocity(u, pose[2], noise)
        x, y = pose[0] + vx * self.p.lane_horizon, pose[1] + vy * self.p.lane_horizon
        a, b, c = (lanes.left, lanes.right)[side]
        d = (a * x + b * y + c) / sqrt(a * a + b * b) + offset
        f = d + LIMITS.radius if side == 0 else -(d - LIMITS.radius)
        return f / LIMITS.radius if self.p.normalise else f

    def violation(self, u, pose):
        o, velocity, total = self.o, self.velocity(u, pose[2], self.mean_noise), 0.0
        for j in self.discs:
            disc = o.obstacles[j]
            f = self.disc_f(disc, pose, velocity, disc.position.mean(axis=0), disc.velocity.mean(axis=0))
            total += max(0.0, f)
        for ends in o.walls:
            total += max(0.0, self.wall_f(ends, pose, velocity))
        if o.lanes is not None:
            for side, offsets in enumerate((o.lanes.left_offset, o.lanes.right_offset)):
                total += max(0.0, self.lane_f(side, u, pose, self.mean_noise, offsets.mean()))
        return total

    def nominal_at(self, dx, dy):
        pose = [self.mean[0] + dx, self.mean[1] + dy, self.mean[2]]
        violations = [self.violation(u, pose) for u in self.controls]
        least = max(0.0, min(violations)) * (1.0 + 1e-9)  # equal but for rounding is equal
        ranked = [(self.goal_cost(u, pose), k) for k, u in enumerate(self.controls) if violations[k] <= least]
        return min(ranked)[1]

    def constraint_samples(self, kind, j, u):
        """All f of one constraint at one control, clipped."""
        o, samples = self.o, []
        for i, (pose, noise) in enumerate(zip(o.robot_pose, o.control_noise, strict=True)):
            velocity = self.velocity(u, pose[2], noise)
            if kind == "disc":
                disc = o.obstacles[j]
                for position, obstacle_velocity in zip(disc.position, disc.velocity, strict=True):
                    samples.append(self.disc_f(disc, pose, velocity, position, obstacle_velocity))
            elif kind == "wall":
                samples.append(self.wall_f(o.walls[j], pose, velocity))
            else:
                offset = (o.lanes.left_offset, o.lanes.right_offset)[j][i]
                samples.append(self.lane_f(j, u, pose, noise, offset))
        return [max(f, -self.p.clip) for f in samples]

    def desired(self, kind, j):
        safe = [f for f in self.constraint_samples(kind, j, self.controls[self.nominal]) if f <= 0.0]
        if len(safe) < self.p.desired_min:
            angles = [self.mean[2] + 2.0 * pi * i / 8 for i in range(8)]
            beside = {self.nominal_at(self.p.ball * cos(a), self.p.ball * sin(a)) for a in angles}
            for k in beside - {self.nominal}:
                safe += [f for f in self.constraint_samples(kind, j, self.controls[k]) if f <= 0.0]
        return safe

    def risk(self, kind, j):
        """MMD^2 of every candidate, or MMD."""
        desired = self.desired(kind, j)
        values = []
        for u in self.controls:
            f = self.constraint_samples(kind, j, u)
            values.append(
                gram_mmd(f, desired, self.p) if desired else gram_mmd([max(0.0, x) for x in f], [0.0], self.p)
            )
        return values

    def evaluate(self):
        o = self.o
        self.cone = np.zeros((len(self.controls), len(o.obstacles) + len(o.walls)))
        self.lane = np.zeros((len(self.controls), 2))
        for j in self.discs:
            self.cone[:, j] = self.risk("disc", j)
        for j in range(len(o.walls)):
            self.cone[:, len(o.obstacles) + j] = self.risk("wall", j)
        for side in (0, 1) if o.lanes is not None else ():
            self.lane[:, side] = self.risk("lane", side)
        self.total = np.array(self.goal) + self.p.weight * self.cone.sum(axis=1)
        self.total += self.lane @ np.array(self.p.lane_weights)
        return self


def assert_same(observation, name, **parameters):
    controller = make_controller(name, LIMITS, PERIOD, **SMALL, **parameters)
    decision = controller.decide(observation)
    costs, literal = decision.costs, Literal(observation, controller.parameters)
    assert np.stack([costs.v, costs.omega], axis=1) == pytest.approx(np.array(literal.controls), abs=1e-12)
    assert costs.goal == pytest.approx(np.array(literal.goal), rel=1e-10)
    assert costs.nominal == literal.nominal
    if name == "mean":
        best = literal.nominal
        assert not costs.cone.any()
        assert not costs.lane.any()
    else:
        literal.evaluate()
        # Where a cost is zero by cancellation, what is left goes with the kernel's own size.
        size = 1.0 + np.abs(literal.cone).max(initial=0.0)
        assert costs.cone == pytest.approx(literal.cone, rel=1e-6, abs=1e-9 * size)
        assert costs.lane == pytest.approx(literal.lane, rel=1e-6, abs=1e-9)
        assert costs.total == pytest.approx(literal.total, rel=1e-6, abs=1e-9)
        best = int(np.argmin(literal.total))
    assert (decision.v, decision.omega) == pytest.approx(literal.controls[best], abs=1e-12)
    assert (decision.status == Status.INFEASIBLE_NOMINAL) == (not literal.feasible)
    return literal


@pytest.mark.parametrize("form", ["line", "ray", "segment"])
@pytest.mark.parametrize("degree", [1, 2, 3, 4])
@pytest.mark.parametrize("seed", [0, 1])
def test_rkhs_decides_as_written_down(observe, form, degree, seed):
    assert_same(observe(10 * degree + seed), "rkhs", form=form, degree=degree)


@pytest.mark.parametrize("normalise", [True, False])
@pytest.mark.parametrize("clip", [0.5, inf])
@pytest.mark.parametrize("window", ["reachable", "bounds"])
def test_rkhs_decides_as_written_down_whatever_is_switched(observe, normalise, clip, window):
    options = {"normalise": normalise, "clip": clip, "window": window, "degree": 2, "scale": 0.7, "offset": 1.3}
    assert_same(observe(31, spread=0.25), "rkhs", **options, horizon=1.5, preview=0.6, lane_weights=[2.0, 5.0])


@pytest.mark.parametrize("seed", range(3))
def test_rkhs_by_the_root_of_the_match_decides_as_written_down(observe, seed):
    assert_same(observe(seed), "rkhs", root=True, degree=2, lane_weights=[0.0, 0.0])


@pytest.mark.parametrize("seed", range(12))
def test_rkhs_paper_decides_as_written_down(observe, seed):
    assert_same(observe(seed, num_walls=seed % 2, far=9.0), "rkhs-paper")


@pytest.mark.parametrize("seed", range(10))
def test_few_or_no_safe_samples_are_topped_up_or_hinged_as_written_down(observe, seed):
    assert_same(observe(seed, **CROWDED), "rkhs", degree=1 + seed % 3, ball=0.3, window="bounds")


@pytest.mark.parametrize(
    ("seed", "hinged"), [(2, ("lane", 0)), (17, ("disc", 0)), (29, ("lane", 0)), (35, ("disc", 1))]
)
def test_where_nothing_safe_is_known_only_what_is_unsafe_is_charged_as_written_down(observe, seed, hinged):
    observation = observe(seed, **{**CROWDED, "num_samples": 1, "most": 1})
    settings = {"preview": 1.0, "heading_weight": 0.3, "clip": 3.0}  # at which these seeds have such a set
    literal = assert_same(observation, "rkhs", desired_min=0, window="bounds", degree=2, **settings)
    assert literal.desired(*hinged) == []
    # Some candidates are safe in this constraint, so that f and max(0, f) differ.
    kind, index = hinged
    assert min(f for u in literal.controls for f in literal.constraint_samples(kind, index, u)) < 0.0


@pytest.mark.parametrize(
    "sizes", [{"num_obstacles": 0}, {"num_walls": 0}, {"lanes": False}, {"num_samples": 1, "most": 1}]
)
@pytest.mark.parametrize("name", ["rkhs", "rkhs-paper", "mean"])
def test_every_method_decides_as_written_down_where_something_is_missing(observe, name, sizes):
    assert_same(observe(4, **sizes), name)


def test_only_what_is_near_counts_as_written_down(observe):
    literal = assert_same(observe(6, num_obstacles=5, far=8.0), "rkhs", sensing_range=6.0, max_obstacles=2)
    assert len(literal.discs) == 2
