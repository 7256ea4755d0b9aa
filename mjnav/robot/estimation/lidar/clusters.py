"""Clusters of the returns of a scan that the map does not explain.

A return p on a surface that the map has lies at the distance c(p) = 0 from it. By the range's spread s along the beam
u, and by the robot's covariance P, whose pose q moves p by J dq, that distance has the variance

    (s n.u)^2 + (J^T n)^T P (J^T n),     n = grad c,     J = [I, (-(p_y - q_y), p_x - q_x)]

The map explains a return with |c| <= TOLERANCE + GATE standard deviations. The tolerance is for the map itself: what it
has may stand a little elsewhere, and its field is read between the nodes of a grid.

The other returns are gathered in the order of the beams into runs, each of one surface. Two returns belong together
where they are at most as far apart as a surface allows that the lidar sees at the angle INCIDENCE or more, the adaptive
breakpoint of Borges & Aldon (2004),

    d <= r sin(phi) / sin(INCIDENCE - phi) + 3 sigma

with r the nearer range and phi the angle between the beams, and no farther than neighbours on the arc of a person, of
radius R: at its edge, beams s = r phi apart meet it sqrt(2 R s) apart. A few beams between the two are passed over if
nothing returned from them, or if they are outliers; but not one that ends much farther away.

Then what may be mixed pixels is taken out of the runs (bodies.py). Last, two runs are joined whose ends are at most a
person apart, where what lies between is hidden by something nearer: somebody behind a table's leg.
"""

import numpy as np

from mjnav.compile.compiled import exact, kernel
from mjnav.geometry.distance_field import lookup

# -------------------------------------------------------------------- returns that the map explains


TOLERANCE = 0.05  # [m]
GATE = 3.0  # standard deviations
MIN_STD = 0.001  # [m]
MIN_STEP = 0.02  # [m] of sphere tracing
SILENT, NOTHING, EXPLAINED, NEW = -1, 0, 1, 2  # a beam that says nothing; one that met nothing; returns


@kernel
def beyond_map(rays, beam, distance, pose, covariance, grid):
    """How many standard deviations a return would be beyond the tolerance of the map, at a `distance` along a beam."""
    ux, uy = rays.directions[beam, 0], rays.directions[beam, 1]
    x, y = rays.origins[beam, 0] + distance * ux, rays.origins[beam, 1] + distance * uy
    clearance, nx, ny = lookup(grid, x, y)
    lever = ny * (x - pose[0]) - nx * (y - pose[1])
    along = rays.spread[beam] * (nx * ux + ny * uy)
    variance = along * along + (
        nx * (nx * covariance[0, 0] + 2.0 * (ny * covariance[0, 1] + lever * covariance[0, 2]))
        + ny * (ny * covariance[1, 1] + 2.0 * lever * covariance[1, 2])
        + lever * lever * covariance[2, 2]
    )
    return max(abs(clearance) - TOLERANCE, 0.0) / np.sqrt(max(variance, MIN_STD * MIN_STD))


@kernel
def explained(rays, pose, covariance, grid):
    """What the map says to each beam, (B,): SILENT, NOTHING, EXPLAINED or NEW.

    Also how many standard deviations the return is beyond the tolerance, (B,), 0 without a return. pose (3,) and
    covariance (3, 3): of the robot; grid: of the map's distance field.
    """
    num = len(rays.ranges)
    states, excess = np.zeros(num, np.int64), np.zeros(num)
    for i in range(num):
        distance = rays.ranges[i]
        if not (distance >= rays.min_range):
            states[i] = SILENT
            continue
        if distance > rays.max_range:
            states[i] = NOTHING
            continue
        excess[i] = beyond_map(rays, i, distance, pose, covariance, grid)
        states[i] = NEW if excess[i] > GATE else EXPLAINED
    return states, excess


@kernel
def meets_map(rays, beam, grid, end, margin, spread):
    """Whether a beam passes a surface of the map within `end` [m], at most `margin` [m] + `spread` times its way away.

    Sphere tracing (Hart 1996): from a point with the clearance c the beam is free for c.
    """
    along = rays.min_range
    while along < end:
        x = rays.origins[beam, 0] + along * rays.directions[beam, 0]
        y = rays.origins[beam, 1] + along * rays.directions[beam, 1]
        clearance = lookup(grid, x, y)[0]
        beside = margin + spread * along
        if clearance < beside:
            return True
        along += max(clearance - beside, MIN_STEP)
    return False


# ----------------------------------------------------------------------------------------- clusters


INCIDENCE = np.deg2rad(10.0)
SIGMAS = 3.0
MAX_PASSED = 2  # beams between two returns of one surface that do not belong to it
OUTLIER = 8.0  # standard deviations by which the noise may move a return, one among many


@exact
def step_between(rays, i, j):
    """The least difference of two beams' ranges [m] that is one of two surfaces, by the spread of both."""
    return 0.02 + SIGMAS * np.sqrt(rays.spread[i] ** 2 + rays.spread[j] ** 2)


@exact
def gap_between(rays, a, b):
    """Between the ends of two beams, b behind a: the distance [m], and what their ranges' noise may add to it [m]."""
    x = rays.origins[b, 0] + rays.ranges[b] * rays.directions[b, 0]
    y = rays.origins[b, 1] + rays.ranges[b] * rays.directions[b, 1]
    x -= rays.origins[a, 0] + rays.ranges[a] * rays.directions[a, 0]
    y -= rays.origins[a, 1] + rays.ranges[a] * rays.directions[a, 1]
    return np.sqrt(x * x + y * y), SIGMAS * np.sqrt(rays.spread[a] ** 2 + rays.spread[b] ** 2)


@exact
def counted(rays, a, b):
    """How many of the beams between two end at something nearer than both, and how many do not.

    The latter are too many, more than MAX_PASSED, where one ends much farther away.
    """
    num = len(rays.ranges)
    near, far = min(rays.ranges[a], rays.ranges[b]), max(rays.ranges[a], rays.ranges[b])
    nearer, others = 0, 0
    for k in range(1, (b - a) % num):
        between = rays.ranges[(a + k) % num]
        if between < near - step_between(rays, a, b):
            nearer += 1
        elif far + OUTLIER * rays.spread[a] < between <= rays.max_range:
            return nearer, MAX_PASSED + 1
        else:
            others += 1
    return nearer, others


@exact
def together(rays, a, b, radius):
    """Whether the returns of two beams belong to one surface; b is behind a."""
    angle = ((b - a) % len(rays.ranges)) * rays.step
    if angle > 0.5 * np.pi:
        return False
    distance, noise = gap_between(rays, a, b)
    near = min(rays.ranges[a], rays.ranges[b])
    limit = np.sqrt(2.0 * radius * near * angle)
    if angle < 0.9 * INCIDENCE:
        limit = min(limit, near * np.sin(angle) / np.sin(INCIDENCE - angle))
    if distance > limit + noise:
        return False
    nearer, others = counted(rays, a, b)
    return nearer + others <= MAX_PASSED


@exact
def is_hidden(rays, a, b, radius):
    """Whether what lies between two returns of one person, b behind a, is hidden by something nearer."""
    distance, noise = gap_between(rays, a, b)
    if distance > 2.0 * radius + noise:
        return False
    nearer, others = counted(rays, a, b)
    return nearer > 0 and others <= MAX_PASSED


@exact
def labelled(rays, new, radius):
    """The number of the run of each NEW beam of `new` (m,), which begin behind the widest gap; and how many.

    One return that belongs to neither neighbour does not part them.
    """
    m = len(new)
    labels, count = np.zeros(m, np.int64), 1
    last, stray = 0, -1  # of the present run; the one behind it that does not belong to it
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
def runs_of(rays, states, radius):
    """The NEW returns in runs: beams (m,) run by run, and where each begins, (n + 1,).

    The beams of a run are in the order in which they are taken, also across the scan's seam where it is closed.
    radius [m]: of a person.
    """
    new, m = np.empty(len(states), np.int64), 0
    for i in range(len(states)):
        if states[i] == NEW:
            new[m] = i
            m += 1
    if m == 0:
        return new[:0], np.zeros(1, np.int64)
    first, widest = 0, 0
    if rays.closed:
        for k in range(m):
            gap = (new[k] - new[k - 1 if k > 0 else m - 1]) % len(states)
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
    beams, filled = np.empty(m, np.int64), np.zeros(count, np.int64)
    for k in range(m):
        beams[starts[labels[k]] + filled[labels[k]]] = turned[k]
        filled[labels[k]] += 1
    return beams, starts


@exact
def joined(rays, beams, starts, kept, radius):
    """The `kept` runs, a flag each, in clusters: beams cluster by cluster, and where each begins."""
    out, begins = np.empty(len(beams), np.int64), np.zeros(len(starts), np.int64)
    m, count = 0, 0
    for c in range(len(starts) - 1):
        if not kept[c]:
            continue
        if m == 0 or not is_hidden(rays, out[m - 1], beams[starts[c]], radius):
            begins[count] = m
            count += 1
        for k in range(starts[c], starts[c + 1]):
            out[m] = beams[k]
            m += 1
    begins[count] = m
    return out[:m], begins[: count + 1]
