import numpy as np
import pytest

from mjnav.rkhs.joint_gram import joint_gram, standardised


def literal_gram(samples, bandwidth):
    """The definition, pair by pair."""
    x = (samples - samples.mean(axis=0)) / samples.std(axis=0)
    distance = np.array([[np.linalg.norm(a - b) for b in x] for a in x])
    pairs = np.sort(distance[np.triu_indices(len(x), 1)])
    return np.exp(-(distance**2) / (2.0 * (bandwidth * pairs[len(pairs) // 2]) ** 2))


@pytest.mark.parametrize("bandwidth", [1.0, 0.3])
def test_the_gram_matrix_is_that_of_the_definition(bandwidth):
    rng = np.random.default_rng(0)
    samples = rng.gamma(2.0, size=(30, 7)) * 10.0 ** rng.integers(-3, 4, size=7)
    found = joint_gram(samples, bandwidth)
    assert found == pytest.approx(literal_gram(samples, bandwidth), rel=1e-12)
    assert (found == found.T).all()


def test_three_points_on_a_line_are_known_exactly():
    # At 0, 1, 3 the distances are 1, 2, 3: the median is 2, whatever the unit.
    for unit in (1.0, 1e-3):
        gram = joint_gram(unit * np.array([[0.0], [1.0], [3.0]]))
        assert gram[[0, 1, 0], [1, 2, 2]] == pytest.approx(np.exp(-np.array([1.0, 4.0, 9.0]) / 8.0), rel=1e-12)


def test_units_and_coordinates_that_do_not_vary_make_no_difference():
    samples = np.random.default_rng(1).normal(size=(12, 3))
    other = np.column_stack([5.0 + 1000.0 * samples[:, 0], samples[:, 1], np.full(12, 0.1), -samples[:, 2]])
    assert joint_gram(other) == pytest.approx(joint_gram(samples), rel=1e-12)
    assert standardised(other)[:, 2].tolist() == [0.0] * 12


def test_samples_that_coincide_have_similarity_one():
    assert joint_gram(np.full((4, 3), 0.1)).tolist() == np.ones((4, 4)).tolist()
    assert joint_gram(np.zeros((1, 3))).tolist() == [[1.0]]
    assert joint_gram(np.zeros((3, 0))).tolist() == np.ones((3, 3)).tolist()
    # Of six pairs three coincide, of ten six: then the root mean square, 4 d^2 / 10, is the bandwidth.
    gram = joint_gram(np.array([[0.0], [0.0], [0.0], [0.0], [1.0]]))
    assert gram[0, 4] == pytest.approx(np.exp(-1.0 / (2.0 * 0.4)), rel=1e-12)
    assert gram[0, 1] == 1.0
