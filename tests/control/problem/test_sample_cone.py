import numpy as np
import pytest

from mjnav.control.kernels.cone_kernel import ConeRule
from mjnav.control.parameters import Parameters
from mjnav.control.problem.problem import Problem
from mjnav.control.problem.samples import SampleCone
from mjnav.messages import RobotLimits

LIMITS = RobotLimits()


def problem_of(observation, **parameters):
    return Problem(observation, LIMITS, 0.1, Parameters(num_v=3, num_omega=4, **parameters))


RULES = [
    {},
    {"form": "line"},
    {"form": "ray"},
    {"horizon": np.inf},
    {"normalise": False},
    {"clip": np.inf},
    {"clip": 0.1, "horizon": 1.5},
]


@pytest.mark.parametrize("rule", RULES, ids=str)
@pytest.mark.parametrize("seed", range(4))
def test_the_samples_are_the_constraints_of_all_pairs(observe, constraint_samples, seed, rule):
    problem = problem_of(observe(seed, num_obstacles=4, far=7.0), **rule)
    c, cone = problem.candidates, problem.cone
    columns, _ = constraint_samples(problem)
    expected = [columns[column].T for column in cone.blocks.column]
    assert [len(f) for f in expected] == cone.sizes.tolist()
    for block, (f, samples) in enumerate(zip(expected, cone.stored_by_block(c.v, c.omega), strict=True)):
        assert cone.samples(block, c.v, c.omega) == pytest.approx(f, rel=1e-9, abs=1e-11)
        assert np.broadcast_to(samples.whole(), f.shape) == pytest.approx(f, rel=1e-9, abs=1e-11)


@pytest.mark.parametrize("rule", RULES, ids=str)
@pytest.mark.parametrize("degree", [1, 2, 3, 5])
def test_the_moments_are_means_of_powers_of_the_samples(observe, rule, degree):
    for seed in range(4):
        problem = problem_of(observe(seed, num_obstacles=4, far=7.0, num_samples=1 + 3 * (seed % 3)), **rule)
        c, cone = problem.candidates, problem.cone
        hinge = np.arange(len(cone.sizes)) % 2 == seed % 2
        moments = cone.raw_moments(c.v, c.omega, degree, hinge)
        assert moments.shape == (len(c.v), len(cone.sizes), degree)
        for block in range(len(cone.sizes)):
            f = cone.samples(block, c.v, c.omega)
            f = np.maximum(f, 0.0) if hinge[block] else f
            for p in range(1, degree + 1):
                size = (np.abs(f) ** p).mean()
                assert moments[:, block, p - 1] == pytest.approx((f**p).mean(axis=0), rel=1e-12, abs=1e-12 * size)


@pytest.mark.parametrize("seed", range(6))
def test_the_violation_of_a_moved_robot_is_that_of_a_robot_there(observe, seed):
    problem = problem_of(observe(seed, near=0.2, far=2.0, num_samples=1, most=1))
    c, cone, rule = problem.candidates, problem.cone, problem.cone.rule
    shifts = np.random.default_rng(seed).normal(scale=0.3, size=(3, 2))
    violation = cone.violation(c.v, c.omega, shifts)
    hinge = np.ones(len(cone.sizes), bool)
    for shift, row in zip(shifts, violation, strict=True):
        pose = problem.observation.robot_pose + np.append(shift, 0.0)
        moved = SampleCone.of(cone.blocks, rule, pose, problem.observation.control_noise, cone.preview)
        assert row == pytest.approx(moved.raw_moments(c.v, c.omega, 1, hinge).sum(axis=(1, 2)), rel=1e-12, abs=1e-13)


def test_a_segment_without_end_is_a_ray(observe):
    problem = problem_of(observe(1), horizon=np.inf)
    assert problem.cone.rule == ConeRule(problem_of(observe(1), form="ray").rule.form, np.inf, 2.0, -2.0)
