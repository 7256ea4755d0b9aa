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
from mjnav.metrics.definitions import HIGHER, INTEGER, LOWER, Definition, figures
from mjnav.metrics.progress import by_blocks, jumps, stretches
from mjnav.scene.spec import Scenario

# --------------------------------------------------------------------------- errors and consistency


COVERED = 0.95  # probability of the region that coverage counts
DIVERGED, DIVERGED_TIME = 0.999, 1.0  # an estimate has diverged where it lies outside of this region for this long [s]
SEEN = 0.3  # [s] since the last detection of a track, for it to count as seen: more than a turn of the slowest lidar
DEPLETED = 0.02  # a belief is depleted where its effective sample size is below this share of its particles
_EXACT = 1e-12  # of the largest variance: a smaller one counts as none
_NOBODY_TRACKED = "nobody was tracked"
_CERTAIN = "a belief is certain of what is wrong"
_BAR_SHALOM = "Bar-Shalom, Li and Kirubarajan (2001)"


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


@figures(
    "knowledge",
    Definition("localization_rmse_m", better=LOWER, words="error of the robot's belief", null="no ticks",
               equation=r"\sqrt{\frac{1}{T}\sum_k \lvert\hat p_k - p_k\rvert^2}"),
)  # fmt: skip
def localization_rmse(trajectory: Trajectory) -> float | None:
    """Root mean square distance between the estimated and the true position of the robot [m]; None without ticks.

    * localization_rmse_m: error of the robot's estimated position, root of the mean square
    """
    return _rms(trajectory.estimate[:, :2], trajectory.robot_pose[:-1, :2])


@figures(
    "knowledge",
    Definition("tracking_rmse_m", better=LOWER, words="error of beliefs of people", null=_NOBODY_TRACKED),
)  # fmt: skip
def tracking_rmse(trajectory: Trajectory) -> float | None:
    """The same for people, over all ticks and people with a track [m]; None where nobody was tracked.

    * tracking_rmse_m: error of people's estimated positions, root of the mean square over ticks and people with a track
    """
    return _rms(trajectory.tracks[..., :2], trajectory.people_position[:-1])


@figures(
    "knowledge",
    Definition("seen_tracking_rmse_m", better=LOWER, words="error of beliefs of people in sight",
               null=_NOBODY_TRACKED, over_all=True),
)  # fmt: skip
def seen_tracking_rmse(trajectory: Trajectory) -> float | None:
    """The same where the track was detected within SEEN; None where nobody was.

    * seen_tracking_rmse_m: the same of tracks that were detected in the last 0.3 s, without those of people who are
      hidden; where the sensor says who is who, all of them
    """
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


@figures(
    "consistency",
    Definition("robot_nees", words="NEES of the robot (3 is right)", null=f"no belief, or {_CERTAIN}",
               source=_BAR_SHALOM, equation=r"\frac{1}{T}\sum_k e_k^\top P_k^{-1} e_k"),
    Definition("robot_coverage", words="coverage of the robot (0.95 is right)", null="no belief", source=_BAR_SHALOM,
               equation=r"e_k^\top P_k^{-1} e_k \le \chi^2_{3}(0.95)"),
    Definition("robot_divergences", type=INTEGER, better=LOWER, words="divergences of the robot's belief"),
    over_all=True,
)  # fmt: skip
def robot_consistency(trajectory: Trajectory) -> tuple[float | None, float | None, int]:
    """NEES, coverage and divergences of the robot's estimate.

    * robot_nees: normalised estimation error squared of the robot's x, y and heading, mean over ticks; 3 for a
      consistent estimate, more where it is too sure of itself
    * robot_coverage: share of ticks at which the true pose lies in the 95 % region of the belief's mean and covariance;
      0.95 for a consistent Gaussian estimate
    * robot_divergences: times that the true pose lay outside of the 99.9 % region for 1 s or longer
    """
    judged = of_robot(trajectory)
    return judged.nees, judged.coverage, judged.divergences


@figures(
    "consistency",
    Definition("people_nees", words="NEES of people (4 is right)", null=f"{_NOBODY_TRACKED}, or {_CERTAIN}",
               source=_BAR_SHALOM),
    Definition("people_coverage", words="coverage of people (0.95 is right)", null=_NOBODY_TRACKED,
               source=_BAR_SHALOM, equation=r"e_k^\top P_k^{-1} e_k \le \chi^2_{4}(0.95)"),
    Definition("people_divergences", type=INTEGER, better=LOWER, words="divergences of tracks"),
    over_all=True,
)  # fmt: skip
def people_consistency(trajectory: Trajectory) -> tuple[float | None, float | None, int]:
    """The same of people's tracks.

    * people_nees: normalised estimation error squared of people's x, y, vx and vy, mean over ticks and people with a
      track; 4 for a consistent estimate
    * people_coverage: share of ticks and people with a track at which the person lies in the track's 95 % region
    * people_divergences: times that a person lay outside of the 99.9 % region of the track for 1 s or longer
    """
    judged = of_people(trajectory)
    return judged.nees, judged.coverage, judged.divergences


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


@figures(
    "consistency",
    *(
        Definition(f"ess_{name}.{of}", f"effective sample size of {belief}, before resampling, {name} over ticks",
                   better=HIGHER, words=f"{name} effective sample size of {of}", null=null, over_all=True,
                   source="Kong, Liu and Wong (1994)", equation=r"\left(\sum_i w_i\right)^2 / \sum_i w_i^2")
        for name in ("min", "mean")
        for of, belief, null in (("robot", "the robot's belief", "no belief"),
                                 ("people", "people's tracks", _NOBODY_TRACKED))
    ),
    Definition("robot_depleted_share", better=LOWER, words="share of time depleted, robot", null="no belief",
               over_all=True),
    Definition("people_depleted_share", better=LOWER, words="share of time depleted, people", null=_NOBODY_TRACKED,
               over_all=True),
    Definition("recoveries", type=INTEGER, words="recoveries of filters", over_all=True),
)  # fmt: skip
def effective_sizes(trajectory: Trajectory, scenario: Scenario) -> tuple[float | None, ...]:
    """How many particles counted, for the robot and for people: the least, the mean, shares depleted; recoveries.

    * robot_depleted_share: share of ticks at which the effective sample size of the robot's belief is below 2 % of the
      number of its particles
    * people_depleted_share: the same of people's tracks, over ticks and people with a track
    * recoveries: times that a filter was spread again, because its belief explained no reading for some time
    """
    robot, people = trajectory.robot_ess, trajectory.people_ess
    return (
        *(of(ess) for of in (least, mean) for ess in (robot, people)),
        depleted_share(robot, robot_particles(trajectory, scenario)),
        depleted_share(people, scenario.estimation.obstacles.particles),
        trajectory.recoveries,
    )


_SKEW = r"G_1 = \frac{\sqrt{n(n-1)}}{n-2}\, m_3/m_2^{3/2}"
_KURTOSIS = r"G_2 + 3,\ G_2 = \frac{n-1}{(n-2)(n-3)}\left((n+1)\,g_2 + 6\right),\ g_2 = m_4/m_2^2 - 3"


@figures(
    "knowledge",
    *(
        Definition(
            f"{of}_{shape}", f"{text}{gaussian}, of {whose} samples that the controller got",
            equation=equation, null="no people; all samples equal; fewer than four", source="Joanes and Gill (1998)",
        )
        for of, whose, text in (("robot", "the robot's", "mean over ticks, x and y"),
                                ("people", "people's", "mean over ticks, people, x and y"))
        for shape, equation, gaussian in (("skew", _SKEW, ""), ("kurtosis", _KURTOSIS, "; 3 for a Gaussian"))
    ),
)  # fmt: skip
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


@figures(
    "consistency",
    Definition("kidnappings", type=INTEGER, null="without [faults] kidnap"),
    Definition("kidnappings_recovered", type=INTEGER, better=HIGHER, null="without [faults] kidnap"),
    Definition("kidnap_recovery_s", better=LOWER, words="recovery after a kidnapping", null="none, or none recovered"),
    over_all=True,
)  # fmt: skip
def kidnappings(trajectory: Trajectory, scenario: Scenario) -> tuple[int, int, float | None] | None:
    """How many took place, after how many the robot knew again, and the longest time it took [s]; None without any.

    * kidnappings: times that the robot was put elsewhere
    * kidnappings_recovered: of these those after which its belief came within 0.5 m and 0.3 rad of its pose for 1 s, or
      to the next or the end of the run
    * kidnap_recovery_s: time from a kidnapping to that, the longest of those after which it came about
    """
    times = recoveries(trajectory, scenario)
    if times is None:
        return None
    recovered = [time for time in times if time is not None]
    return len(times), len(recovered), max(recovered, default=None)


def recoveries(trajectory: Trajectory, scenario: Scenario) -> tuple[float | None, ...] | None:
    """How long the robot needed after each kidnapping that took place [s], None where it never knew again.

    None in a run without any. The robot may be put down later than the run file says, where somebody stands there: the
    tick counts at which it is first seen elsewhere.
    """
    if scenario.faults is None or not scenario.faults.kidnappings:
        return None
    num = len(trajectory.estimate)
    begun = [_first_tick(trajectory, scenario, one.time) for one in scenario.faults.kidnappings]
    ends = [*(k for k in begun if k is not None and k < num), num]
    error = robot_error(trajectory)
    knows = (np.hypot(error[:, 0], error[:, 1]) <= NEAR) & (np.abs(error[:, 2]) <= ALIGNED)
    return tuple(_recovery(trajectory.time, knows, first, end) for first, end in pairwise(ends))


def _recovery(time: np.ndarray, knows: np.ndarray, first: int, end: int) -> float | None:
    """Of a kidnapping that is first seen at tick `first`, in the ticks before `end`."""
    for start, stop in stretches(knows[first:end]):
        if first + stop == end or time[first + stop] - time[first + start] >= STEADY - 1e-9:
            return round(float(time[first + start] - time[first]), 9)
    return None


def _first_tick(trajectory: Trajectory, scenario: Scenario, due: float) -> int | None:
    """The first tick after a jump that was due at a time [s]; None where the run was over before."""
    time = trajectory.time
    first = int(np.searchsorted(time, due - 1e-9))
    if first >= len(time):
        return None
    seen = np.flatnonzero(jumps(trajectory, scenario)[max(first - 1, 0) :])
    return first if not len(seen) or first == 0 else first + int(seen[0])
