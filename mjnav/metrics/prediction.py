"""Quality of predictions: calibration of predicted probabilities, and scores of a person's path predicted by samples.

Forecast i says p_i, and the event then has the frequency q_i: 0 or 1 where it was tried once. In a bin b of forecasts
of similar p, n_b of n, pred_b is the mean of p_i and obs_b that of q_i (the reliability curve):

    ECE = sum_b (n_b / n) |pred_b - obs_b|        bias = mean(p - q)        Brier = mean(q (1 - p)^2 + (1 - q) p^2)

A forecast that is right on average can have an ECE > 0: where p has errors of its own, those that came out low are too
low and those that came out high too high. Sources: Naeini, Cooper & Hauskrecht, "Obtaining Well Calibrated
Probabilities Using Bayesian Binning" (AAAI 2015); Guo et al., "On Calibration of Modern Neural Networks" (ICML 2017);
Brier, Monthly Weather Review 78 (1950) 1.

With x_m(t), m = 1 ... M, the samples of a person t seconds ahead and y(t) where the person was,

    error(t)    = |mean_m x_m(t) - y(t)|
    ADE, FDE    = its mean over the predicted times, and that of the last  (Pellegrini et al. 2009)
    min ADE     = min_m mean_t |x_m(t) - y(t)|                             (Gupta et al. 2018)
    energy(t)   = mean_m |x_m - y| - 1/2 mean_{m,n} |x_m - x_n|            (Gneiting & Raftery 2007, equation 22)
    inside_p(t) = whether y lies in the region that holds the share p of the prediction.

The energy score is proper: on average nothing scores less than the distribution that y comes from. For one sample it is
the error.

The region of a share p in the plane is that of highest density (Hyndman 1996, "Computing and Graphing Highest Density
Regions"), so that a prediction in two parts has a region in two parts. The density at a point goes by the distance to
its k-th nearest neighbour, k = ceil(sqrt(M)) (Loftsgaarden & Quesenberry 1965). y is compared with the samples as one
of M + 1 points, each with the M others for neighbours: if y comes from the samples' own distribution, every rank of its
density is as likely, and it lies inside with probability p exactly, whatever the distribution. The rank at the region's
edge counts in part.
"""

from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjnav.compile.compiled import Cube, Matrix, Vector, kernel
from mjnav.messages import Array

# --------------------------------------------------------------------- calibration of probabilities


# Narrow where risks are low: that is where a robot wants to be.
EDGES: tuple[float, ...] = (0.0, 0.01, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0)

COVERED = 0.95  # of the intervals

Interval = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Bin:
    """The forecasts with low < p <= high; the first bin holds p = 0 alone. Means are None in an empty bin."""

    low: float
    high: float
    count: int
    predicted: float | None
    observed: float | None
    observed_interval: Interval | None


@dataclass(frozen=True, slots=True)
class Calibration:
    """What n forecasts were worth; a figure is None without forecasts, an interval where all are of one group.

    The same holds of a bin.
    """

    count: int
    num_groups: int
    predicted: float | None  # mean p
    observed: float | None  # mean q
    bias: float | None
    bias_interval: Interval | None
    ece: float | None
    ece_interval: Interval | None
    brier: float | None
    bins: tuple[Bin, ...]


def calibration(
    predicted: ArrayLike,
    observed: ArrayLike,
    groups: ArrayLike,
    rng: np.random.Generator,
    *,
    resamples: int = 10_000,
) -> Calibration:
    """Of forecasts p, frequencies q and the group that each is from, (n,) each; p and q lie in [0, 1].

    Intervals are percentile bootstrap intervals that draw whole groups: forecasts of one run resemble one another.
    """
    p, q, edge = np.asarray(predicted, float), np.asarray(observed, float), np.array(EDGES)
    names, group = np.unique(np.asarray(groups), return_inverse=True)

    # Everything follows from three sums a group and bin.
    cell = group * len(edge) + np.searchsorted(edge, p)
    sums = np.stack(
        [np.bincount(cell, weight, minlength=len(names) * len(edge)) for weight in (np.ones_like(p), p, q)]
    ).reshape(3, len(names), len(edge))
    total = sums.sum(axis=1)  # (3, B)
    drawn: Array | None = None
    if len(names) > 1:
        drawn = np.empty((3, resamples, len(edge)))
        block = max(1, 10_000_000 // len(names))  # resamples at a time: 80 MB
        for first in range(0, resamples, block):
            rows = slice(first, min(first + block, resamples))
            times = rng.multinomial(len(names), np.full(len(names), 1.0 / len(names)), size=rows.stop - first)
            drawn[:, rows] = times @ sums
    spread = (sums[0] > 0.0).sum(axis=0) > 1  # (B,) of more than one group
    bins = tuple(
        _bin(b, edge, total, drawn[:, :, b] if drawn is not None and spread[b] else None) for b in range(len(edge))
    )
    if not len(p):
        return Calibration(0, 0, None, None, None, None, None, None, None, bins)
    return Calibration(
        count=len(p),
        num_groups=len(names),
        predicted=float(p.mean()),
        observed=float(q.mean()),
        bias=float(_bias(total)),
        bias_interval=None if drawn is None else _interval(_bias(drawn)),
        ece=float(_ece(total)),
        ece_interval=None if drawn is None else _interval(_ece(drawn)),
        brier=float((q * (1.0 - p) ** 2 + (1.0 - q) * p**2).mean()),
        bins=bins,
    )


def _bias(sums: Array) -> NDArray[np.float64]:
    count, p, q = sums
    return (p - q).sum(axis=-1) / count.sum(axis=-1)


def _ece(sums: Array) -> NDArray[np.float64]:
    # (n_b / n) |pred_b - obs_b| is |sum of p - sum of q| / n.
    count, p, q = sums
    return np.abs(p - q).sum(axis=-1) / count.sum(axis=-1)


def _bin(b: int, edge: Array, total: Array, drawn: Array | None) -> Bin:
    count, p, q = total[:, b].tolist()
    interval = None
    if drawn is not None:
        there = drawn[0] > 0.0  # a draw of groups may leave a bin empty
        interval = _interval(drawn[2, there] / drawn[0, there]) if there.any() else None
    low = float(edge[max(b - 1, 0)])
    return Bin(low, float(edge[b]), int(count), p / count if count else None, q / count if count else None, interval)


def _interval(values: Array) -> Interval:
    low, high = np.quantile(values, [0.5 - 0.5 * COVERED, 0.5 + 0.5 * COVERED]).tolist()
    return low, high


# ------------------------------------------------------------------------ scores of predicted paths


LEVELS = (0.5, 0.9, 0.95)  # of the regions


@dataclass(frozen=True, slots=True)
class PathScores:
    """One prediction of one person, at H times; NaN where nobody knows where the person was."""

    error: Array  # (H,) [m]
    energy: Array  # (H,) [m]
    inside: Array  # (H, L) from 0 to 1, of each level; NaN for a single sample
    nearest: Array  # (H,) [m] |x_m - y| of the sample m of the min ADE

    @property
    def min_ade(self) -> float:
        """The least mean error of one sample [m]."""
        return float(self.nearest.mean())


def path_scores(paths: Array, observed: Array, levels: tuple[float, ...] = LEVELS) -> PathScores:
    """The scores of samples' paths (M, H, 2) where the person's was (H, 2) [m]."""
    paths, observed = np.ascontiguousarray(paths, float), np.ascontiguousarray(observed, float)
    num, steps = paths.shape[:2]
    distance = np.hypot(*np.moveaxis(paths - observed, -1, 0))  # (M, H)
    means = distance.mean(axis=1)
    best = int(np.argmin(np.where(np.isnan(means), np.inf, means)))
    energy, inside = np.empty(steps), np.empty((steps, len(levels)))
    _score(energy, inside, paths, observed, np.array(levels), ceil(sqrt(num)))
    return PathScores(np.hypot(*(paths.mean(axis=0) - observed).T), energy, inside, distance[best])


@kernel
def _score(energy: Vector, inside: Matrix, paths: Cube, observed: Matrix, levels: Vector, k: int):
    """The energy score and what lies inside, at every time."""
    num = len(paths)
    apart = np.empty((num + 1, num + 1))
    least, radius = np.empty(k), np.empty(num + 1)
    x, y = np.empty(num + 1), np.empty(num + 1)
    for h in range(len(energy)):
        x[num], y[num] = observed[h, 0], observed[h, 1]
        if np.isnan(x[num]):
            energy[h] = np.nan
            inside[h] = np.nan
            continue
        for m in range(num):
            x[m], y[m] = paths[m, h, 0], paths[m, h, 1]
        between = 0.0
        for m in range(num + 1):
            apart[m, m] = np.inf
            for n in range(m):
                d = np.sqrt((x[m] - x[n]) ** 2 + (y[m] - y[n]) ** 2)
                apart[m, n] = apart[n, m] = d
                between += d if m < num else 0.0
        energy[h] = apart[num, :num].mean() - between / (num * num)
        if num == 1:
            inside[h] = np.nan
            continue
        for m in range(num + 1):  # the k least distances of each point, in order
            least[:] = np.inf
            for n in range(num + 1):
                place = k - 1
                if apart[m, n] >= least[place]:
                    continue
                while place > 0 and least[place - 1] > apart[m, n]:
                    least[place] = least[place - 1]
                    place -= 1
                least[place] = apart[m, n]
            radius[m] = least[k - 1]
        denser = 0.0  # samples
        for m in range(num):
            denser += 1.0 if radius[m] < radius[num] else 0.5 if radius[m] == radius[num] else 0.0
        for i in range(levels.size):
            inside[h, i] = min(max(levels[i] * (num + 1) - denser, 0.0), 1.0)
