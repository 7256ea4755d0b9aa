"""The circle behind an arc, of returns that are computed by hand."""

import numpy as np
import pytest

from mjnav.estimation.lidar.parts import CUT, OWN, Edge, fit_circle
from mjnav.estimation.lidar.scan import Rays

STEP = np.deg2rad(1.0)
INSIDE_95 = 5.991  # 95 % quantile of chi-squared with 2 degrees of freedom


def rays_at(centre, radius, spread=0.0, rng=None, shift=0.0) -> tuple[Rays, np.ndarray]:
    """Beams from the origin that meet a disc, a degree apart, and their numbers."""
    angles = np.arange(-90, 90) * STEP + shift
    u = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    ahead, offset = u @ centre, u[:, 0] * centre[1] - u[:, 1] * centre[0]
    hit = np.abs(offset) < radius
    ranges = np.where(hit, ahead - np.sqrt(np.maximum(radius**2 - offset**2, 0.0)), np.inf)
    ranges += 0.0 if rng is None else spread * rng.standard_normal(len(ranges))
    full = np.full(len(angles), max(spread, 0.005))
    return Rays(np.zeros_like(u), u, ranges, full, np.zeros(len(u)), STEP, 0.0, False, 0.0, 20.0), np.flatnonzero(hit)


def edge(rays, beam, other, kind=OWN) -> Edge:
    x, y = rays.directions[beam] + rays.directions[other]
    return Edge(kind, x / np.hypot(x, y), y / np.hypot(x, y), STEP)


def fitted(rays, beams, kinds=(OWN, OWN), radius=0.3, radius_std=0.05):
    edges = edge(rays, beams[0], beams[0] - 1, kinds[0]), edge(rays, beams[-1], beams[-1] + 1, kinds[1])
    return fit_circle(rays, beams, edges, radius, radius_std)


@pytest.mark.parametrize("radius", [0.2, 0.3, 0.4])
@pytest.mark.parametrize("centre", [(0.6, 0.0), (2.0, 1.0), (3.0, -2.0)])
def test_exact_returns_give_their_circle_whatever_radius_was_expected(centre, radius):
    circle = fitted(*rays_at(np.array(centre), radius))
    np.testing.assert_allclose((circle.x, circle.y, circle.radius), (*centre, radius), atol=0.01)


@pytest.mark.parametrize("distance", [1.0, 4.0, 7.5])
def test_the_centre_lies_in_its_95_percent_region_as_often(distance):
    rng, inside, num = np.random.default_rng(1), 0, 400
    for _ in range(num):
        angle = rng.uniform(-0.5, 0.5)
        centre = distance * np.array([np.cos(angle), np.sin(angle)])
        circle = fitted(*rays_at(centre, rng.normal(0.3, 0.02), 0.03, rng, rng.uniform(0.0, STEP)))
        error = np.array([circle.x, circle.y]) - centre
        covariance = np.array([[circle.xx, circle.xy], [circle.xy, circle.yy]])
        inside += error @ np.linalg.solve(covariance, error) < INSIDE_95
    assert 0.92 <= inside / num <= 0.99


def test_the_edge_of_what_hides_a_person_is_not_taken_for_theirs():
    centre = np.array([3.0, 0.4])
    rays, beams = rays_at(centre, 0.3)
    seen = beams[: len(beams) // 3]  # a pillar hides the left two thirds
    right, wrong = fitted(rays, seen, (OWN, CUT)), fitted(rays, seen, (OWN, OWN))
    assert np.hypot(right.x - centre[0], right.y - centre[1]) < 0.03
    assert wrong.strain > 16.0 > right.strain
    assert np.hypot(wrong.x - centre[0], wrong.y - centre[1]) > 0.1
