"""The bound on the number of particles, against the chi-square quantile that it stands for."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.stats import chi2

from mjnav.estimation.lidar.cloud import EPSILON, kld_bound, occupied_bins


@pytest.mark.parametrize("num_bins", [5, 20, 100, 1000])
def test_it_is_foxs_bound_with_the_quantile_of_wilson_and_hilferty(num_bins):
    exact = chi2.ppf(0.99, num_bins - 1) / (2.0 * EPSILON)
    assert kld_bound(num_bins) == pytest.approx(exact, rel=0.01, abs=1.0)


def test_the_published_size_of_a_single_bin_and_the_growth_with_more():
    # Fox 2003, section 3.2: epsilon 0.05, delta 0.01, by hand for k = 2: 10 (1 - 2/9 + sqrt(2/9) 2.3263)^3 = 65.9.
    assert (kld_bound(1), kld_bound(2)) == (1, 66)
    bounds = [kld_bound(k) for k in range(1, 200)]
    assert all(a < b for a, b in pairwise(bounds))


def test_bins_are_counted_once_whatever_they_hold():
    particles = np.array([[0.01, 0.01, 0.01], [0.04, 0.02, 0.03], [-0.01, 0.01, 0.01], [5.0, -7.0, 3.0]])
    assert occupied_bins(particles, (0.05, 0.05, 0.05)) == 3
    many = np.random.default_rng(3).normal(size=(2000, 3))
    assert occupied_bins(many, (0.05, 0.05, 0.05)) == len(np.unique(np.floor(many / 0.05), axis=0))
