"""Mixture Kalman filter (Chen & Liu 2000): each particle is a history of modes, and Gaussian given that history.

A particle i has a weight w_i and the moments m_i (4,), P_i (4, 4) of a state (x, y, vx, vy). What a particle can do
next is not drawn but listed, each with its probability, and so is each component k of the measurement's noise, a
sum of Gaussians. All the products

    w_i c_k N(z; H m_i + b_k, H P_i H^T + R_k)

are known before one has to be chosen, so the proposal is the optimal one, and of more than n products n are kept by
the resampling that disturbs the weights least (Fearnhead & Clifford 2003).

The measurement is of the position `age` seconds before the time of the state: H = (I, -age I).
"""

import numpy as np

from mjnav.geometry.compiled import exact, kernel, scalar
from mjnav.geometry.kernel_types import Cube, Indices, Matrix, Vector

NEGLIGIBLE = 1e-12  # of all weight: a particle with less is dropped


@exact
def kept(weights: Vector, num: int, offset: float):
    """Which of n particles to keep, and their weights: (k,) each, k <= num + 1, for `offset` from U(0, 1).

    Optimal resampling (Fearnhead & Clifford 2003, "On-line inference for hidden Markov models via particle filters",
    section 3): with c such that sum_i min(w_i / c, 1) = num, every w_i >= c stays as it is, and of the others each
    survives with probability w_i / c, by systematic draws, and then weighs c. On average no weight changes.
    """
    total = weights.sum()
    least = NEGLIGIBLE * total
    count = 0
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
            m[j], P[j] = mean[i], before
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
def sampled(owner: Indices, mean: Matrix, covariance: Cube, normal: Matrix):
    """States (n, 4), one of each particle in `owner` (n,), by draws `normal` (n, 4) of N(0, 1).

    Each is m_i + L_i z with the Cholesky factor L_i; a direction in which rounding left no variance has none.
    """
    state = np.empty((len(owner), 4))
    L, latest = np.zeros((4, 4)), -1
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
