"""The nominal control: the cheapest candidate that meets every constraint at the mean state.

It depends on the mean of each distribution alone.
"""

from math import inf

import numpy as np

from mjnav.messages import Array

TIE = 1e-9  # relative difference below which two violations are the same


def least_violating(violation: Array) -> np.ndarray:
    """Which candidates violate nothing, or least where all do, (..., K) bool.

    Where the robot touches an obstacle already, all controls that lead away violate alike, but for rounding.
    """
    return violation <= np.maximum(0.0, violation.min(axis=-1, keepdims=True)) * (1.0 + TIE)


def cheapest(cost: Array, violation: Array) -> list[int]:
    """Index of the least cost (P, K) among those that violate nothing; else of the least violation, then cost. (P,)"""
    return np.argmin(np.where(least_violating(violation), cost, inf), axis=-1).tolist()
