"""Which candidates meet every constraint, and which is cheapest: ties are decided here, not by rounding.

The nominal control is the cheapest candidate that meets every constraint at the mean state. It depends on the mean of
each distribution alone.
"""

import numpy as np

from mjnav.messages import Array

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
