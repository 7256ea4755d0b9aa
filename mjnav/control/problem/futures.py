"""Predicted futures as the methods take them.

A method that looks at one moment of decision alone moves every obstacle along a straight line. Of a sample m with a
predicted future x_m(t) it takes the velocity that leads to where the sample is predicted after the method's horizon,

    o'_m = (x_m(T) - x_m(0)) / T,     T the horizon, or the prediction's end where that is sooner.

So the straight line is right at its two ends. A method that plans in time takes x_m(t) itself, linear between the
predicted positions; after the last of them every sample keeps its last velocity.
"""

from dataclasses import replace

import numpy as np

from mjnav.messages import Array, ObstacleSamples


def straightened(obstacle: ObstacleSamples, horizon: float) -> ObstacleSamples:
    """The obstacle with the velocities that lead to its future at `horizon` [s]; without a future as it is."""
    if obstacle.future is None:
        return obstacle
    end = min(horizon, obstacle.step * obstacle.future.shape[1])
    (there,) = positions_at(obstacle, np.array([end]))
    return replace(obstacle, velocity=(there - obstacle.position) / end, future=None, step=0.0)


def positions_at(obstacle: ObstacleSamples, times: Array) -> Array:
    """Where the samples of an obstacle are at `times` (T,) [s] after the moment of effect: (T, M, 2) [m]."""
    if obstacle.future is None:
        return obstacle.position + times[:, None, None] * obstacle.velocity
    known = np.concatenate([obstacle.position[:, None], obstacle.future], axis=1).swapaxes(0, 1)  # (H + 1, M, 2)
    before = np.clip((times / obstacle.step).astype(int), 0, len(known) - 2)
    share = (times / obstacle.step - before)[:, None, None]  # above 1 beyond the last position
    return known[before] + share * (known[before + 1] - known[before])
