"""Headings in (-pi, pi], the shorter way round from one to another, and their circular mean.

`wrap` takes arrays; `wrapped` and `rounded` take one heading and are compiled into the kernels that need them.
"""

from math import pi

import numpy as np
from numpy.typing import ArrayLike

from mjnav.compile.compiled import scalar
from mjnav.messages import Array

HALF_TURN_TIE = 1e-9  # [rad] within which two ways round are equally far: rounding does not choose between them
LEAST = float(np.nextafter(-np.pi, 0.0))  # [rad], the first above -pi


def wrap(angle: ArrayLike) -> Array:
    """The same angle in (-pi, pi], elementwise [rad]."""
    if isinstance(angle, float):  # the same bits as below in a sixth of the time
        return rounded.py_func(float(angle))
    # An angle just above pi comes out as -pi: the remainder is rounded.
    return np.maximum(np.pi - (np.pi - np.asarray(angle, float)) % (2.0 * np.pi), LEAST)


def shortest_turn(angle: float) -> float:
    """The way round by `angle` [rad], in (-pi, pi] but for HALF_TURN_TIE: half a turn is to the left."""
    return angle - 2.0 * np.pi * np.ceil((angle - (np.pi + HALF_TURN_TIE)) / (2.0 * np.pi))


def circular_mean(angles: ArrayLike, weights: ArrayLike | None = None) -> float:
    """Direction of the (weighted) mean unit vector [rad]; arbitrary where that vector vanishes."""
    angles = np.asarray(angles, float)
    weights = np.ones(angles.shape) if weights is None else np.asarray(weights, float)
    return float(wrap(np.arctan2(weights @ np.sin(angles), weights @ np.cos(angles))))


def mean_position(poses: Array) -> Array:
    """Mean position, (2,) [m], of poses (N, 3): what `mean` gives in two thirds of the time."""
    return np.add.reduce(poses[:, :2], 0) / len(poses)


def mean_pose(poses: Array) -> Array:
    """Mean position and heading, (3,) [m, m, rad], of poses (N, 3)."""
    return np.array([*mean_position(poses), circular_mean(poses[:, 2])])


@scalar
def rounded(angle):
    """The same angle in (-pi, pi] [rad], with the bits of `wrap`."""
    short = pi - angle  # a remainder takes longer than all else
    return max(pi - (short if 0.0 <= short < 2.0 * pi else short % (2.0 * pi)), LEAST)


@scalar
def wrapped(angle):
    """The same angle in (-pi, pi] [rad]."""
    return angle if -pi < angle <= pi else max(pi - (pi - angle) % (2.0 * pi), LEAST)
