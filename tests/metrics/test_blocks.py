"""A run longer than a block has the figures that its states have all at once."""

import numpy as np
import pytest

from mjnav.metrics import consistency, progress
from mjnav.metrics.progress import ROWS, by_blocks


@pytest.mark.parametrize("num", [0, 1, ROWS - 1, ROWS, ROWS + 1, 2 * ROWS, 2 * ROWS + 1])
def test_the_rows_are_those_of_the_whole(num):
    first, second = np.arange(num), np.arange(num)[:, None] ** 2
    found = by_blocks(lambda a, b: a[:, None] - b, first, second)
    assert np.array_equal(found, first[:, None] - second)


def test_the_figures_of_a_long_run_are_those_of_all_its_states(trajectory_through, scenario_with):
    rng = np.random.default_rng(1)
    num = 2 * ROWS + 2
    route, people = rng.uniform(0.0, 9.0, (num, 2)), rng.uniform(0.0, 9.0, (num, 2, 2))
    trajectory = trajectory_through(route, people=people)
    trajectory.estimate[:, :2] += rng.normal(size=(num - 1, 2))
    trajectory.tracks[..., :2] += rng.normal(size=(num - 1, 2, 2))
    errors = (
        (consistency.localization_rmse(trajectory), trajectory.estimate[:, :2] - route[:-1]),
        (consistency.tracking_rmse(trajectory), trajectory.tracks[..., :2] - people[:-1]),
    )
    for found, error in errors:
        assert found == pytest.approx(np.sqrt((error**2).sum(-1).mean()))
    distance = np.abs(route[:, 1])  # from the way along the x axis
    expected = np.trapezoid(distance) / (num - 1), distance.max()
    assert progress.deviation(trajectory, scenario_with()) == pytest.approx(expected)
