"""Gaussian mixtures on the line: fitted by expectation-maximisation, compared by their Kullback-Leibler divergence.

EM (Dempster, Laird & Rubin 1977) for samples x_i, i = 1 ... n, and C components alternates

    r_ic = pi_c N(x_i; mu_c, s_c^2) / sum_c' pi_c' N(x_i; mu_c', s_c'^2),                       n_c = sum_i r_ic,
    pi_c = n_c / n,   mu_c = sum_i r_ic x_i / n_c,   s_c^2 = max(sum_i r_ic (x_i - mu_c)^2 / n_c, floor^2)

for a fixed number of iterations. The floor keeps an atom's likelihood bounded; as a bound it leaves the likelihood
rising. Start: means equally spaced from one standard deviation below the samples' mean to one above, standard
deviations 1/C of theirs, equal weights.

Many samples are gathered in cells of equal width first, and the samples of a cell share their responsibilities, from
the cell's mean log density (Verbeek, Nunnink & Vlassis 2006, "Accelerated EM-based clustering of large data sets"). The
sums of the second step stay exact: only where a cell straddles two components does it matter.
"""

from dataclasses import dataclass

import numpy as np

from mjnav.compile.compiled import Matrix, kernel, scalar
from mjnav.control.kernels.cone_kernel import Samples
from mjnav.messages import Array

NUM_CELLS = 64  # of 625 samples: moves means and deviations by 0.2 % of the range at most, weights by 0.005
LEAST_LOG = -40.0  # of a responsibility, so that none is 0 and no component dies
ATOM = 1e-9  # of the floor: samples closer together than this are one point


@dataclass(frozen=True, slots=True)
class Mixtures:
    """K mixtures of C Gaussians each."""

    weight: Array  # (C, K) pi, columns sum to 1
    mean: Array  # (C, K) mu
    variance: Array  # (C, K) s^2


@scalar
def _exp(x):
    """exp(x) for x <= 0 to 5e-11, never below e^LEAST_LOG: (1 + y + ... + y^4/24)^256, y = x/256.

    The library's exponential keeps a loop from vectorising.
    """
    y = max(x, LEAST_LOG) / 256.0
    power = 1.0 + y * (1.0 + y * (1.0 / 2.0 + y * (1.0 / 6.0 + y * (1.0 / 24.0))))
    for _ in range(8):
        power *= power
    return power


@kernel
def _gather(count, first, second, x, cell, low, high):
    """The samples x (n,) in cells: how many, the sums of x and x^2 over each; returns how many cells are not empty.

    Where there are enough cells, each sample is a cell. `cell` (n,) is memory to work in.
    """
    num_cells = count.size
    if x.size <= num_cells:
        for i in range(x.size):
            count[i], first[i], second[i] = 1.0, x[i], x[i] * x[i]
        return x.size
    per_width = num_cells / (high - low)
    for i in range(x.size):
        cell[i] = min(int((x[i] - low) * per_width), num_cells - 1)
    count[:], first[:], second[:] = 0.0, 0.0, 0.0
    # Most samples are in the lowest cell, at the clip: its sums stay in registers.
    lowest_count, lowest_first, lowest_second = 0.0, 0.0, 0.0
    for i in range(x.size):
        c = cell[i]
        if c == 0:
            lowest_count += 1.0
            lowest_first += x[i]
            lowest_second += x[i] * x[i]
        else:
            count[c] += 1.0
            first[c] += x[i]
            second[c] += x[i] * x[i]
    count[0], first[0], second[0] = lowest_count, lowest_first, lowest_second
    size = 0
    for c in range(num_cells):
        if count[c] > 0.0:
            count[size], first[size], second[size] = count[c], first[c] / count[c], second[c] / count[c]
            size += 1
    return size


@scalar
def _iterate(weight, mean, variance, count, first, second, num_samples, density, largest, share, floor):
    """One iteration for one mixture (C,) and its cells: counts, means of x and of x^2."""
    size = count.size
    for i in range(size):
        largest[i], share[i] = -np.inf, 0.0
    for c in range(weight.size):
        row, half = density[c], -0.5 / variance[c]
        linear = -2.0 * half * mean[c]
        constant = np.log(weight[c]) - 0.5 * np.log(variance[c]) + half * mean[c] * mean[c]
        for i in range(size):
            row[i] = half * second[i] + linear * first[i] + constant
            largest[i] = max(largest[i], row[i])
    for c in range(weight.size):
        row = density[c]
        for i in range(size):
            row[i] = _exp(row[i] - largest[i])
            share[i] += row[i]
    for i in range(size):
        share[i] = count[i] / share[i]
    for c in range(weight.size):
        row = density[c]
        zeroth, one, two = 0.0, 0.0, 0.0
        for i in range(size):
            r = row[i] * share[i]
            zeroth += r
            one += r * first[i]
            two += r * second[i]
        weight[c] = zeroth / num_samples
        mean[c] = one / zeroth
        variance[c] = max(two / zeroth - mean[c] * mean[c], floor)


@kernel
def _fit(
    weight: Matrix,
    mean: Matrix,
    variance: Matrix,
    samples: Samples,
    num_iterations: int,
    std_floor: float,
    num_cells: int,
):
    num_samples, num_components, floor = samples.num, weight.shape[0], std_floor * std_floor
    num_stored = samples.row.size
    x, cell = np.empty(num_samples), np.empty(num_samples, np.int64)
    count, first, second = np.empty(num_cells), np.empty(num_cells), np.empty(num_cells)
    density, largest, share = np.empty((num_components, num_cells)), np.empty(num_cells), np.empty(num_cells)
    for k in range(samples.f.shape[1]):
        low, high = (samples.floor, samples.floor) if num_stored < num_samples else (np.inf, -np.inf)
        for i in range(num_stored):
            low, high = min(low, samples.f[i, k]), max(high, samples.f[i, k])
        if high - low <= ATOM * std_floor:
            weight[:, k], mean[:, k], variance[:, k] = 1.0 / num_components, low, floor
            continue
        x[:] = samples.floor
        for i in range(num_stored):
            x[samples.row[i]] = samples.f[i, k]
        # About the mean: what is far from 0 loses no digits in the squares.
        centre = x.mean()
        for i in range(num_samples):
            x[i] -= centre
        size = _gather(count, first, second, x, cell, low - centre, high - centre)
        std = x.std()
        for c in range(num_components):
            weight[c, k] = 1.0 / num_components
            mean[c, k] = std * (2.0 * c / (num_components - 1.0) - 1.0) if num_components > 1 else 0.0
            variance[c, k] = max((std / num_components) ** 2, floor)
        for _ in range(num_iterations):
            _iterate(
                weight[:, k], mean[:, k], variance[:, k], count[:size], first[:size], second[:size],
                num_samples, density, largest, share, floor,
            )  # fmt: skip
        mean[:, k] += centre


def fit_mixtures(
    samples: Array | Samples, num_components: int, num_iterations: int, std_floor: float, *, num_cells: int = NUM_CELLS
) -> Mixtures:
    """A mixture for each column of samples (n, K), n >= 1; std_floor > 0 has the samples' unit.

    The order of the samples changes nothing but rounding. More than `num_cells` samples are gathered in cells.
    """
    samples = samples if isinstance(samples, Samples) else Samples.of(samples)
    shape = (num_components, samples.f.shape[1])
    mixtures = Mixtures(np.empty(shape), np.empty(shape), np.empty(shape))
    _fit(
        mixtures.weight, mixtures.mean, mixtures.variance, samples,
        num_iterations, std_floor, num_cells,
    )  # fmt: skip
    return mixtures


def kl_divergence(f: Mixtures, g: Mixtures) -> Array:
    """KL(f || g) of each pair of mixtures, (K,), by the variational approximation, at least 0; K of g may be 1.

        sum_a pi_a log(sum_a' pi_a' exp(-KL(f_a || f_a')) / sum_b omega_b exp(-KL(f_a || g_b)))

    with pi the weights of f, omega those of g, and the closed form between Gaussians (Hershey & Olsen 2007,
    "Approximating the Kullback Leibler divergence between Gaussian mixture models"). Exact for one component and for
    equal mixtures.
    """
    return np.maximum((f.weight * (_log_overlap(f, f) - _log_overlap(f, g))).sum(axis=0), 0.0)


def _log_overlap(f: Mixtures, g: Mixtures) -> Array:
    """log sum_b omega_b exp(-KL(f_a || g_b)), (C, K)."""
    apart, precision = f.mean[:, None] - g.mean, 1.0 / g.variance
    ratio = f.variance[:, None] * precision
    terms = np.log(g.weight) - 0.5 * (apart * apart * precision + ratio - 1.0 - np.log(ratio))  # (C of f, C of g, K)
    largest = terms.max(axis=1)
    return largest + np.log(np.exp(terms - largest[:, None]).sum(axis=1))
