"""How far from Gaussian a controller's samples were."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from mjnav.messages import ObstacleSamples
from mjnav.study.sample_shape import SampleShape


def record(robot, *people, num_discs=0):
    """What of a tick the shape looks at; the discs come after the people."""
    discs = [*people, *[np.zeros((1, 2))] * num_discs]
    return SimpleNamespace(
        seen=SimpleNamespace(
            robot_pose=np.column_stack([robot, np.zeros(len(robot))]),
            obstacles=tuple(ObstacleSamples(disc, np.zeros_like(disc), 0.3) for disc in discs),
        ),
        tracks=people,
        cone=None,
    )


def shape_of(records):
    shape = SampleShape()
    for one in records:
        shape(one)
    return shape.figures()


def test_skew_and_kurtosis_are_scipys_unbiased_ones_over_ticks_axes_and_people():
    rng = np.random.default_rng(0)
    samples = rng.gamma(2.0, size=(6, 3, 25, 2))
    found = shape_of([record(robot, *people, num_discs=2) for robot, *people in samples])
    for name, of_kind in (("robot", samples[:, 0]), ("people", samples[:, 1:])):
        axis = of_kind.ndim - 2
        assert found[f"{name}_skew"] == pytest.approx(stats.skew(of_kind, axis=axis, bias=False).mean())
        kurtosis = stats.kurtosis(of_kind, axis=axis, bias=False, fisher=False).mean()
        assert found[f"{name}_kurtosis"] == pytest.approx(kurtosis)


def test_gaussian_samples_of_any_number_have_no_skew_and_kurtosis_3():
    rng = np.random.default_rng(1)
    for num in (5, 25):
        found = shape_of([record(rng.normal(size=(num, 2))) for _ in range(4000)])
        assert abs(found["robot_skew"]) < 0.05
        assert abs(found["robot_kurtosis"] - 3.0) < 0.1


def test_what_has_no_shape_is_none():
    known, few = shape_of([record(np.ones((25, 2)))]), shape_of([record(np.eye(3)[:, :2])])
    assert known["robot_skew"] is known["robot_kurtosis"] is known["people_skew"] is None
    assert few["robot_skew"] is few["robot_kurtosis"] is None
    assert shape_of([])["robot_skew"] is None
