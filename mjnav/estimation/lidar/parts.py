"""A cluster in parts, one for each body: people side by side, or one half behind another, are one cluster.

The cluster is cut into consecutive parts so that the sum over the parts of

    PART + min(sum of squares of the residuals of a person's circle, LOOSE a return)

is least, by dynamic programming (Bellman 1961; of curves, Perez & Vidal 1994). Cuts are tried where two returns are a
step apart or where one is farther away than the least at both sides; between all returns where there are few. A cluster
of which a straight line costs less is no people, and stays whole.
"""

import numpy as np

from mjnav.estimation.lidar.circle import CUT, OPEN, OWN, ROUNDNESS, Edge, fit_circle
from mjnav.estimation.lidar.clusters import MAX_PASSED, SIGMAS, step_between
from mjnav.geometry.compiled import exact

PART = 12.0  # what a further part has to save, in squared standard deviations
LINE = 36.0  # what a straight line costs, as three people in a row
LOOSE = 9.0  # a return of a part that is no circle, in squared standard deviations
MAX_CUTS = 12
DEPTH = 0.3  # [m] by which the edge of a person may be farther away than what is seen of them
OUTERMOST = 3  # beams of a part by which it is told what lies beyond its edge
MAX_STRAIN = 16.0  # of a circle, in squared standard deviations


@exact
def point(rays, i):
    """Where a beam ends: x, y [m]."""
    return (
        rays.origins[i, 0] + rays.ranges[i] * rays.directions[i, 0],
        rays.origins[i, 1] + rays.ranges[i] * rays.directions[i, 1],
    )


@exact
def edge_beside(rays, beams, turn):
    """The edge beside a part's first beam, where `turn` is -1, or beside its last one, where it is 1.

    Its kind comes from the beam beyond and from the outermost three of the part: one alone may be an outlier.
    """
    num = len(rays.ranges)
    last = beams[-1] if turn > 0 else beams[0]
    other, gap, beyond = last, 0, np.nan
    while not beyond >= rays.min_range:  # a beam that says nothing
        other, gap = other + turn, gap + 1
        if gap > MAX_PASSED + 1 or (not rays.closed and not 0 <= other < num):
            return Edge(OPEN, 0.0, 0.0, 0.0)
        other %= num
        beyond = rays.ranges[other]
    near, far = rays.ranges[last], rays.ranges[last]
    for k in range(1, min(OUTERMOST, len(beams))):
        beside = rays.ranges[beams[-1 - k] if turn > 0 else beams[k]]
        near, far = min(near, beside), max(far, beside)
    step = step_between(rays, last, last)
    kind = OWN if beyond > far + step else CUT if beyond < near - step else OPEN
    if beyond > rays.max_range and far + DEPTH > rays.max_range:  # it may go on out of range
        kind = OPEN
    x, y = rays.directions[last, 0] + rays.directions[other, 0], rays.directions[last, 1] + rays.directions[other, 1]
    length = np.sqrt(x * x + y * y)
    blur = np.sqrt((gap * rays.step) ** 2 + rays.width**2)
    return Edge(kind, x / length, y / length, blur)


@exact
def edges_of(rays, beams):
    """Both edges of a part, the first beam's before the last one's."""
    return edge_beside(rays, beams, -1), edge_beside(rays, beams, 1)


@exact
def width_of(rays, beams):
    """Between the outermost returns of a part, with half a beam at either side [m]."""
    x0, y0 = point(rays, beams[0])
    x1, y1 = point(rays, beams[-1])
    half = 0.5 * (rays.ranges[beams[0]] + rays.ranges[beams[-1]]) * rays.step
    return np.sqrt((x1 - x0) ** 2 + (y1 - y0) ** 2) + half


@exact
def is_narrow(rays, beams, radius, radius_std):
    """Whether a part is no wider than a person may be."""
    return width_of(rays, beams) <= 2.0 * radius + 4.0 * radius_std + SIGMAS * rays.spread[beams[0]]


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
    scores = np.full(m, -0.5)
    nearest_before = np.inf
    for k in range(1, m):
        before, after = rays.ranges[beams[k - 1]], rays.ranges[beams[k]]
        nearest_before = min(nearest_before, before)
        valley = max(before, after) - max(nearest_before, nearest_after[k])
        scores[k] = max(valley, abs(after - before))
    out = np.empty(MAX_CUTS + 2, np.int64)
    out[0], out[1] = 0, m
    for count in range(2, MAX_CUTS + 2):
        best = 0
        for k in range(1, m):
            if scores[k] > scores[best]:
                best = k
        scores[best] = -1.0
        place = count
        while out[place - 1] > best:
            out[place] = out[place - 1]
            place -= 1
        out[place] = best
    return out


@exact
def straight(rays, beams):
    """The cost of a straight line through the returns of a cluster, that of total least squares: LINE at least.

    Its normal is the eigenvector of the returns' covariance with the smaller eigenvalue.
    """
    m = len(beams)
    x, y, xx, xy, yy = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(m):
        px, py = point(rays, beams[k])
        x, y, xx, xy, yy = x + px / m, y + py / m, xx + px * px / m, xy + px * py / m, yy + py * py / m
    along = 0.5 * np.arctan2(2.0 * (xy - x * y), (xx - x * x) - (yy - y * y))
    nx, ny = -np.sin(along), np.cos(along)
    cost = LINE
    for k in range(m):
        px, py = point(rays, beams[k])
        incidence = nx * rays.directions[beams[k], 0] + ny * rays.directions[beams[k], 1]
        variance = (rays.spread[beams[k]] * incidence) ** 2 + ROUNDNESS * ROUNDNESS
        cost += min((nx * (px - x) + ny * (py - y)) ** 2 / variance, LOOSE)
    return cost


@exact
def divided(rays, beams, radius, radius_std):
    """Where the parts of a cluster begin, and where the last one ends, (n + 1,).

    First of all the cluster is tried as one part: most are one person. A straight one stays whole.
    """
    places = cuts(rays, beams)
    last = len(places) - 1
    least, begin = np.full(last + 1, np.inf), np.zeros(last + 1, np.int64)
    least[0] = 0.0
    for step in range(last + 1):
        j = step if step > 0 else last
        for i in range(j - 1 if step > 0 else 0, -1, -1):
            part = beams[places[i] : places[j]]
            cost = LOOSE * len(part)
            if is_narrow(rays, part, radius, radius_std):
                circle = fit_circle(rays, part, edges_of(rays, part), radius, radius_std)
                if step == 0 and fits(circle, len(part)):
                    return np.array([0, len(beams)])
                cost = min(cost, len(part) * circle.misfit + circle.strain)
            if step > 0 and least[i] + PART + cost < least[j]:
                least[j], begin[j] = least[i] + PART + cost, i
    if straight(rays, beams) <= least[last]:
        return np.array([0, len(beams)])
    out = np.empty(last + 1, np.int64)
    count, j = 0, last
    while j > 0:
        out[count] = places[j]
        count, j = count + 1, begin[j]
    out[count] = 0
    return out[: count + 1][::-1].copy()
