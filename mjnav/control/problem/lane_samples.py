"""Samples of the lane constraints at every candidate; safe where <= 0.

    D1 = d1(x) + left offset + margin,   D2 = -(d2(x) + right offset - margin)

at the position x after `lane_horizon`, each with its boundary's noise, the margin being the robot's radius.
"""

from math import inf

import numpy as np

from mjnav.constraints.lane import lane_distance
from mjnav.control.parameters import Parameters
from mjnav.geometry.compiled import kernel
from mjnav.geometry.kernel_types import Matrix, Vector
from mjnav.messages import Array, Lanes


@kernel
def _side(
    out: Matrix,
    v: Vector,
    cos_turn: Vector,
    sin_turn: Vector,
    ahead: Vector,
    across: Vector,
    base: Vector,
    speed_noise: Vector,
    least: float,
):
    """max(base_i + (v_k + dv_i) (ahead_i cos(omega_k tau) - across_i sin(omega_k tau)), least) into `out` (K, N)."""
    for k in range(v.size):
        for i in range(base.size):
            rate = ahead[i] * cos_turn[k] - across[i] * sin_turn[k]
            out[k, i] = max(base[i] + (v[k] + speed_noise[i]) * rate, least)


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
    out = np.empty((2, len(v), len(pose)))
    heading, turn = pose[:, 2] + noise[:, 1] * p.preview, omega * p.preview
    cos_heading, sin_heading, cos_turn, sin_turn = np.cos(heading), np.sin(heading), np.cos(turn), np.sin(turn)
    speed_noise = np.ascontiguousarray(noise[:, 0])
    unit = 1.0 / margin if p.normalise else 1.0
    for f, line, offset, sign in zip(out, (lanes.left, lanes.right), offsets, (unit, -unit), strict=True):
        # Driving at v changes the distance by v [(a cos + b sin) of the heading after the turn] a second.
        a, b, _ = np.array(line) * (sign * p.lane_horizon / np.hypot(line[0], line[1]))
        base = sign * (lane_distance(pose[:, :2], line) + offset) + unit * margin
        ahead, across = a * cos_heading + b * sin_heading, a * sin_heading - b * cos_heading
        _side(f, v, cos_turn, sin_turn, ahead, across, base, speed_noise, -p.clip if clip else -inf)
    return out
