"""Mixture Kalman filter (Chen & Liu 2000), and the sums of Gaussians that it takes in place of a skewed density.

Each particle is a history of modes, and Gaussian given that history. A particle i has a weight w_i and the moments
m_i (4,), P_i (4, 4) of a state (x, y, vx, vy). What a particle can do next is not drawn but listed, each with its
probability, and so is each component k of the measurement's noise, a sum of Gaussians. All the products

    w_i c_k N(z; H m_i + b_k, H P_i H^T + R_k)

are known before one has to be chosen, so the proposal is the optimal one, and of more than n products n are kept by
the resampling that disturbs the weights least (Fearnhead & Clifford 2003).

The measurement is of the position `age` seconds before the time of the state: H = (I, -age I).
"""

from dataclasses import dataclass

import numpy as np

from mjnav.compile.compiled import Cube, Indices, Matrix, Vector, exact, kernel, scalar
from mjnav.constant import Constant
from mjnav.filters.particles import systematic
from mjnav.messages import Array

# --------------------------------------------------------------------------------------------- filter


NEGLIGIBLE = 1e-12  # of all weight: a particle with less is dropped


@exact
def kept(weights: Vector, num: int, offset: float):
    """Which of n particles to keep, and their weights: (k,) each, k <= num + 1, for `offset` from U(0, 1).

    Optimal resampling (Fearnhead & Clifford 2003, "On-line inference for hidden Markov models via particle filters",
    section 3): with c such that sum_i min(w_i / c, 1) = num, every w_i >= c stays as it is, and of the others each
    survives with probability w_i / c, by systematic draws, and then weighs c. On average no weight changes.
    """
    total = weights.sum()
    least, count = NEGLIGIBLE * total, 0
    for w in weights:
        count += w > least
    threshold = 0.0
    if count > num:
        threshold = total / num
        while True:  # from above: a lower threshold keeps more as they are, which lowers it again
            above, rest = 0, 0.0
            for w in weights:
                if w >= threshold:
                    above += 1
                else:
                    rest += w
            lower = rest / (num - above) if above < num else threshold
            if lower >= threshold:
                break
            threshold = lower
    indices, new = np.empty(min(count, num + 1), np.int64), np.empty(min(count, num + 1))
    found, position = 0, offset * threshold
    for i in range(len(weights)):
        w = weights[i]
        if count > num:
            if w < threshold:
                position -= w
                if position >= 0.0:
                    continue
                position += threshold
                w = threshold
        elif w <= least:
            continue
        if found < len(indices):
            indices[found], new[found] = i, w
            found += 1
    return indices[:found], new[:found] / new[:found].sum()


@scalar
def _density(dx, dy, a, b, d):
    """Of N(0, [[a, b], [b, d]]) at (dx, dy)."""
    determinant = a * d - b * b
    square = (d * dx * dx - 2.0 * b * dx * dy + a * dy * dy) / determinant
    return np.exp(-0.5 * square) / (2.0 * np.pi * np.sqrt(determinant))


@scalar
def _innovation(P, age):
    """H P H^T of a position `age` [s] ago: its entries 00, 01, 11."""
    a = P[0, 0] - age * (P[0, 2] + P[2, 0]) + age * age * P[2, 2]
    b = P[0, 1] - age * (P[0, 3] + P[2, 1]) + age * age * P[2, 3]
    d = P[1, 1] - age * (P[1, 3] + P[3, 1]) + age * age * P[3, 3]
    return a, b, d


@kernel
def explained(
    weights: Vector,
    mean: Matrix,
    covariance: Cube,
    measured: Vector,
    age: float,
    share: Vector,
    bias: Matrix,
    noise: Cube,
    floor: float,
):
    """w_i c_k N(z; H m_i + b_k, H P_i H^T + R_k) of n particles and K components, and w_i floor: (n (K + 1),)."""
    n, num = len(weights), len(share)
    joint = np.empty(n * (num + 1))
    for i in range(n):
        a, b, d = _innovation(covariance[i], age)
        dx = measured[0] - mean[i, 0] + age * mean[i, 2]
        dy = measured[1] - mean[i, 1] + age * mean[i, 3]
        for k in range(num):
            density = _density(
                dx - bias[k, 0], dy - bias[k, 1], a + noise[k, 0, 0], b + noise[k, 0, 1], d + noise[k, 1, 1]
            )
            joint[i * (num + 1) + k] = weights[i] * share[k] * density
        joint[i * (num + 1) + num] = weights[i] * floor
    return joint


@kernel
def corrected(chosen: Indices, mean: Matrix, covariance: Cube, measured: Vector, age: float, bias: Matrix, noise: Cube):
    """Particles, means and covariances (k,), (k, 4), (k, 4, 4) after the update, of the `chosen` of `explained`.

    What the floor explains is not updated.
    """
    num = len(bias)
    owner, m, P = np.empty(len(chosen), np.int64), np.empty((len(chosen), 4)), np.empty((len(chosen), 4, 4))
    PH, K = np.empty((4, 2)), np.empty((4, 2))
    for j in range(len(chosen)):
        i, k = chosen[j] // (num + 1), chosen[j] % (num + 1)
        owner[j] = i
        before = covariance[i]
        if k == num:
            for r in range(4):
                m[j, r] = mean[i, r]
                for s in range(4):
                    P[j, r, s] = before[r, s]
            continue
        a, b, d = _innovation(before, age)
        a, b, d = a + noise[k, 0, 0], b + noise[k, 0, 1], d + noise[k, 1, 1]
        determinant = a * d - b * b
        dx = measured[0] - bias[k, 0] - mean[i, 0] + age * mean[i, 2]
        dy = measured[1] - bias[k, 1] - mean[i, 1] + age * mean[i, 3]
        for r in range(4):
            PH[r, 0] = before[r, 0] - age * before[r, 2]
            PH[r, 1] = before[r, 1] - age * before[r, 3]
            K[r, 0] = (PH[r, 0] * d - PH[r, 1] * b) / determinant
            K[r, 1] = (PH[r, 1] * a - PH[r, 0] * b) / determinant
            m[j, r] = mean[i, r] + K[r, 0] * dx + K[r, 1] * dy
        for r in range(4):
            for s in range(r, 4):
                P[j, r, s] = P[j, s, r] = before[r, s] - K[r, 0] * PH[s, 0] - K[r, 1] * PH[s, 1]
    return owner, m, P


@kernel
def moments(weights: Vector, mean: Matrix, covariance: Cube):
    """Mean (4,) and covariance (4, 4) of all particles together, weights of sum 1."""
    m, P = np.zeros(4), np.zeros((4, 4))
    for i in range(len(weights)):
        for r in range(4):
            m[r] += weights[i] * mean[i, r]
    for i in range(len(weights)):
        for r in range(4):
            for s in range(r, 4):
                P[r, s] += weights[i] * (covariance[i, r, s] + (mean[i, r] - m[r]) * (mean[i, s] - m[s]))
    for r in range(4):
        for s in range(r):
            P[r, s] = P[s, r]
    return m, P


@exact
def sampled(weights: Vector, offset: float, mean: Matrix, covariance: Cube, normal: Matrix):
    """States (n, 4) of particles that are drawn systematically, by draws `normal` (n, 4) of N(0, 1).

    Each is m_i + L_i z with the Cholesky factor L_i; a direction in which rounding left no variance has none.
    """
    owner = systematic(weights, offset, len(normal))
    state, L, latest = np.empty((len(owner), 4)), np.zeros((4, 4)), -1
    for j in range(len(owner)):
        i = owner[j]
        if i != latest:
            latest = i
            for r in range(4):
                for s in range(r + 1):
                    rest = covariance[i, r, s]
                    for t in range(s):
                        rest -= L[r, t] * L[s, t]
                    if r == s:
                        L[r, r] = np.sqrt(rest) if rest > 0.0 else 0.0
                    else:
                        L[r, s] = rest / L[s, s] if L[s, s] > 0.0 else 0.0
        for r in range(4):
            state[j, r] = mean[i, r]
            for s in range(r + 1):
                state[j, r] += L[r, s] * normal[j, s]
    return state


# ---------------------------------------------------------------------------------- sums of Gaussians


NUM_ROUNDS = 200
LEAST_STD = 0.1  # of a component, in standard deviations of the draws: one that holds a single draw would shrink to it


@dataclass(frozen=True, slots=True)
class GaussianSum(Constant):
    """sum_k w_k N(m_k, C_k), of K components in d dimensions."""

    weights: Array  # (K,), sum 1
    means: Array  # (K, d)
    covariances: Array  # (K, d, d)

    @property
    def mean(self) -> Array:
        """Of the whole sum, (d,)."""
        return self.weights @ self.means

    @property
    def variance(self) -> Array:
        """The covariance of the whole sum, (d, d)."""
        centred = self.means - self.mean
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
