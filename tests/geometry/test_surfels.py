"""Surfels of lines and points, and what a scan beside them says, against literal references."""

import numpy as np
import pytest

from mjnav.geometry.evidence_grid import CELL, EvidenceGrid, add_scan
from mjnav.geometry.surfels import POINT, frame_error, normal_equations, surfels_of

REACH = 0.2
FRAME = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])


def drawn(points, noise=0.0, scans=8, frame=FRAME):
    """The grid of a floor on which these points are hit again and again."""
    rng, grid = np.random.default_rng(3), EvidenceGrid.around(0.0, 0.0, 3.0)
    for _ in range(scans):
        ends = points + rng.normal(0.0, noise, points.shape)
        add_scan(grid, ends - 1e-3, ends, np.ones(len(ends), bool), frame)
    return grid


def wall(angle=0.3, offset=0.4):
    """Points every 2 cm along a line, and its normal."""
    normal = np.array([-np.sin(angle), np.cos(angle)])
    along = np.arange(-1.5, 1.5, 0.02)
    return along[:, None] * [np.cos(angle), np.sin(angle)] + offset * normal, normal


def test_a_noisy_wall_is_a_line_to_a_few_millimetres():
    points, normal = wall()
    surfels = surfels_of(drawn(points, noise=0.01), REACH)
    lines = (surfels.normals != 0.0).any(axis=1)
    assert lines.mean() > 0.9
    away = surfels.places[lines] @ normal - 0.4
    turned = np.abs(surfels.normals[lines] @ normal)
    assert np.sqrt((away**2).mean()) < 0.004
    assert np.quantile(turned, 0.05) > np.cos(0.06)
    assert np.sqrt(surfels.scatter[lines].mean()) == pytest.approx(0.01, abs=0.006)


def test_a_leg_is_a_point_and_only_once_it_was_hit_often():
    leg = np.array([[1.01, 0.51]])
    assert len(surfels_of(drawn(leg, scans=3), REACH).places) == 0
    surfels = surfels_of(drawn(leg), REACH)
    np.testing.assert_allclose(surfels.places, leg, atol=1e-9)
    assert (surfels.normals == 0.0).all()


def test_a_scan_beside_a_wall_and_a_leg_weighs_as_the_equations_say():
    """Without weights: sum J^T J / var of the distances across, J by finite differences."""
    points, normal = wall()
    surfels = surfels_of(drawn(np.vstack([points, [[-0.99, -1.49]] * 3])), REACH)
    pose, variance, surface = np.array([0.05, -0.02, 0.4]), 4e-4, 1e-4
    c, s = np.cos(pose[2]), np.sin(pose[2])
    seen = np.array([[0.2, 0.51], [-0.4, 0.33], [-1.02, -1.44]])  # two beside the wall, one beside the leg
    scan = (seen - pose[:2]) @ np.array([[c, -s], [s, c]])

    def residuals(at):
        a, b = np.cos(at[2]), np.sin(at[2])
        q = at[:2] + scan @ np.array([[a, b], [-b, a]])
        return np.array([q[0] @ normal - 0.4, q[1] @ normal - 0.4, np.linalg.norm(q[2] - [-0.99, -1.49])])

    J = np.array([(residuals(pose + d) - residuals(pose - d)) / 2e-6 for d in 1e-6 * np.eye(3)]).T
    to_leg = (seen[2] - [-0.99, -1.49]) / residuals(pose)[2]
    beams = seen - pose[:2]
    beams /= np.linalg.norm(beams, axis=1)[:, None]
    along = np.array([beams[0] @ normal, beams[1] @ normal, beams[2] @ to_leg])
    weights = np.array([1.0, 1.0, POINT]) / (along**2 * variance + surface)
    hessian, gradient, explained = normal_equations(surfels, scan, np.full(3, variance), pose, surface, 1e12)
    np.testing.assert_allclose(hessian, (J.T * weights) @ J, rtol=2e-3, atol=1e-3)
    np.testing.assert_allclose(gradient, (J.T * weights) @ residuals(pose), rtol=2e-3, atol=1e-3)
    assert explained == pytest.approx(1.0)


def test_a_scan_far_from_all_says_nothing():
    surfels = surfels_of(drawn(wall()[0]), REACH)
    hessian, gradient, explained = normal_equations(surfels, np.array([[0.0, -2.0]]), np.ones(1), np.zeros(3), 1.0, 4.0)
    assert not hessian.any()
    assert not gradient.any()
    assert explained == 0.0
    assert not frame_error(surfels, np.array([[0.0, -2.0]]), np.zeros(3)).any()


def test_the_frame_of_a_scan_is_that_of_what_it_lies_on():
    points, _ = wall()
    grid = drawn(points)
    add = np.array([[-0.99, -1.49]])
    for _ in range(8):
        add_scan(grid, add - 1e-3, add, np.ones(1, bool), 3.0 * FRAME)
    surfels = surfels_of(grid, REACH)
    pose = np.array([0.1, 0.2, 0.0])
    found = frame_error(surfels, np.vstack([points[20:23], add]) - pose[:2], pose)
    np.testing.assert_allclose(found, (3.0 * FRAME + 3.0 * FRAME) / 4.0, rtol=1e-9)
    assert CELL < REACH
