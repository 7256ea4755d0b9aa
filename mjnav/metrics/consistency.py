"""How far estimates are from the truth, and the shape of their samples."""

import numpy as np

from mjnav.geometry.angles import wrap
from mjnav.messages import Array, Trajectory
from mjnav.metrics.blocks import by_blocks


def robot_error(trajectory: Trajectory) -> Array:
    """Estimate - truth of x, y [m], heading [rad], (T, 3)."""
    error = trajectory.estimate - trajectory.robot_pose[:-1]
    error[:, 2] = wrap(error[:, 2])
    return error


def track_error(trajectory: Trajectory) -> Array:
    """Estimate - truth of each person's x, y, vx, vy, (T, P, 4); NaN without a track."""
    truth = np.concatenate([trajectory.people_position, trajectory.people_velocity], axis=-1)[:-1]
    return trajectory.tracks - truth


def localization_rmse(trajectory: Trajectory) -> float | None:
    """Root mean square distance between the estimated and the true position of the robot [m]; None without ticks."""
    return _rms(trajectory.estimate[:, :2], trajectory.robot_pose[:-1, :2])


def tracking_rmse(trajectory: Trajectory) -> float | None:
    """The same for people, over all ticks and people with a track [m]; None where nobody was tracked."""
    return _rms(trajectory.tracks[..., :2], trajectory.people_position[:-1])


def _rms(estimates: Array, truth: Array) -> float | None:
    """Root mean square distance of estimates (T, ..., 2) from the truth, without those that are not finite."""
    squared = by_blocks(lambda estimate, true: ((estimate - true) ** 2).sum(-1), estimates, truth)
    squared = squared[np.isfinite(squared)]
    return float(np.sqrt(squared.mean())) if squared.size else None


def skew_and_kurtosis(samples: Array) -> tuple[Array, Array]:
    """Skew and kurtosis (3 for a Gaussian) of each column of samples (n, ...); NaN where all are alike.

    For headings, hand over their differences from the mean.
    """
    centred = samples - samples.mean(0)
    variance = (centred**2).mean(0)
    variance = np.where(variance > 0.0, variance, np.nan)
    return (centred**3).mean(0) / variance**1.5, (centred**4).mean(0) / variance**2
