"""`cvar`: the conditional value at risk of every constraint is kept at or below 0.

    CVaR_eta(f) = min_t t + E[max(0, f - t)] / (1 - eta)

is the mean of the worst 1 - eta of the distribution: of n samples the (1 - eta) n largest, the last of them counted by
the fraction that is left (Rockafellar & Uryasev 2000, "Optimization of Conditional Value-at-Risk"). At eta = 0 it is
the mean; from eta = 1 - 1/n on, the largest sample. As a constraint of a robot's controller: Yin et al. (2023),
"Risk-Aware Model Predictive Path Integral Control Using Conditional Value-at-Risk"; a baseline of Sharma & Singh
(2024, arXiv 2412.09121), "MMD-OPT".

f enters as the other methods see it: normalised and clipped. Where every candidate's CVaR is above 0 for some
constraint, the decision is `infeasible`: what exceeds 0, summed over the constraints, is least. With a finite `penalty`
that sum is a cost in place of a constraint, as in the baseline.
"""

from dataclasses import dataclass
from math import ceil, inf
from typing import Annotated

import numpy as np

from mjnav.compile.compiled import Vector, kernel
from mjnav.control.base import ConstrainedController, stored_risk
from mjnav.control.kernels.cone_kernel import Samples
from mjnav.control.parameters import Parameters, Penalty, Share
from mjnav.control.problem.problem import Problem
from mjnav.messages import Array

HALVINGS, FEW = 12, 8  # see _value_at_risk; they decide its speed, not its result


@dataclass(frozen=True, slots=True, kw_only=True)
class CvarParameters(Parameters):
    """The shared parameters and the level of the conditional value at risk."""

    eta: Annotated[Share, "the mean of the worst share 1 - eta of samples must be safe"] = 0.9
    penalty: Penalty = inf


class Cvar(ConstrainedController[CvarParameters]):
    """The cheapest candidate whose conditional value at risk is at most 0 for every constraint."""

    def risk(self, problem: Problem) -> tuple[Array, Array]:
        """CVaR_eta of every constraint."""
        return stored_risk(problem, lambda samples: conditional_value_at_risk(samples, self.parameters.eta))


def conditional_value_at_risk(samples: Samples, eta: float) -> Array:
    """CVaR_eta of samples (n, K), each counting the same: (K,)."""
    out = np.empty(samples.f.shape[1])
    # Of less than one sample the mean is that sample.
    tail = max(1.0, (1.0 - eta) * samples.num)
    keep = min(ceil(tail), samples.num)
    _conditional_value_at_risk(out, samples, tail, keep)
    return out


@kernel
def _conditional_value_at_risk(out: Vector, samples: Samples, tail: float, keep: int):
    """t + sum_i max(0, f_i - t) / tail of samples (n, K) into `out` (K,), where t is the `keep`-th largest.

    That t is where the minimum over t is.
    """
    num, stored = samples.num, samples.row.size
    column, values, scratch = np.full(num, samples.floor), np.empty(stored), np.empty(stored)
    for k in range(out.size):
        low, high = (samples.floor, samples.floor) if stored < num else (inf, -inf)
        for i in range(stored):
            f = samples.f[i, k]
            column[samples.row[i]] = values[i] = f
            low, high = min(low, f), max(high, f)
        if low == high:
            out[k] = low
            continue
        t = _value_at_risk(values, keep, low, high, scratch)
        excess = 0.0
        for i in range(num):
            excess += max(0.0, column[i] - t)
        out[k] = t + excess / tail


@kernel
def _value_at_risk(column, keep, low, high, scratch):
    """The `keep`-th largest of values from `low` to `high`, of which any number at `low` may be left out.

    `scratch` has room for them all.

    The range that holds the wanted value is halved until few values are left in it, and only those are ordered. For
    402 columns of 625 values 0.47 ms; np.partition takes 3.3 ms compiled by numba and 2.6 to 8 ms in NumPy.
    """
    # Above `low` there are at least `keep`, num_low; above `high` fewer, num_high.
    num_low, num_high = _count_above(column, low), 0
    if num_low < keep:
        return low
    for _ in range(HALVINGS):
        if num_low - num_high <= FEW:
            break
        middle = 0.5 * (low + high)
        count = _count_above(column, middle)
        if count >= keep:
            low, num_low = middle, count
        else:
            high, num_high = middle, count
    count = 0
    for i in range(column.size):
        scratch[count] = column[i]
        count += (column[i] > low) & (column[i] <= high)
    scratch[:count].sort()
    return scratch[count - (keep - num_high)]


@kernel
def _count_above(values, threshold):
    count = 0
    for i in range(values.size):
        count += values[i] > threshold
    return count
