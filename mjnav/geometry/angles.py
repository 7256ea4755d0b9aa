"""Headings in (-pi, pi]."""

import numpy as np
from numpy.typing import ArrayLike

from mjnav.messages import Array

LEAST = float(np.nextafter(-np.pi, 0.0))  # [rad], the first above -pi


def wrap(angle: ArrayLike) -> Array:
    """The same angle in (-pi, pi], elementwise [rad]."""
    wrapped = np.pi - (np.pi - np.asarray(angle, float)) % (2.0 * np.pi)
    return np.maximum(wrapped, LEAST)  # an angle just above pi comes out as -pi: the remainder is rounded


def circular_mean(angles: ArrayLike, weights: ArrayLike | None = None) -> float:
    """Direction of the (weighted) mean unit vector [rad]; arbitrary where that vector vanishes."""
    angles = np.asarray(angles, float)
    weights = np.full(angles.shape, 1.0) if weights is None else np.asarray(weights, float)
    return float(wrap(np.arctan2(weights @ np.sin(angles), weights @ np.cos(angles))))
