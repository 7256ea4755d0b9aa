"""Mixtures on the line: EM against the textbook and scikit-learn, divergences against closed forms and quadrature."""

import warnings
from math import log

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjnav.control.kernels.mixture import Mixtures, fit_mixtures, kl_divergence

FLOOR = 0.1
SAMPLES = st.lists(st.floats(-2.0, 1.0), min_size=1, max_size=40).map(lambda x: np.array(x)[:, None])
# What the constraints look like: skewed, cut off below, of two kinds, of one.
SHAPES = {
    "clipped": lambda rng, n: np.maximum(rng.gamma(2.0, 0.5, n) - 2.5, -2.0),
    "skewed": lambda rng, n: 1.0 - rng.gamma(2.0, 0.4, n),
    "bimodal": lambda rng, n: np.where(rng.random(n) < 0.3, rng.normal(-1.5, 0.2, n), rng.normal(0.5, 0.3, n)),
    "uniform": lambda rng, n: rng.uniform(-2.0, 1.0, n),
    "narrow": lambda rng, n: rng.normal(-1.0, 0.01, n),
}


def start(x, num_components):
    """Weights, means and standard deviations (C,) that EM starts from."""
    offsets = np.linspace(-1.0, 1.0, num_components) if num_components > 1 else np.zeros(1)
    return (
        np.full(num_components, 1.0 / num_components),
        x.mean() + offsets * x.std(),
        np.full(num_components, x.std() / num_components),
    )


def log_density(x, mixtures, k=0):
    """log p of each x (n,) under mixture k."""
    w, m, v = mixtures.weight[:, k], mixtures.mean[:, k], mixtures.variance[:, k]
    terms = np.log(w) - 0.5 * np.log(2.0 * np.pi * v) - (x[:, None] - m) ** 2 / (2.0 * v)
    return np.logaddexp.reduce(terms, axis=1)


def gaussian(mean, std):
    return Mixtures(np.ones((1, 1)), np.array([[mean]]), np.array([[std**2]]))


def random_mixtures(seed, num_components=2):
    rng = np.random.default_rng(seed)
    weight = rng.dirichlet(np.ones(num_components), 1).T
    return Mixtures(weight, rng.uniform(-2.0, 1.0, weight.shape), rng.uniform(0.2, 0.6, weight.shape) ** 2)


@pytest.mark.parametrize("shape", ["skewed", "bimodal", "uniform"])
@pytest.mark.parametrize("num_components", [1, 2, 3])
@pytest.mark.parametrize("num_iterations", [1, 10])
def test_em_is_scikit_learns_from_the_same_start(shape, num_components, num_iterations):
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.mixture import GaussianMixture

    x = SHAPES[shape](np.random.default_rng(num_components), 625)
    weights, means, stds = start(x, num_components)
    model = GaussianMixture(
        num_components, tol=0.0, reg_covar=0.0, max_iter=num_iterations, weights_init=weights,
        means_init=means[:, None], precisions_init=1.0 / stds[:, None, None] ** 2,
    )  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        model.fit(x[:, None])
    fitted = fit_mixtures(x[:, None], num_components, num_iterations, 1e-4, num_cells=len(x))
    assert fitted.weight[:, 0] == pytest.approx(model.weights_, abs=1e-6)
    assert fitted.mean[:, 0] == pytest.approx(model.means_[:, 0], abs=1e-6)
    assert fitted.variance[:, 0] == pytest.approx(model.covariances_[:, 0, 0], abs=1e-6)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("num_components", [2, 3])
def test_cells_move_a_mixture_by_little_and_cost_no_likelihood(shape, num_components):
    x = np.stack([SHAPES[shape](np.random.default_rng(seed), 625) for seed in range(20)], axis=1)
    cells = fit_mixtures(x, num_components, 10, 0.2)
    exact = fit_mixtures(x, num_components, 10, 0.2, num_cells=625)
    assert (cells.mean != exact.mean).any() or shape == "narrow"  # there are cells
    size = np.ptp(x)
    assert cells.weight == pytest.approx(exact.weight, abs=5e-3)
    assert cells.mean == pytest.approx(exact.mean, abs=2e-3 * size)
    assert np.sqrt(cells.variance) == pytest.approx(np.sqrt(exact.variance), abs=2e-3 * size)
    for k in range(20):
        gain = (log_density(x[:, k], cells, k) - log_density(x[:, k], exact, k)).mean()
        assert gain == pytest.approx(0.0, abs=5e-4)


@given(SAMPLES, st.integers(1, 3), st.integers(2, 50))
def test_every_mixture_is_one(x, num_components, num_cells):
    m = fit_mixtures(x, num_components, 10, FLOOR, num_cells=num_cells)
    assert m.weight.sum() == pytest.approx(1.0)
    assert (m.weight > 0.0).all()
    assert (m.variance >= FLOOR**2).all()
    assert (m.weight * m.mean).sum() == pytest.approx(x.mean(), abs=1e-9)  # what EM keeps
    assert x.min() - 1e-9 <= m.mean.min() <= m.mean.max() <= x.max() + 1e-9


@pytest.mark.parametrize("n", [1, 2, 40, 625])
@pytest.mark.parametrize("value", [-2.0, 0.0, 1e4])
def test_an_atom_is_a_gaussian_with_the_floors_width(n, value):
    rounded = value * (1.0 + 1e-16 * np.arange(n))
    m = fit_mixtures(rounded[:, None], 2, 10, FLOOR)
    assert m.mean[:, 0] == pytest.approx([value, value], rel=1e-12, abs=1e-12)
    assert m.variance[:, 0] == pytest.approx([FLOOR**2] * 2, rel=1e-12)


@given(st.floats(-2.0, 1.0), st.floats(0.1, 2.0), st.floats(-2.0, 1.0), st.floats(0.1, 2.0))
def test_the_divergence_of_two_gaussians_is_the_closed_form(mean, std, other, other_std):
    expected = log(other_std / std) + (std**2 + (mean - other) ** 2) / (2.0 * other_std**2) - 0.5
    assert kl_divergence(gaussian(mean, std), gaussian(other, other_std))[0] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("num_components", [1, 2, 3])
def test_the_divergence_of_equal_mixtures_is_zero(num_components):
    for seed in range(20):
        m = random_mixtures(seed, num_components)
        assert kl_divergence(m, m)[0] == 0.0
        turned = Mixtures(m.weight[::-1], m.mean[::-1], m.variance[::-1])
        assert kl_divergence(m, turned)[0] == pytest.approx(0.0, abs=1e-14)


def test_what_is_far_apart_diverges_by_a_number():
    atom, far = gaussian(-2.0, 1e-3), gaussian(1e6, 1e-3)
    dying = Mixtures(np.array([[1.0], [1e-18]]), np.array([[-2.0], [1e6]]), np.full((2, 1), 1e-6))
    for f in (atom, far, dying):
        for g in (atom, far, dying):
            assert 0.0 <= kl_divergence(f, g)[0] < np.inf
    assert kl_divergence(atom, far)[0] == pytest.approx(0.5 * (1e6 + 2.0) ** 2 / 1e-6)
