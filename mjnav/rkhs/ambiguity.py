"""A bound on a plan's mean violation over all distributions near the samples: few samples, beliefs that are not right.

Let x_1 ... x_S be joint samples with empirical distribution P_S, k a kernel on their space with Hilbert space H, and h
a function in H. By Cauchy and Schwarz, as E_P h - E_{P_S} h = <h, mu_P - mu_{P_S}>,

    sup { E_P h : MMD(P, P_S) <= epsilon }  <=  (1/S) sum_s h(x_s) + epsilon |h|_H,

which charges a plan whose violation changes sharply with the noise. Of h the values at the samples are known, h_s, and

    |h|_H^2 = h' (K + mu I)^-1 h = |L^-1 h|^2,    K_st = k(x_s, x_t),    K + mu I = L L',

is the least of |g|_H^2 + (1/mu) sum_s (h_s - g(x_s))^2 over all g in H (kernel ridge regression): mu = 0 would ask for
g to pass through every value. It is exact for distributions over the samples themselves: of all weights w with
(w - 1/S)' (K + mu I) (w - 1/S) <= epsilon^2, the largest w'h is this bound.

What it cannot say: the norm is estimated from the values at S samples, from below, and an error of the model itself,
which no sample shows, is not in P_S.

Sources: Zhu, Jitkrittum, Diehl & Schoelkopf (2021), "Kernel Distributionally Robust Optimization: Generalized Duality
Theorem and Stochastic Approximation" (AISTATS); Nemmour, Kremer, Schoelkopf & Zhu (2022), "Maximum Mean Discrepancy
Distributionally Robust Nonlinear Chance-Constrained Optimization with Finite-Sample Guarantee" (CDC); Staib & Jegelka
(2019), "Distributionally Robust Optimization and Generalization in Kernel Methods" (NeurIPS), for the norm as penalty.
"""

from dataclasses import dataclass
from math import log, sqrt

import numpy as np

from mjnav.errors import InvalidValue
from mjnav.geometry.compiled import Matrix, Vector, kernel
from mjnav.messages import Array
from mjnav.rkhs.joint_gram import joint_gram


@dataclass(frozen=True, slots=True)
class Ambiguity:
    """The joint samples of one decision, factored once: |h|_H and the bound of any number of plans."""

    inverse_root: Array  # (S, S) the transpose of L^-1, upper triangular

    @classmethod
    def of(cls, samples: Array, *, bandwidth: float = 1.0, ridge: float = 0.1) -> "Ambiguity":
        """From joint samples (S, D) in any units; the Gaussian kernel of `joint_gram`, and mu = `ridge`.

        `bandwidth` is a multiple of the samples' median distance. Raises InvalidValue where either is not > 0.
        """
        for name, value in (("bandwidth", bandwidth), ("ridge", ridge)):
            if not 0.0 < value < np.inf:
                raise InvalidValue(name, value, "a finite number > 0")
        gram = joint_gram(samples, bandwidth)
        gram.flat[:: len(gram) + 1] += ridge
        inverse_root = np.linalg.inv(np.linalg.cholesky(gram)).T
        return cls(np.ascontiguousarray(inverse_root, float))

    def norm(self, h: Array) -> Array:
        """|h|_H of each row of h (K, S): (K,), in the unit of h."""
        h = np.ascontiguousarray(h, float)
        out = np.empty(len(h))
        _norms(out, h, self.inverse_root, np.empty(h.shape[1]))
        return out

    def bound(self, h: Array, radius: float) -> Array:
        """mean(h) + radius |h|_H of each row of h (K, S): (K,); radius is epsilon, 0 leaves the mean."""
        return h.mean(axis=1) + radius * self.norm(h)


def radius(num_samples: int, delta: float) -> float:
    """epsilon = sqrt(C/S) + sqrt(2 C log(1/delta) / S), C = sup k(x, x) = 1 as for every Gaussian kernel.

    With probability 1 - delta the distribution from which S independent samples were drawn is within epsilon of P_S.
    The first term bounds the mean of MMD(P, P_S), since E MMD^2 = (E k(x, x) - E k(x, x')) / S. The second follows from
    McDiarmid's inequality: another x_s moves the MMD by 2 sqrt(C) / S at most (Tolstikhin, Sriperumbudur & Muandet
    2017, "Minimax Estimation of Kernel Mean Embeddings"; Gretton et al. 2012, theorem 7, for two samples). Samples that
    are resampled or herded are not independent: then it is a scale and no guarantee.

    Raises InvalidValue for S < 1 or delta outside (0, 1].
    """
    if num_samples < 1:
        raise InvalidValue("num_samples", num_samples, "a whole number >= 1")
    if not 0.0 < delta <= 1.0:
        raise InvalidValue("delta", delta, "a number > 0 and <= 1")
    return (1.0 + sqrt(2.0 * log(1.0 / delta))) / sqrt(num_samples)


@kernel
def _norms(out: Vector, h: Matrix, inverse_root: Matrix, z: Vector):
    """|L^-1 h_k| of each row; most of h is 0 and costs nothing. `z` (S,) is memory to work in."""
    for k in range(out.size):
        z[:] = 0.0
        for s in range(z.size):
            value = h[k, s]
            if value != 0.0:
                for t in range(s, z.size):
                    z[t] += value * inverse_root[s, t]
        total = 0.0
        for t in range(z.size):
            total += z[t] * z[t]
        out[k] = np.sqrt(total)
