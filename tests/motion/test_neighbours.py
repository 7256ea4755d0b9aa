import numpy as np
import pytest

from mjnav.motion.neighbours import neighbours


@pytest.mark.parametrize(("spread", "radius"), [(0.5, 2.0), (20.0, 2.0), (20.0, 0.01), (1e6, 0.5), (0.0, 1.0)])
@pytest.mark.parametrize("num", [70, 400])  # in one cell, and in many
def test_the_neighbours_are_those_of_a_search_pair_by_pair_in_the_order_of_their_indices(num, spread, radius):
    rng = np.random.default_rng(0)
    point = rng.uniform(-spread, spread, (num, 2)) + rng.choice([0.0, 3.0 * radius], (num, 1))
    point[::2] = point[rng.integers(0, num, num // 2)] + rng.normal(0.0, 0.5 * radius, (num // 2, 2))
    point[[3, 40]] = np.nan
    with np.errstate(invalid="ignore"):
        close = ((point[:, None] - point) ** 2).sum(-1) <= radius**2
    expected = [[j for j in range(num) if close[i, j] and j != i] for i in range(num)]
    assert neighbours(point, radius) == expected
    assert any(expected)
    assert not expected[3]


def test_nobody_has_no_neighbours():
    assert neighbours(np.full((2, 2), np.nan), 1.0) == [[], []]
    assert neighbours(np.zeros((0, 2)), 1.0) == []
