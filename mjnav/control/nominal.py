"""The nominal control: the cheapest candidate that meets every constraint at the mean state.

Only the mean of each distribution is looked at here: one pair of means an obstacle, all candidates at once.
"""

from math import inf

import numpy as np

from mjnav.constraints.collision_cone import LINE, RAY, cone_line, cone_ray, cone_segment
from mjnav.constraints.compiled import kernel
from mjnav.constraints.wall import wall_segment
from mjnav.control.sample_cone import ConeBlocks, ConeRule
from mjnav.messages import Array

TIE = 1e-9  # relative difference below which two violations are the same


@kernel
def _add_violation(out, vx, vy, x, y, ovx, ovy, num_discs, radius_squared, unit, wall, form, horizons):
    for b in range(x.size):
        rr, s = radius_squared[b], unit[b]
        if b >= num_discs:
            ax, ay, bx, by = wall[b, 0], wall[b, 1], wall[b, 2], wall[b, 3]
            for k in range(out.size):
                out[k] += max(0.0, s * wall_segment(x[b], y[b], vx[k], vy[k], ax, ay, bx, by, rr, horizons[1]))
        elif form == LINE:
            for k in range(out.size):
                out[k] += max(0.0, s * cone_line(x[b], y[b], vx[k] - ovx[b], vy[k] - ovy[b], rr, horizons[0]))
        elif form == RAY:
            for k in range(out.size):
                out[k] += max(0.0, s * cone_ray(x[b], y[b], vx[k] - ovx[b], vy[k] - ovy[b], rr, horizons[0]))
        else:
            for k in range(out.size):
                out[k] += max(0.0, s * cone_segment(x[b], y[b], vx[k] - ovx[b], vy[k] - ovy[b], rr, horizons[0]))


def mean_violation(blocks: ConeBlocks, rule: ConeRule, vx: Array, vy: Array) -> Array:
    """sum_j max(0, f_j) at the means, (K,), for the mean robot's velocities (K,); 0 where all is safe.

    Every block of `blocks` holds one pair.
    """
    b = blocks
    out = np.zeros(len(vx))
    horizons = (rule.horizon, rule.wall_horizon)
    _add_violation(
        out, vx, vy, b.x, b.y, b.vx, b.vy, b.num_discs, b.radius_squared, b.unit, b.wall, rule.form, horizons
    )  # fmt: skip
    return out


def least_violating(violation: Array) -> np.ndarray:
    """Which candidates violate nothing, or least where all do, (K,) bool.

    Where the robot touches an obstacle already, all controls that lead away violate alike, but for rounding.
    """
    return violation <= max(0.0, violation.min()) * (1.0 + TIE)


def cheapest(cost: Array, violation: Array) -> int:
    """Index of the least cost among those that violate nothing; else of the least violation, then cost."""
    return int(np.argmin(np.where(least_violating(violation), cost, inf)))
