"""Which detection belongs to which track: global nearest neighbour with a gate and a probability of detection.

Source: Blackman & Popoli 1999, "Design and Analysis of Modern Tracking Systems", chapter 6. What is nearest is what the
belief of a track makes most likely, its turns and stops included: the Gaussian of its first two moments would lose
people who turn on their heel.
"""

import numpy as np
from numpy.typing import NDArray

from mjnav.messages import Array

FAR = 60.0  # Mahalanobis distance^2 from a track's moments beyond which nobody asks for the density


def mahalanobis(means: Array, covariances: Array, positions: Array, noise: Array, ages: Array) -> tuple[Array, Array]:
    """Of D detections from T tracks, squared, and the log of the density under the Gaussian of their moments, (T, D).

    Tracks' moments are (T, 4), (T, 4, 4), positions (D, 2), their covariances (D, 2, 2), made `ages` (D,) [s] before:
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
    return squared, -0.5 * squared - 0.5 * np.log(determinant) - np.log(2.0 * np.pi)


def assigned(log_density: Array, detectable: Array, false: float) -> NDArray[np.int64]:
    """The detection of each track, (T,); -1 for a track that none belongs to. No detection belongs to two.

    log_density (T, D) is of each detection under each track [1/m^2], -inf where it cannot belong to it. The most likely
    assignment maximises the product over tracks of p(z) / `false` where z belongs to the track and of 1 - P_D where
    none does, P_D being its `detectable` (T,), below one. `false` is the density of detections that belong to no track
    over the probability that a body in view is detected [1/m^2]; that a detection was made says that there the body was
    in view. A track's gate is where p(z) >= false.
    """
    from scipy.optimize import linear_sum_assignment  # a tracker that needs it imports it before the first tick

    num_tracks, num = log_density.shape
    if not (num_tracks and num):
        return np.full(num_tracks, -1)
    costs = np.full((num_tracks, num + num_tracks), np.inf)
    gain = log_density - np.log(false)
    costs[:, :num] = np.where(gain >= 0.0, -gain, np.inf)
    costs[:, num:][np.diag_indices(num_tracks)] = -np.log1p(-detectable)
    columns = linear_sum_assignment(costs)[1]
    return np.where(columns < num, columns, -1)
