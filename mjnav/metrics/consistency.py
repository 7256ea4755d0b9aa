"""Whether estimates are right, and whether they know how wrong they are."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from mjnav.geometry.angles import wrap
from mjnav.messages import Array, Trajectory
from mjnav.metrics.blocks import by_blocks

# 95 % quantiles of the chi-squared distribution by degrees of freedom
CHI2_95: Mapping[int, float] = MappingProxyType({3: 7.814727903251178, 4: 9.487729036781154})

MAX_CONDITION = 1e12  # of a covariance that can be inverted


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


def nees(error: Array, covariance: Array) -> Array:
    """Normalised estimation error squared e^T P^-1 e of errors (..., n) with covariances (..., n, n): (...).

    Its mean is n and 95 % are below CHI2_95[n] where the covariance is right and the error Gaussian. NaN where the
    covariance is singular or either is not finite. Source: Bar-Shalom, Li & Kirubarajan, Estimation with Applications
    to Tracking and Navigation, 2001, section 5.4.
    """
    out = np.full(error.shape[:-1], np.nan)
    usable = np.asarray(np.isfinite(error).all(-1) & np.isfinite(covariance).all((-2, -1)))
    usable[usable] = np.linalg.cond(covariance[usable]) < MAX_CONDITION
    solved = np.linalg.solve(covariance[usable], error[usable][..., None])[..., 0]
    out[usable] = (error[usable] * solved).sum(-1)
    return out


def mean_nees(error: Array, covariance: Array) -> float | None:
    """Mean of `nees`; None where it is nowhere defined."""
    values = nees(error, covariance)
    values = values[np.isfinite(values)]
    return float(values.mean()) if values.size else None


def coverage(error: Array, covariance: Array) -> float | None:
    """How often the truth lies in the 95 % region of the estimate, for 3 or 4 dimensions; None as `mean_nees`."""
    values = nees(error, covariance)
    values = values[np.isfinite(values)]
    return float((values <= CHI2_95[error.shape[-1]]).mean()) if values.size else None


def skew_and_kurtosis(samples: Array) -> tuple[Array, Array]:
    """Skew and kurtosis (3 for a Gaussian) of each column of samples (n, ...); NaN where all are alike.

    For headings, hand over their differences from the mean.
    """
    centred = samples - samples.mean(0)
    variance = (centred**2).mean(0)
    variance = np.where(variance > 0.0, variance, np.nan)
    return (centred**3).mean(0) / variance**1.5, (centred**4).mean(0) / variance**2
