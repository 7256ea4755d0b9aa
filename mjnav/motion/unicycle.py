"""The unicycle: x' = v cos(theta), y' = v sin(theta), theta' = omega."""

import numpy as np
from numpy.typing import ArrayLike

from mjnav.geometry.angles import wrap
from mjnav.messages import Array


def integrate(pose: ArrayLike, v: ArrayLike, omega: ArrayLike, duration: float) -> Array:
    """The pose after `duration` [s] of constant (v, omega): the exact arc, (..., 3).

    With h = omega T / 2, the chord has length v T sin(h)/h and direction theta + h.
    """
    pose = np.asarray(pose, float)
    half = 0.5 * duration * np.asarray(omega, float)
    chord = duration * np.asarray(v, float) * np.sinc(half / np.pi)
    heading = pose[..., 2] + half
    return np.stack(
        [pose[..., 0] + chord * np.cos(heading), pose[..., 1] + chord * np.sin(heading), wrap(heading + half)], axis=-1
    )
