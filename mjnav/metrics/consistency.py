"""Errors of estimates and their consistency with the covariances, and the time to recover from a kidnapping.

With the error e of an estimate of n numbers and the covariance P that it comes with, the normalised estimation error
squared is

    NEES = e^T P^-1 e

For a consistent Gaussian estimate it is chi-squared with n degrees of freedom: its mean is n, and e lies in the 95 %
region where NEES is at most the quantile q_n(0.95). A larger mean says that the estimator is too sure of itself, a
smaller one that it is too modest. Of N independent errors the mean lies within q_{nN}(0.025)/N and q_{nN}(0.975)/N with
probability 0.95. Errors of successive ticks resemble one another, so that of one run it lies outside more often.
Source: Bar-Shalom, Li & Kirubarajan, "Estimation with Applications to Tracking and Navigation" (2001), section 5.4.

After a kidnapping, by which the robot is put elsewhere, it has recovered from the first tick on at which its belief's
mean is within NEAR of its true position and within ALIGNED of its true heading, and stays so for STEADY, or to the next
kidnapping or the run's end.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mjnav.geometry.angles import wrap
from mjnav.messages import Array, Trajectory
from mjnav.metrics.progress import by_blocks, stretches
from mjnav.scene.spec import Scenario

# --------------------------------------------------------------------------- errors and consistency


COVERED = 0.95  # probability of the region that coverage counts
DIVERGED, DIVERGED_TIME = 0.999, 1.0  # an estimate has diverged where it lies outside of this region for this long [s]
SEEN = 0.3  # [s] since the last detection of a track, for it to count as seen: more than a turn of the slowest lidar
DEPLETED = 0.02  # a belief is depleted where its effective sample size is below this share of its particles
_EXACT = 1e-12  # of the largest variance: a smaller one counts as none


@dataclass(frozen=True, slots=True)
class Consistency:
    """The consistency of one estimate over a run; a figure is None where there is no estimate."""

    ticks: int  # with an estimate
    nees: float | None  # mean; infinite where an estimate that claims to be exact is wrong
    nees_interval: tuple[float, float] | None  # that holds the mean of as many independent ones with probability 0.95
    coverage: float | None  # share of ticks at which the truth lies in the 95 % region
    divergences: int  # times that it lay outside of the 99.9 % region for DIVERGED_TIME


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


def seen_tracking_rmse(trajectory: Trajectory) -> float | None:
    """The same where the track was detected within SEEN; None where nobody was."""
    hidden = trajectory.track_states[trajectory.track_states[:, 6] > SEEN]
    if not len(hidden):
        return tracking_rmse(trajectory)
    row = hidden[:, 0].astype(np.intp)
    which, person = np.nonzero((trajectory.tracks[row] == hidden[:, None, 2:6]).all(axis=-1))
    tracks = trajectory.tracks[..., :2].copy()
    tracks[row[which], person] = np.nan
    return _rms(tracks, trajectory.people_position[:-1])


def _rms(estimates: Array, truth: Array) -> float | None:
    """Root mean square distance of estimates (T, ..., 2) from the truth, without those that are not finite."""
    squared = by_blocks(lambda estimate, true: ((estimate - true) ** 2).sum(-1), estimates, truth)
    squared = squared[np.isfinite(squared)]
    return float(np.sqrt(squared.mean())) if squared.size else None


def nees(error: Array, triangle: Array) -> Array:
    """The NEES (...,) of errors (..., n), from the triangles (..., n (n + 1) / 2) of their covariances.

    A covariance without an inverse claims to know some direction exactly: infinite where the error has a part in that
    direction, else that direction counts nothing. NaN without an error or a covariance.
    """
    num = error.shape[-1]
    place = np.empty((num, num), int)
    place[np.triu_indices(num)] = range(num * (num + 1) // 2)
    rest, entry = list(np.moveaxis(error, -1, 0)), list(np.moveaxis(triangle, -1, 0))
    least = _EXACT * np.max([np.abs(entry[place[i, i]]) for i in range(num)], axis=0)
    total = np.zeros(error.shape[:-1])
    with np.errstate(divide="ignore", invalid="ignore"):
        for j in range(num):  # eliminates one number after the other, as a Cholesky decomposition does
            pivot = entry[place[j, j]]
            exact = pivot <= least
            squared = rest[j] ** 2
            total = total + np.where(exact, np.where(squared > least, np.inf, 0.0), squared / pivot)
            for i in range(j + 1, num):
                factor = np.where(exact, 0.0, entry[place[j, i]] / pivot)
                rest[i] = rest[i] - factor * rest[j]
                for k in range(i, num):
                    entry[place[i, k]] = entry[place[i, k]] - factor * entry[place[j, k]]
    return np.where(np.isnan(error).any(axis=-1) | np.isnan(triangle).any(axis=-1), np.nan, total)


def robot_nees(trajectory: Trajectory) -> Array:
    """The NEES of the robot's x, y and heading at each tick, (T,)."""
    return by_blocks(nees, robot_error(trajectory), trajectory.estimate_triangle)


def people_nees(trajectory: Trajectory) -> Array:
    """The NEES of each person's x, y, vx and vy at each tick, (T, P); NaN without a track."""
    return by_blocks(nees, track_error(trajectory), trajectory.track_triangle)


def region(probability: float, num: int) -> float:
    """The quantile of the chi-squared distribution with `num` degrees of freedom."""
    from scipy.special import gammaincinv

    return 2.0 * float(gammaincinv(0.5 * num, probability))


def of_robot(trajectory: Trajectory) -> Consistency:
    """The consistency of the robot's estimate."""
    return consistency(robot_nees(trajectory), 3, trajectory.time)


def of_people(trajectory: Trajectory) -> Consistency:
    """The consistency of all people's tracks together."""
    return consistency(people_nees(trajectory), 4, trajectory.time)


def consistency(found: Array, num: int, time: Array) -> Consistency:
    """Of NEES (T,) or (T, P) of estimates of `num` numbers, NaN without one, at ticks that begin at `time` (T + 1,)."""
    known = found[~np.isnan(found)]
    divergences = sum(
        bool(time[last] - time[first] >= DIVERGED_TIME - 1e-9)
        for column in (found[:, None] if found.ndim == 1 else found).T
        for first, last in stretches(column > region(DIVERGED, num))
    )
    if not known.size:
        return Consistency(0, None, None, None, divergences)
    ends = (region(probability, num * known.size) / known.size for probability in (0.025, 0.975))
    covered = float((known <= region(COVERED, num)).mean())
    return Consistency(known.size, float(known.mean()), (next(ends), next(ends)), covered, divergences)


def least(values: Array) -> float | None:
    """The least of effective sample sizes, without those that are not finite; None where there are no others."""
    known = values[np.isfinite(values)]
    return float(known.min()) if known.size else None


def mean(values: Array) -> float | None:
    """The mean of the same."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else None


def robot_particles(trajectory: Trajectory, scenario: Scenario) -> Array:
    """How many particles the robot's belief has at each tick, (T,); as many as are set where a log does not say it."""
    known = trajectory.robot_particles
    return np.where(np.isnan(known), scenario.estimation.robot.particles, known)


def depleted_share(ess: Array, particles: Array | float) -> float | None:
    """The share of beliefs with an effective sample size below DEPLETED of their particles; None without beliefs."""
    share = (ess / particles)[np.isfinite(ess)]
    return float((share < DEPLETED).mean()) if share.size else None


def skew_and_kurtosis(samples: Array) -> tuple[Array, Array]:
    """Skew and kurtosis (3 for a Gaussian) of each column of samples (n, ...); NaN where all are alike.

    For headings, hand over their differences from the mean.
    """
    centred = samples - samples.mean(0)
    variance = (centred**2).mean(0)
    variance = np.where(variance > 0.0, variance, np.nan)
    return (centred**3).mean(0) / variance**1.5, (centred**4).mean(0) / variance**2


# ------------------------------------------------------------------------- recovery from kidnapping


NEAR = 0.5  # [m]
ALIGNED = 0.3  # [rad]
STEADY = 1.0  # [s]


@dataclass(frozen=True, slots=True)
class Recoveries:
    """The kidnappings of a run that took place, and how long the robot needed after each [s]; None where it did not."""

    times: tuple[float | None, ...]

    @property
    def recovered(self) -> int:
        """After how many of them it knew again."""
        return sum(time is not None for time in self.times)

    @property
    def longest(self) -> float | None:
        """The longest time of those after which it knew again [s]; None without any."""
        return max((time for time in self.times if time is not None), default=None)


def recoveries(trajectory: Trajectory, scenario: Scenario) -> Recoveries | None:
    """Of each kidnapping; None in a run without any.

    The robot may be put down later than the run file says, where somebody stands there: the tick counts at which it is
    first seen elsewhere.
    """
    if scenario.faults is None or not scenario.faults.kidnappings:
        return None
    num = len(trajectory.estimate)
    begun = [_first_tick(trajectory, scenario, one.time) for one in scenario.faults.kidnappings]
    ends = [*(k for k in begun if k is not None and k < num), num]
    error = robot_error(trajectory)
    knows = (np.hypot(error[:, 0], error[:, 1]) <= NEAR) & (np.abs(error[:, 2]) <= ALIGNED)
    return Recoveries(tuple(_recovery(trajectory.time, knows, first, end) for first, end in pairwise(ends)))


def _recovery(time: np.ndarray, knows: np.ndarray, first: int, end: int) -> float | None:
    """Of a kidnapping that is first seen at tick `first`, in the ticks before `end`."""
    for start, stop in stretches(knows[first:end]):
        if first + stop == end or time[first + stop] - time[first + start] >= STEADY - 1e-9:
            return round(float(time[first + start] - time[first]), 9)
    return None


def _first_tick(trajectory: Trajectory, scenario: Scenario, due: float) -> int | None:
    """The first tick after a jump that was due at a time [s]; None where the run was over before."""
    time, place = trajectory.time, trajectory.robot_pose[:, :2]
    first = int(np.searchsorted(time, due - 1e-9))
    if first >= len(time):
        return None
    step = np.hypot(*np.diff(place[max(first - 1, 0) :], axis=0).T)
    reach = 2.0 * scenario.robot.max_speed * scenario.control.period
    jumps = np.flatnonzero(step > reach)
    return first if not len(jumps) or first == 0 else first + int(jumps[0])
