import numpy as np
import pytest

from mjnav.control.parameters import Parameters
from mjnav.control.problem.desired import Desired
from mjnav.control.problem.problem import Problem
from mjnav.messages import RobotLimits
from mjnav.rkhs.mmd import raw_moments


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("least", [0, 25, 10_000])
def test_the_moments_of_all_desired_sets_are_those_of_each(seed, least, observe):
    problem = Problem(observe(seed), RobotLimits(), 0.1, Parameters())
    desired = Desired(problem, least, 0.15)
    moments, sizes = desired.raw_moments(4)
    assert len(sizes) == len(problem.cone.blocks.column) > 0
    for block, (moment, size) in enumerate(zip(moments, sizes, strict=True)):
        samples = desired.samples(block)
        assert size == len(samples)
        expected = raw_moments(samples, 4) if size else np.zeros(4)
        assert moment == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_some_desired_sets_are_topped_up_and_some_stay_empty(observe):
    plain, topped, empty = 0, 0, 0
    for seed in range(12):
        problem = Problem(observe(seed), RobotLimits(), 0.1, Parameters())
        _, few = Desired(problem, 0, 0.15).raw_moments(1)
        _, many = Desired(problem, 25, 0.15).raw_moments(1)
        plain, topped, empty = plain + (few == many).sum(), topped + (many > few).sum(), empty + (many == 0).sum()
    assert min(plain, topped, empty) > 0
