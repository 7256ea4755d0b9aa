"""Scores of a person's path predicted by samples.

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

from mjnav.compile.compiled import Cube, Matrix, Vector, kernel
from mjnav.messages import Array

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
