import numpy as np
import pytest

from mjnav.compile.compiled import Matrix, exact
from mjnav.motion.neighbours import near, sort_into_cells


@exact
def near_all(position: Matrix, radius: float):
    cells, num = sort_into_cells(position, radius), len(position)
    found, out = np.full((num, num), -1), np.empty(num, np.int64)
    for i in range(num):
        if not np.isnan(position[i, 0]):
            count = near(out, position, position[i, 0], position[i, 1], radius, cells)
            found[i, :count] = out[:count]
    return found


def neighbours(position, radius):
    """For each point of (m, 2) [m] the indices, ascending, of the others within `radius` [m]."""
    return [[j for j in row if j not in (-1, i)] for i, row in enumerate(near_all(position, radius).tolist())]


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
