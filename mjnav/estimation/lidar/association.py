"""Which detection belongs to which track: global nearest neighbour with a gate and a probability of detection.

Source: Blackman & Popoli 1999, "Design and Analysis of Modern Tracking Systems", chapter 6.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mjnav.messages import Array

GATE = 13.82  # chi-square of two degrees of freedom, 99.9 %: at 99 % each body would lose a detection every ten seconds


@dataclass(frozen=True, slots=True)
class Predicted:
    """Where T tracks are believed to have been when each of D detections was made."""

    squared: Array  # (T, D) Mahalanobis distance^2 of every detection from every track
    log_density: Array  # (T, D) log of the density of the detection under the track [1/m^2]


def predicted(means: Array, covariances: Array, positions: Array, noise: Array, ages: Array) -> Predicted:
    """Tracks' moments (T, 4), (T, 4, 4) against positions (D, 2), covariances (D, 2, 2), made `ages` (D,) [s] before.

    z ~ N(x - age v, H P H^T + R), H = (I, -age I).
    """
    age = ages[:, None]
    error = positions - (means[:, None, :2] - age * means[:, None, 2:])
    PP, PV, VV = covariances[:, :2, :2], covariances[:, :2, 2:], covariances[:, 2:, 2:]
    age = ages[:, None, None]
    cross = (PV + PV.swapaxes(1, 2))[:, None]
    S = PP[:, None] - age * cross + age**2 * VV[:, None] + noise
    determinant = S[..., 0, 0] * S[..., 1, 1] - S[..., 0, 1] ** 2
    dx, dy = error[..., 0], error[..., 1]
    squared = (S[..., 1, 1] * dx**2 - 2.0 * S[..., 0, 1] * dx * dy + S[..., 0, 0] * dy**2) / determinant
    return Predicted(squared, -0.5 * squared - 0.5 * np.log(determinant) - np.log(2.0 * np.pi))


def assigned(found: Predicted, detectable: Array, false: float) -> NDArray[np.int64]:
    """The detection of each track, (T,); -1 for a track that none belongs to. No detection belongs to two.

    The most likely assignment: it maximises the product over tracks of p(z) / `false` where z belongs to the track and
    of 1 - P_D where none does, P_D being its `detectable` (T,), below one. `false` is the density of detections that
    belong to no track over the probability that a body in view is detected [1/m^2]; that a detection was made says that
    there the body was in view. A detection outside a track's gate does not belong to it.
    """
    from scipy.optimize import linear_sum_assignment

    num_tracks, num = found.squared.shape
    if not (num_tracks and num):
        return np.full(num_tracks, -1)
    costs = np.full((num_tracks, num + num_tracks), np.inf)
    costs[:, :num] = np.where(found.squared <= GATE, np.log(false) - found.log_density, np.inf)
    costs[:, num:][np.diag_indices(num_tracks)] = -np.log1p(-detectable)
    columns = linear_sum_assignment(costs)[1]
    return np.where(columns < num, columns, -1)
