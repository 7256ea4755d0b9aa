"""Returns that belong together: those of one surface, in the order of the beams.

Two returns belong together where they are at most as far apart as a surface allows that the lidar sees at the angle
INCIDENCE or more, the adaptive breakpoint of Borges & Aldon (2004),

    d <= r sin(phi) / sin(INCIDENCE - phi) + 3 sigma

with r the nearer range and phi the angle between the beams, and no farther than neighbours on the arc of a person, of
radius R: at its edge, beams s = r phi apart meet it sqrt(2 R s) apart. Beams between the two are passed over where they
end at something nearer, which hides what lies between, or where a few returned nothing. One that ends farther away has
passed between them.
"""

import numpy as np

from mjnav.estimation.lidar.explained import NEW
from mjnav.geometry.compiled import exact

INCIDENCE = np.deg2rad(10.0)
SIGMAS = 3.0
MAX_SILENT = 2  # beams in a row without a return that a surface may have


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
    hidden, silent = False, 0
    for k in range(1, gap):
        between = rays.ranges[(a + k) % num]
        if not between <= rays.max_range:
            silent += 1
            if silent > MAX_SILENT:
                return False
        elif between > far + step:
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
def cluster(rays, states, radius):
    """The NEW returns in clusters: beams (m,) cluster by cluster, and where each begins, (n + 1,).

    The beams of a cluster are in the order in which they are taken, also across the scan's seam where it is closed.
    radius [m]: of a person.
    """
    new = np.flatnonzero(states == NEW)
    m = len(new)
    begins = np.zeros(m, np.bool_)
    for k in range(m):
        before = new[k - 1] if k > 0 else new[m - 1]
        begins[k] = (k == 0 and not rays.closed) or m == 1 or not together(rays, before, new[k], radius)
    first = 0
    while first < m and not begins[first]:
        first += 1
    first = first if first < m else 0
    beams, starts = np.empty(m, np.int64), np.empty(m + 1, np.int64)
    count = 0
    for k in range(m):
        place = (first + k) % m
        beams[k] = new[place]
        if k == 0 or begins[place]:
            starts[count] = k
            count += 1
    starts[count] = m
    return beams, starts[: count + 1]
