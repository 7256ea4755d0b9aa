"""Returns that belong together: those of one surface, in the order of the beams.

Two returns belong together where they are at most as far apart as a surface allows that the lidar sees at the angle
INCIDENCE or more, the adaptive breakpoint of Borges & Aldon (2004),

    d <= r sin(phi) / sin(INCIDENCE - phi) + 3 sigma

with r the nearer range and phi the angle between the beams, and no farther than neighbours on the arc of a person, of
radius R: at its edge, beams s = r phi apart meet it sqrt(2 R s) apart. Beams between the two are passed over where they
end at something nearer, which hides what lies between, where a few returned nothing, and where one is an outlier. One
that ends much farther away has passed between them.
"""

import numpy as np

from mjnav.estimation.lidar.explained import NEW
from mjnav.geometry.compiled import exact

INCIDENCE = np.deg2rad(10.0)
SIGMAS = 3.0
MAX_SILENT = 2  # beams in a row without a return that a surface may have
OUTLIER = 8.0  # standard deviations by which the noise may move a return, one among many


@exact
def step_between(rays, i, j):
    """The least difference of two beams' ranges [m] that is one of two surfaces, by the spread of both."""
    return 0.02 + SIGMAS * np.sqrt(rays.spread[i] ** 2 + rays.spread[j] ** 2)


@exact
def together(rays, a, b, radius):
    """Whether the returns of two beams, with none that is NEW between them, belong to one body; b is behind a."""
    num = len(rays.ranges)
    gap = (b - a) % num
    near, far = min(rays.ranges[a], rays.ranges[b]), max(rays.ranges[a], rays.ranges[b])
    x = rays.origins[b, 0] + rays.ranges[b] * rays.directions[b, 0]
    y = rays.origins[b, 1] + rays.ranges[b] * rays.directions[b, 1]
    x -= rays.origins[a, 0] + rays.ranges[a] * rays.directions[a, 0]
    y -= rays.origins[a, 1] + rays.ranges[a] * rays.directions[a, 1]
    distance = np.sqrt(x * x + y * y)
    noise = SIGMAS * np.sqrt(rays.spread[a] ** 2 + rays.spread[b] ** 2)
    if distance > 2.0 * radius + noise:
        return False
    step = step_between(rays, a, b)
    hidden, silent, beyond = False, 0, 0
    for k in range(1, gap):
        between = rays.ranges[(a + k) % num]
        if not between <= rays.max_range:
            silent += 1
            if silent > MAX_SILENT:
                return False
        elif between > far + step:
            beyond += 1
            if beyond > 1 or between > far + OUTLIER * rays.spread[a]:
                return False
        else:
            hidden = hidden or between < near - step
    if hidden:
        return True
    angle = gap * rays.step
    limit = np.sqrt(2.0 * radius * near * angle)
    if angle < 0.9 * INCIDENCE:
        limit = min(limit, near * np.sin(angle) / np.sin(INCIDENCE - angle))
    return distance <= limit + noise


@exact
def labelled(rays, new, radius):
    """The number of the cluster of each NEW beam of `new` (m,), which begin behind the widest gap; and how many.

    One return that belongs to neither neighbour does not part them.
    """
    m = len(new)
    labels, count = np.zeros(m, np.int64), 1
    last, stray = 0, -1  # of the present cluster; the one behind it that does not belong to it
    for k in range(1, m):
        if together(rays, new[last], new[k], radius):
            labels[k] = labels[last]
            last, stray = k, -1
        elif stray < 0:
            stray = k
            labels[k] = count
            count += 1
        elif together(rays, new[stray], new[k], radius):
            labels[k] = labels[stray]
            last, stray = k, -1
        else:
            last, stray = stray, k
            labels[k] = count
            count += 1
    return labels, count


@exact
def cluster(rays, states, radius):
    """The NEW returns in clusters: beams (m,) cluster by cluster, and where each begins, (n + 1,).

    The beams of a cluster are in the order in which they are taken, also across the scan's seam where it is closed.
    radius [m]: of a person.
    """
    new = np.flatnonzero(states == NEW)
    m = len(new)
    if m == 0:
        return new, np.zeros(1, np.int64)
    first, widest = 0, 0
    if rays.closed:
        for k in range(m):
            gap = (new[k] - new[k - 1]) % len(states)
            if gap > widest:
                first, widest = k, gap
    turned = np.empty(m, np.int64)
    for k in range(m):
        turned[k] = new[(first + k) % m]
    labels, count = labelled(rays, turned, radius)
    starts = np.zeros(count + 1, np.int64)
    for k in range(m):
        starts[labels[k] + 1] += 1
    for c in range(count):
        starts[c + 1] += starts[c]
    beams, filled = np.empty(m, np.int64), starts.copy()
    for k in range(m):
        beams[filled[labels[k]]] = turned[k]
        filled[labels[k]] += 1
    return beams, starts
