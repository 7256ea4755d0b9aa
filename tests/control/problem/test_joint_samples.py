"""The violation of rollouts, against the same sentence written out in plain Python."""

from dataclasses import replace
from math import exp, hypot

import numpy as np
import pytest

from mjnav.constraints import lane_distance
from mjnav.control import make_controller
from mjnav.control.problem.joint_samples import JointSamples
from mjnav.control.problem.obstacles import Reach, positions_at
from mjnav.control.rollouts import ControlLimits, Rollouts
from mjnav.geometry.distances import segment_distance
from mjnav.messages import ObstacleSamples

STEPS, STEP = 6, 0.4
TIMES = STEP * np.arange(1, STEPS + 1)
MARGIN, FADING, STANDING = 0.2 + 0.1 * TIMES, np.exp(-TIMES / 3.0), 0.15


def samples_of(observation, limits, times=TIMES):
    """The problem of rkhs-plan with a margin of 3 cm, and its joint samples."""
    problem = make_controller("rkhs-plan", limits, 0.1, safety_margin=0.03).problem(observation)
    reach = Reach(problem.near_discs, tuple(range(len(observation.walls))))
    return problem, JointSamples.of(problem, reach, len(times), times[0])


def rollouts_of(problem, num, seed=0):
    o, rng = problem.observation, np.random.default_rng(seed)
    wanted = rng.normal(scale=1.0, size=(2, STEPS, num)) + np.array([0.5, 0.0])[:, None, None]
    return Rollouts.of(wanted, problem.mean_pose[2], ControlLimits.of(o.twist, problem.limits, 0.1, STEP), STEP)


def literal(problem, rollouts, s, k):
    """h_s(k) = max over j, t of gamma min(2, [R + m - d]_+ / m)."""
    o, radius = problem.observation, problem.limits.radius
    h = max(of_disc(problem, rollouts, s, k, *disc) for disc in problem.limits.discs)
    for t in range(STEPS if o.lanes is not None else 0):
        robot = start_of(o, s) + np.array([rollouts.x[t, k], rollouts.y[t, k]])
        left = float(lane_distance(robot, o.lanes.left)) + o.lanes.left_offset[s]
        right = float(lane_distance(robot, o.lanes.right)) + o.lanes.right_offset[s]
        h = max(h, *(min(2.0, (depth + STANDING) / STANDING) for depth in (left + radius, radius - right)))
    return h


def start_of(o, s):
    heading, drift = o.robot_pose[s, 2], 0.1 * o.control_noise[s, 0]
    return o.robot_pose[s, :2] + drift * np.array([np.cos(heading), np.sin(heading)])


def of_disc(problem, rollouts, s, k, ahead, radius):
    """The same of what one disc of the robot, `ahead` of its centre, meets."""
    o, h, start = problem.observation, 0.0, start_of(problem.observation, s)
    parts = int(np.ceil(STEP * problem.limits.max_speed / 0.25))
    way = np.concatenate([np.zeros((1, 2)), np.stack([rollouts.x[:, k], rollouts.y[:, k]], axis=-1)])
    heading = np.array([problem.mean_pose[2], *rollouts.heading[:, k]])
    way = way + ahead * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    for t in range(STEPS):
        robot = start + way[t + 1]
        on_the_way = [start + way[t] + (way[t + 1] - way[t]) * (i + 1) / parts for i in range(parts)]
        bodies = []  # depth below R, margin, gamma
        for disc in o.obstacles:
            at = positions_at(disc, TIMES[[t]])[0, s % len(disc.position)]
            stands = len(disc.position) == 1 and disc.future is None and not disc.velocity.any()
            depth = radius + 0.03 + disc.radius - min(hypot(*(p - at)) for p in (on_the_way if stands else [robot]))
            bodies.append((depth, STANDING, 1.0) if stands else (depth, 0.2 + 0.1 * TIMES[t], exp(-TIMES[t] / 3.0)))
        for wall in o.walls:
            depth = radius + 0.03 - min(float(segment_distance(p, *wall)) for p in on_the_way)
            bodies.append((depth, STANDING, 1.0))
        h = max([h, *(gamma * min(2.0, max(0.0, depth + m) / m) for depth, m, gamma in bodies)])
    return h


@pytest.mark.parametrize("cover", [(), ((-0.2, 0.15), (0.0, 0.18), (0.25, 0.15))])
@pytest.mark.parametrize("seed", range(6))
def test_the_violation_is_the_worst_over_time_and_obstacles_of_each_joint_sample(observe, limits, seed, cover):
    limits = replace(limits, cover=cover)
    o = observe(seed, num_obstacles=4, most=9, num_walls=seed % 3, lanes=seed % 2 == 0, far=3.0)
    first, second, third, fourth = o.obstacles  # M from 1 to 9, the robot has 5 samples
    ahead = np.random.default_rng(seed).normal(size=(len(second.position), 3, 2)) + second.position[:, None]
    pillar = ObstacleSamples(third.position[:1], np.zeros((1, 2)), 0.3)
    o = replace(o, obstacles=(first, replace(second, future=ahead, step=0.7), pillar, fourth))
    problem, samples = samples_of(o, limits)
    rollouts = rollouts_of(problem, 15, seed)
    found = samples.violation(rollouts, MARGIN, FADING, STANDING)
    expected = [[literal(problem, rollouts, s, k) for s in range(5)] for k in range(15)]
    assert found == pytest.approx(np.array(expected), abs=1e-9)
    assert found.max() > 0.0


def test_among_many_bodies_at_rest_every_one_of_them_counts(alone, limits):
    rng, o = np.random.default_rng(3), alone(num_samples=9, twist=(0.5, 0.0))
    places = rng.uniform(-6.0, 6.0, (60, 2))
    ends = places + np.where(np.arange(60)[:, None] < 45, 0.0, rng.normal(size=(60, 2)))  # pillars, then walls
    problem, samples = samples_of(o, limits)
    radii = rng.choice([0.05, 0.15], 60) - limits.radius - 0.03  # less the robot: many are near
    samples = replace(samples, standing=np.hstack([places, ends]), standing_radius=radii)
    rollouts = rollouts_of(problem, 40)
    found = samples.violation(rollouts, MARGIN, FADING, STANDING)
    x, y = rollouts.between(samples.parts)
    at = np.stack([x[..., None] + samples.offsets[0], y[..., None] + samples.offsets[1]], axis=-1)
    robot = limits.radius + 0.03
    gaps = [segment_distance(at, a, b) - r - robot for a, b, r in zip(places, ends, radii, strict=True)]
    expected = np.clip(1.0 - np.min(gaps, axis=(0, 1)) / STANDING, 0.0, 2.0)
    assert found == pytest.approx(expected, abs=1e-9)
    assert 0.1 < (expected > 0.0).mean() < 0.9


def test_a_fast_robot_does_not_plan_through_a_pillar_between_two_steps(alone, limits):
    fast, pillar = replace(limits, max_speed=2.0), ObstacleSamples(np.array([[1.0, 0.35]]), np.zeros((1, 2)), 0.1)
    o = alone(num_samples=1, twist=(2.0, 0.0), obstacles=[pillar])
    _, samples = samples_of(o, fast, TIMES)
    straight = np.zeros((2, STEPS, 1))
    straight[0] = 2.0
    rollouts = Rollouts.of(straight, 0.0, ControlLimits.of(o.twist, fast, 0.1, STEP), STEP)
    assert np.hypot(rollouts.x - 1.0, 0.35).min() > 0.38 + 0.02  # at 0.8 and at 1.6 m nothing is near
    assert samples.violation(rollouts, MARGIN, FADING, 0.02)[0, 0] >= 1.0


def one_body(alone, limits, distance, *, moves):
    """h of a robot at rest with one body of R = 0.55 at a distance from it, margins of 0.2 m, gamma = 0.5."""
    velocity = np.full((1, 2), 1e-12 if moves else 0.0)
    body = ObstacleSamples(np.array([[distance, 0.0]]), velocity, 0.3)
    _, samples = samples_of(alone(num_samples=1, twist=(0.0, 0.0), obstacles=[body]), limits, TIMES[:1])
    zero, east = np.zeros((1, 1)), np.array([[[1.0]], [[0.0]]])
    at_rest = Rollouts(np.zeros((2, 1, 1)), zero, zero, zero, east, STEP)
    half, margin = np.array([0.5]), np.array([0.2])
    return samples.violation(at_rest, margin, half, 0.2)[0, 0]


@pytest.mark.parametrize(
    ("distance", "depth"), [(0.55, 1.0), (0.75, 0.0), (0.9, 0.0), (0.65, 0.5), (0.45, 1.5), (0.35, 2.0), (0.0, 2.0)]
)
def test_a_contact_is_1_the_margins_edge_0_and_nothing_above_2_what_moves_fades(alone, limits, distance, depth):
    assert one_body(alone, limits, distance, moves=False) == pytest.approx(depth, abs=1e-9)
    assert one_body(alone, limits, distance, moves=True) == pytest.approx(0.5 * depth, abs=1e-9)
