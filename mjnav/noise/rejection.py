"""The loop of type IV's rejection, compiled; every operation is rounded as written, so that a seed's draws replay."""

from math import exp, log1p, sin

import numpy as np

from mjnav.geometry.compiled import exact
from mjnav.geometry.kernel_types import Indices, Matrix, Vector

_EDGE = -1.0 + 2.0**-53


@exact
def accept(u: Matrix, left: Vector, high: Vector, low: Vector, area: Vector, guide: Indices, r: float, t0: float):
    """The psi that rejection accepts of m proposals by uniform draws u (2, m), in order.

    A step of the staircase is searched from `guide` on; below `low` no proposal needs g. See `pearson_iv`.
    """
    accepted = np.empty(u.shape[1])
    count = 0
    for i in range(u.shape[1]):
        below = u[0, i] * area[-1]
        step = guide[int(u[0, i] * len(guide))]
        while step + 1 < len(high) and area[step + 1] <= below:
            step += 1
        psi = left[step] + (below - area[step]) / high[step]
        height = u[1, i] * high[step]
        if height > low[step]:
            cosine = -2.0 * sin(0.5 * psi) ** 2 - t0 * sin(psi)
            if height > exp(r * (log1p(max(cosine, _EDGE)) + t0 * psi)):
                continue
        accepted[count] = psi
        count += 1
    return accepted[:count]
