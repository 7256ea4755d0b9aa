"""A cluster in parts, one for each body: people side by side, or one half behind another, are one cluster.

The cluster is cut into consecutive parts so that the sum over the parts of

    PART + min(sum of squares of the residuals of a person's circle, LOOSE a return)

is least, by dynamic programming (Bellman 1961; of curves, Perez & Vidal 1994). Cuts are tried where two returns are a
step apart or where one is farther away than the least at both sides; between all returns where there are few.
"""

import numpy as np

from mjnav.estimation.lidar.circle import CUT, OPEN, OWN, Edge, fit_circle
from mjnav.estimation.lidar.clusters import MAX_SILENT, step_between
from mjnav.geometry.compiled import exact

PART = 12.0  # what a further part has to save, in squared standard deviations
LOOSE = 9.0  # a return of a part that is no circle, in squared standard deviations
MAX_CUTS = 12
MAX_STRAIN = 16.0  # of a circle, in squared standard deviations


@exact
def point(rays, i):
    """Where a beam ends: x, y [m]."""
    return (
        rays.origins[i, 0] + rays.ranges[i] * rays.directions[i, 0],
        rays.origins[i, 1] + rays.ranges[i] * rays.directions[i, 1],
    )


@exact
def edge_beside(rays, beam, turn):
    """The edge beside the outermost beam of a part, on the side to which beams are counted by `turn`, -1 or 1."""
    num = len(rays.ranges)
    other, gap, beyond = beam, 0, np.nan
    while not beyond >= rays.min_range:  # a beam that says nothing
        other, gap = other + turn, gap + 1
        if gap > MAX_SILENT + 1 or (not rays.closed and not 0 <= other < num):
            return Edge(OPEN, 0.0, 0.0, 0.0)
        other %= num
        beyond = rays.ranges[other]
    step = step_between(rays, beam, beam)
    x, y = rays.directions[beam, 0] + rays.directions[other, 0], rays.directions[beam, 1] + rays.directions[other, 1]
    length = np.sqrt(x * x + y * y)
    kind = OWN if beyond > rays.ranges[beam] + step else CUT if beyond < rays.ranges[beam] - step else OPEN
    return Edge(kind, x / length, y / length, gap * rays.step)


@exact
def edges_of(rays, beams):
    """Both edges of a part, clockwise end first."""
    return edge_beside(rays, beams[0], -1), edge_beside(rays, beams[-1], 1)


@exact
def width_of(rays, beams):
    """Between the outermost returns of a part, with half a beam at either side [m]."""
    x0, y0 = point(rays, beams[0])
    x1, y1 = point(rays, beams[-1])
    half = 0.5 * (rays.ranges[beams[0]] + rays.ranges[beams[-1]]) * rays.step
    return np.sqrt((x1 - x0) ** 2 + (y1 - y0) ** 2) + half


@exact
def fits(circle, num):
    """Whether a circle explains its returns and edges."""
    return circle.misfit <= 1.5 + 6.0 / np.sqrt(num) and circle.strain <= MAX_STRAIN


@exact
def cuts(rays, beams):
    """The places at which a cluster may be cut, rising, with 0 and the number of its returns, at most MAX_CUTS + 2."""
    m = len(beams)
    if m - 1 <= MAX_CUTS:
        return np.arange(m + 1)
    nearest_after = np.empty(m)
    least = np.inf
    for k in range(m - 1, -1, -1):
        least = min(least, rays.ranges[beams[k]])
        nearest_after[k] = least
    scores = np.empty(m - 1)
    nearest_before = np.inf
    for k in range(1, m):
        before, after = rays.ranges[beams[k - 1]], rays.ranges[beams[k]]
        nearest_before = min(nearest_before, before)
        valley = max(before, after) - max(nearest_before, nearest_after[k])
        scores[k - 1] = max(valley, abs(after - before))
    places = np.sort(np.argsort(scores)[-MAX_CUTS:]) + 1
    out = np.empty(MAX_CUTS + 2, np.int64)
    out[0], out[1:-1], out[-1] = 0, places, m
    return out


@exact
def divided(rays, beams, radius, radius_std, widest):
    """Where the parts of a cluster begin, and where the last one ends, (n + 1,)."""
    places = cuts(rays, beams)
    num = len(places)
    least, begin = np.full(num, np.inf), np.zeros(num, np.int64)
    least[0] = 0.0
    for j in range(1, num):
        for i in range(j - 1, -1, -1):
            part = beams[places[i] : places[j]]
            cost = LOOSE * len(part)
            if width_of(rays, part) <= widest:
                circle = fit_circle(rays, part, edges_of(rays, part), radius, radius_std)
                cost = min(cost, len(part) * circle.misfit + circle.strain)
            if least[i] + PART + cost < least[j]:
                least[j], begin[j] = least[i] + PART + cost, i
    out = np.empty(num, np.int64)
    count, j = 0, num - 1
    while j > 0:
        out[count] = places[j]
        count, j = count + 1, begin[j]
    out[count] = 0
    return out[: count + 1][::-1].copy()
