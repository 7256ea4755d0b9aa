"""Sums of Gaussians: what a filter that is Gaussian under conditions takes in place of a skewed density."""

from dataclasses import dataclass

import numpy as np

from mjnav.constant import Constant
from mjnav.geometry.compiled import kernel
from mjnav.geometry.kernel_types import Cube, Matrix
from mjnav.messages import Array

NUM_ROUNDS = 200
LEAST_STD = 0.1  # of a component, in standard deviations of the draws: one that holds a single draw would shrink to it


@dataclass(frozen=True, slots=True)
class GaussianSum(Constant):
    """sum_k w_k N(m_k, C_k), of K components in d dimensions."""

    weights: Array  # (K,), sum 1
    means: Array  # (K, d)
    covariances: Array  # (K, d, d)

    @property
    def variance(self) -> Array:
        """The covariance of the whole sum, (d, d)."""
        centred = self.means - self.weights @ self.means
        return np.einsum("k,kij->ij", self.weights, self.covariances + centred[:, :, None] * centred[:, None])

    def stretched(self, covariance: Array) -> "GaussianSum":
        """The sum of L y, y of this one in two dimensions, with L the Cholesky factor of a covariance (2, 2)."""
        return GaussianSum(self.weights, *_stretched(self.means, self.covariances, np.ascontiguousarray(covariance)))

    def beside(self, other: "GaussianSum") -> "GaussianSum":
        """The sum in d + e dimensions of this one and an independent one."""
        i, j = (place.ravel() for place in np.indices((len(self.weights), len(other.weights))))
        d = self.means.shape[1]
        covariances = np.zeros((len(i), d + other.means.shape[1], d + other.means.shape[1]))
        covariances[:, :d, :d], covariances[:, d:, d:] = self.covariances[i], other.covariances[j]
        return GaussianSum(self.weights[i] * other.weights[j], np.hstack([self.means[i], other.means[j]]), covariances)


def fitted(draws: Array, num: int, least_std: float = 0.0) -> GaussianSum:
    """The sum of `num` Gaussians in one dimension that draws (n,) are likeliest under, by expectation maximisation.

    It starts from the draws cut into `num` equal parts by rank (Dempster, Laird & Rubin 1977). No component is narrower
    than LEAST_STD of the draws' std or than `least_std`. Draws that are all alike give one component.
    """
    draws = np.sort(draws)
    narrowest = max(LEAST_STD * float(draws.std()), least_std)
    if draws.std() <= least_std:
        num = 1
    parts = np.array_split(draws, num)
    weights = np.full(num, 1.0 / num)
    means = np.array([part.mean() for part in parts])
    stds = np.maximum([part.std() for part in parts], max(narrowest, 1e-12))
    for _ in range(NUM_ROUNDS if num > 1 else 0):
        density = weights * np.exp(-0.5 * ((draws[:, None] - means) / stds) ** 2) / stds
        share = density / density.sum(axis=1, keepdims=True)
        count = share.sum(axis=0)
        weights, means = count / len(draws), draws @ share / count
        spread = np.sqrt(((draws[:, None] - means) ** 2 * share).sum(axis=0) / count)
        stds = np.maximum(spread, narrowest)
    return GaussianSum(weights, means[:, None], np.square(stds)[:, None, None])


@kernel
def _stretched(means: Matrix, covariances: Cube, covariance: Matrix):
    """L m_k and L C_k L^T, (K, 2) and (K, 2, 2)."""
    a = np.sqrt(covariance[0, 0])
    b = covariance[1, 0] / a
    d = np.sqrt(max(covariance[1, 1] - b * b, 0.0))
    m, C = np.empty(means.shape), np.empty(covariances.shape)
    for k in range(len(means)):
        m[k, 0], m[k, 1] = a * means[k, 0], b * means[k, 0] + d * means[k, 1]
        xx, xy, yy = covariances[k, 0, 0], covariances[k, 0, 1], covariances[k, 1, 1]
        C[k, 0, 0], C[k, 0, 1] = a * a * xx, a * (b * xx + d * xy)
        C[k, 1, 0], C[k, 1, 1] = C[k, 0, 1], b * b * xx + 2.0 * b * d * xy + d * d * yy
    return m, C
