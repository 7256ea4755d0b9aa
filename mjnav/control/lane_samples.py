"""Samples of the lane constraints at every candidate; safe where <= 0.

    D1 = d1(x) + left offset + margin,   D2 = -(d2(x) + right offset - margin)

at the position x after `lane_horizon`, each with its boundary's noise, the margin being the robot's radius.
"""

import numpy as np

from mjnav.constraints.lane import lane_distance
from mjnav.control.parameters import Parameters
from mjnav.messages import Array, Lanes


def lane_samples(
    lanes: Lanes,
    pose: Array,
    noise: Array,
    offsets: tuple[Array, Array],
    v: Array,
    omega: Array,
    margin: float,
    parameters: Parameters,
    *,
    clip: bool = True,
) -> Array:
    """(2, K, N): left and right for controls (K,), poses (N, 3), actuation noise (N, 2) and offsets (N,) each."""
    p = parameters
    heading = pose[:, 2] + (omega[:, None] + noise[:, 1]) * p.preview
    step = (v[:, None] + noise[:, 0]) * p.lane_horizon
    position = pose[:, :2] + np.stack([step * np.cos(heading), step * np.sin(heading)], axis=-1)
    samples = np.stack(
        [
            lane_distance(position, lanes.left) + offsets[0] + margin,
            -(lane_distance(position, lanes.right) + offsets[1] - margin),
        ]
    )
    if p.normalise:
        samples /= margin
    return np.maximum(samples, -p.clip) if clip else samples
