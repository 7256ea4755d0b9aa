"""The ellipse that holds most of a Gaussian in the plane."""

from math import atan2, hypot, sqrt

import numpy as np
from numpy.typing import ArrayLike

CHI_SQUARED_95 = 5.991  # with two degrees of freedom


def widest_std(covariance: ArrayLike) -> float:
    """The standard deviation of x and y in their widest direction [m]; `covariance` as in `ellipse_95`."""
    (a, b), (_, c) = np.asarray(covariance, float)[:2, :2].tolist()
    return sqrt(max(0.5 * (a + c) + hypot(0.5 * (a - c), b), 0.0))


def ellipse_95(covariance: ArrayLike) -> tuple[float, float, float]:
    """The 95 % region of x and y: semi-axes [m], the longer first, and the longer one's direction [rad].

    `covariance` is (2, 2) or larger, of which the first two rows and columns count [m^2].
    """
    (a, b), (_, c) = np.asarray(covariance, float)[:2, :2].tolist()
    middle, spread = 0.5 * (a + c), np.hypot(0.5 * (a - c), b)
    longer, shorter = np.sqrt(CHI_SQUARED_95 * np.maximum([middle + spread, middle - spread], 0.0)).tolist()
    return longer, shorter, 0.5 * atan2(2.0 * b, a - c)
