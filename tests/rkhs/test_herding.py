from itertools import combinations

import numpy as np
import pytest

from mjnav.errors import InvalidValue
from mjnav.rkhs.herding import herded
from mjnav.rkhs.joint_gram import joint_gram


def mmd_squared_from_all(gram, chosen):
    """Of equal weights on the chosen from equal weights on all, by the definition."""
    w = np.zeros(len(gram))
    w[chosen] = 1.0 / len(chosen)
    w -= 1.0 / len(gram)
    return w @ gram @ w


@pytest.mark.parametrize(("dimension", "num"), [(2, 12), (40, 48)])
def test_herded_samples_are_nearer_to_all_than_ninety_five_of_a_hundred_random_subsets(dimension, num):
    rng = np.random.default_rng(dimension)
    samples = rng.gamma(2.0, size=(200, dimension)) * 10.0 ** rng.integers(-2, 3, size=dimension)
    gram = joint_gram(samples)
    by_chance = [mmd_squared_from_all(gram, rng.permutation(200)[:num]) for _ in range(200)]
    assert mmd_squared_from_all(gram, herded(samples, num)) < 0.5 * np.quantile(by_chance, 0.05)


def test_without_exchange_every_choice_is_the_one_that_leaves_the_least_distance():
    samples = np.random.default_rng(1).normal(size=(15, 3))
    gram, chosen = joint_gram(samples), []
    for _ in range(6):
        left = [i for i in range(15) if i not in chosen]
        chosen.append(min(left, key=lambda i: mmd_squared_from_all(gram, [*chosen, i])))
        assert herded(samples, len(chosen), rounds=0).tolist() == sorted(chosen)


def test_no_exchange_of_one_sample_is_left_that_would_bring_them_nearer():
    samples = np.random.default_rng(2).normal(size=(20, 4))
    gram, chosen = joint_gram(samples), herded(samples, 5, rounds=50).tolist()
    least = mmd_squared_from_all(gram, chosen)
    for old in chosen:
        for new in set(range(20)) - set(chosen):
            assert mmd_squared_from_all(gram, [new if i == old else i for i in chosen]) >= least - 1e-12


def test_of_two_clusters_each_has_its_share():
    # 8 and 4 samples at two places: 3 of 12 are two of the first and one of the second, the best of all subsets.
    samples = np.repeat([[0.0], [1.0]], [8, 4], axis=0) + 0.01 * np.random.default_rng(0).normal(size=(12, 1))
    gram, chosen = joint_gram(samples, 0.5), herded(samples, 3, bandwidth=0.5)
    assert (chosen < 8).sum() == 2
    best = min(mmd_squared_from_all(gram, list(subset)) for subset in combinations(range(12), 3))
    assert mmd_squared_from_all(gram, chosen) <= best + 1e-4


def test_all_samples_stand_for_themselves_and_equal_ones_are_taken_in_order():
    assert herded(np.random.default_rng(0).normal(size=(6, 2)), 6).tolist() == [0, 1, 2, 3, 4, 5]
    assert herded(np.ones((6, 2)), 3).tolist() == [0, 1, 2]


@pytest.mark.parametrize("num", [0, 4])
def test_a_number_that_is_not_there_is_refused(num):
    with pytest.raises(InvalidValue, match="num: found"):
        herded(np.zeros((3, 1)), num)
