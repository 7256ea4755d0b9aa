"""`unicycle.integrate` for one row a sample, compiled: particles and robot samples move by it at every tick.

The array form is for reading a log, which needs no compiler.
"""

from math import cos, sin

import numpy as np

from mjnav.geometry.compiled import kernel, scalar
from mjnav.geometry.heading import wrapped
from mjnav.geometry.kernel_types import Matrix, Vector

_SMALL = 0.1  # of h, below which five terms of the series of sin(h)/h are exact to 3e-18


@scalar
def _sinc(h):
    """sin(h)/h."""
    if abs(h) < _SMALL:
        q = h * h
        return 1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0)))
    return sin(h) / h


@kernel
def arc(x, y, heading, v, omega, duration):
    """The pose after `duration` [s], negative for the pose before, of constant v [m/s] and omega [rad/s]."""
    half = 0.5 * duration * omega
    chord = duration * v * _sinc(half)
    return x + chord * cos(heading + half), y + chord * sin(heading + half), wrapped(heading + 2.0 * half)


@kernel
def integrate_rows(pose: Matrix, v: Vector, omega: Vector, duration: float):
    """Poses (n, 3) after `duration` [s] of constant v (n,) [m/s] and omega (n,) [rad/s], a new (n, 3).

    With h = omega T / 2, the chord has length v T sin(h)/h and direction theta + h.
    """
    moved = np.empty(pose.shape)
    for i in range(len(pose)):
        half = 0.5 * duration * omega[i]
        chord = duration * v[i] * _sinc(half)
        heading = pose[i, 2] + half
        moved[i, 0] = pose[i, 0] + chord * cos(heading)
        moved[i, 1] = pose[i, 1] + chord * sin(heading)
        moved[i, 2] = wrapped(heading + half)
    return moved
