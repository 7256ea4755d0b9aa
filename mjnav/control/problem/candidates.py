"""Candidate controls on a grid, and the choice among them: which meet every constraint, and which is cheapest.

The candidates are a grid over what the robot can reach, then keep and brake (Nair et al., algorithm 1). Ties are
decided here, not by rounding.

The nominal control is the cheapest candidate that meets every constraint at the mean state. It depends on the mean of
each distribution alone.
"""

from dataclasses import dataclass

import numpy as np

from mjnav.messages import Array, RobotLimits
from mjnav.motion.unicycle import control_bounds, reachable


@dataclass(frozen=True, slots=True)
class Candidates:
    """K controls; the last two are keep and brake."""

    v: Array  # (K,) [m/s]
    omega: Array  # (K,) [rad/s]


def candidate_grid(
    twist: Array, limits: RobotLimits, period: float, num_v: int, num_omega: int, window: str
) -> Candidates:
    """num_v x num_omega controls, ends included, over what can be reached from `twist` in one period; keep; brake.

    `window` "bounds" takes the whole range between the limits instead. Keep is `twist` brought within the limits;
    brake goes as far towards (0, 0) as one period allows.
    """
    low, high = reachable(twist, limits, period)
    keep = np.minimum(np.maximum(twist, low), high)
    brake = np.minimum(np.maximum(0.0, low), high)
    if window == "bounds":
        low, high = control_bounds(limits)
    v, omega = np.empty(num_v * num_omega + 2), np.empty(num_v * num_omega + 2)
    v[:-2].reshape(num_v, num_omega)[:] = _between(low[0], high[0], num_v)[:, None]
    omega[:-2].reshape(num_v, num_omega)[:] = _between(low[1], high[1], num_omega)
    v[-2], omega[-2] = keep
    v[-1], omega[-1] = brake
    return Candidates(v, omega)


def _between(low: float, high: float, num: int) -> Array:
    """`num` values from low to high, ends included and exact; the low end where there is one."""
    share = np.arange(num) / max(num - 1, 1)
    return low * (1.0 - share) + high * share


TIE = 1e-9  # relative difference below which two violations, or two costs, are the same


def least_violating(violation: Array) -> np.ndarray:
    """Which candidates violate nothing, or least where all do, (..., K) bool.

    Where the robot touches an obstacle already, all controls that lead away violate alike, but for rounding.
    """
    return violation <= np.maximum(0.0, violation.min(axis=-1, keepdims=True)) * (1.0 + TIE)


def cheapest(cost: Array) -> Array:
    """The index of the least cost along the last axis, (...,); the first of those that are equal but for rounding."""
    least = cost.min(axis=-1, keepdims=True)
    return np.argmax(cost <= least + TIE * (1.0 + np.abs(least)), axis=-1)
