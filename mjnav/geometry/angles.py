"""Headings in (-pi, pi]."""

import numpy as np
from numpy.typing import ArrayLike

from mjnav.messages import Array


def wrap(angle: ArrayLike) -> Array:
    """The same angle in (-pi, pi], elementwise [rad]."""
    return np.pi - (np.pi - np.asarray(angle, float)) % (2.0 * np.pi)


def circular_mean(angles: ArrayLike, weights: ArrayLike | None = None) -> float:
    """Direction of the (weighted) mean unit vector [rad]; 0 where that vector vanishes."""
    angles = np.asarray(angles, float)
    weights = np.full(angles.shape, 1.0) if weights is None else np.asarray(weights, float)
    return float(np.arctan2(weights @ np.sin(angles), weights @ np.cos(angles)))
