"""The nominal control: the cheapest candidate that meets every constraint at the mean state.

It depends on the mean of each distribution alone.
"""

import numpy as np

from mjnav.messages import Array

TIE = 1e-9  # relative difference below which two violations are the same


def least_violating(violation: Array) -> np.ndarray:
    """Which candidates violate nothing, or least where all do, (..., K) bool.

    Where the robot touches an obstacle already, all controls that lead away violate alike, but for rounding.
    """
    return violation <= np.maximum(0.0, violation.min(axis=-1, keepdims=True)) * (1.0 + TIE)
