"""Divides a cluster of returns into parts, one for each body, and fits a circle to the arc that a scan shows of it.

The unknowns of a circle are the centre c and the radius r. A beam u from o with the range z and its spread s meets the
circle at t = u.(c - o) - sqrt(r^2 - (u x (c - o))^2), where the outward normal is n. Each return, and each edge of the
silhouette, a beam that touches the circle, says

    (z - t) n.u = 0              with the standard deviation  sqrt((s n.u)^2 + roundness^2)
    u x (c - o) +- r = 0         with that of a tangent anywhere between two neighbouring beams, |c - o| step / sqrt(12)

n.u turns the error along the beam into one across the surface, so that a return at grazing incidence, where t changes
without bounds, counts for little. The first iterations take |p - c| - r of the return's place p instead: it is the same
to first order and converges from farther away, but is biased where s is not small against r.

The radius has a Gaussian prior: without it, noise makes the circle of a short arc too small (Chernov & Lesort 2005, of
Kasa's fit), and the centre of three returns is worth nothing. An edge that another body's edge cuts says only that the
circle goes on behind it, for no more than its radius allows.

Gauss-Newton, with weights by Huber against returns that belong to something else (Zhang 1997). The covariance is the
inverse of the last normal matrix, for the centre.

People side by side, or one half behind another, are one cluster. It is cut into consecutive parts so that the sum over
the parts of

    PART + min(sum of squares of the residuals of a person's circle, LOOSE a return)

is least, by dynamic programming (Bellman 1961; of curves, Perez & Vidal 1994). Cuts are tried where two returns are a
step apart or where one is farther away than the least at both sides; between all returns where there are few. A cluster
of which a straight line costs less is no people, and stays whole.
"""

from typing import NamedTuple

import numpy as np

from mjnav.compile.compiled import exact, kernel, scalar
from mjnav.robot.estimation.lidar.clusters import MAX_PASSED, SIGMAS, step_between

# ---------------------------------------------------------------------------------- fit of a circle


ROUNDNESS = 0.005  # [m] standard deviation of a body's surface about its circle
ITERATIONS = 8
APPROACHES = 3  # first iterations, by the distance from the circle
MAX_STEP = 0.15  # [m] of the centre in one iteration
HUBER = 2.0  # standard deviations from which on a residual counts less
MAX_SQUARE = 9.0  # of a residual in standard deviations: a return may belong to something else
OWN, CUT, OPEN = 0, 1, 2  # an edge of the body itself; one of what stands before it; one of which nothing is known


class Edge(NamedTuple):
    """One side of the part of a body that a scan shows."""

    kind: int  # OWN, CUT or OPEN
    x: float  # unit vector midway between the last beam on the body and the first one beside it
    y: float
    blur: float  # [rad] between these two, and the width of a beam


class Circle(NamedTuple):
    """A fitted circle: centre [m], radius [m], covariance of the centre [m^2], and how well it fits."""

    x: float
    y: float
    radius: float
    xx: float
    xy: float
    yy: float
    misfit: float  # mean square of the returns' residuals, in standard deviations, each at most MAX_SQUARE
    strain: float  # sum of squares of the residuals of the edges and of the radius' prior, in standard deviations


@scalar
def weigh(normal, right, row_x, row_y, row_r, residual, weight):
    """Adds one row of a least-squares problem in (x, y, r) to its normal equations, in place."""
    normal[0] += weight * row_x * row_x
    normal[1] += weight * row_x * row_y
    normal[2] += weight * row_x * row_r
    normal[3] += weight * row_y * row_y
    normal[4] += weight * row_y * row_r
    normal[5] += weight * row_r * row_r
    right[0] -= weight * row_x * residual
    right[1] -= weight * row_y * residual
    right[2] -= weight * row_r * residual


@kernel
def fit_circle(rays, beams, edges, radius, radius_std):
    """The circle of the returns of `beams` (m,), in order counter-clockwise, between `edges` (right, left).

    rays: `Rays`; radius and radius_std [m]: mean and standard deviation of the prior. Returns a `Circle`.
    """
    m = len(beams)
    middle_x, middle_y, ahead_x, ahead_y = 0.0, 0.0, 0.0, 0.0
    for k in range(m):
        i = beams[k]
        middle_x += (rays.origins[i, 0] + rays.ranges[i] * rays.directions[i, 0]) / m
        middle_y += (rays.origins[i, 1] + rays.ranges[i] * rays.directions[i, 1]) / m
        ahead_x += rays.directions[i, 0]
        ahead_y += rays.directions[i, 1]
    length = np.sqrt(ahead_x * ahead_x + ahead_y * ahead_y)
    ahead_x, ahead_y = ahead_x / length, ahead_y / length
    first, last = beams[0], beams[m - 1]
    # Half the chord between the two outermost returns, across the line of sight, with half a beam at either side.
    across = 0.5 * abs(
        (rays.ranges[last] * rays.directions[last, 1] - rays.ranges[first] * rays.directions[first, 1]) * ahead_x
        - (rays.ranges[last] * rays.directions[last, 0] - rays.ranges[first] * rays.directions[first, 0]) * ahead_y
    )
    depth = np.sqrt(max(radius * radius - min(across, 0.9 * radius) ** 2, 0.0))
    x, y, r = middle_x + 0.5 * (radius + depth) * ahead_x, middle_y + 0.5 * (radius + depth) * ahead_y, radius
    hidden = max(2.0 * (radius - across), 0.0)  # how far the circle may go on behind an edge that is not its own
    both_unknown = edges[0].kind != OWN and edges[1].kind != OWN

    normal, right = np.zeros(6), np.zeros(3)
    covariance = np.zeros(6)
    misfit, strain = 0.0, 0.0
    for iteration in range(ITERATIONS):
        normal[:] = 0.0
        right[:] = 0.0
        misfit, strain = 0.0, ((r - radius) / radius_std) ** 2
        weigh(normal, right, 0.0, 0.0, 1.0, r - radius, 1.0 / (radius_std * radius_std))
        for k in range(m):
            i = beams[k]
            ux, uy = rays.directions[i, 0], rays.directions[i, 1]
            dx, dy = rays.origins[i, 0] - x, rays.origins[i, 1] - y
            ahead, offset = -(dx * ux + dy * uy), dy * ux - dx * uy
            if iteration >= APPROACHES and abs(offset) < r:
                incidence = np.sqrt(r * r - offset * offset) / r
                expected = ahead - r * incidence
                nx, ny = (dx + expected * ux) / r, (dy + expected * uy) / r
                residual = (expected - rays.ranges[i]) * incidence
            else:
                nx, ny = dx + rays.ranges[i] * ux, dy + rays.ranges[i] * uy
                distance = max(np.sqrt(nx * nx + ny * ny), 1e-6)
                nx, ny = nx / distance, ny / distance
                incidence = nx * ux + ny * uy
                residual = distance - r
            variance = (rays.spread[i] * incidence) ** 2 + ROUNDNESS * ROUNDNESS
            normed = abs(residual) / np.sqrt(variance)
            misfit += min(normed * normed, MAX_SQUARE) / m
            weight = 1.0 / variance if normed <= HUBER else HUBER / (normed * variance)
            weigh(normal, right, -nx, -ny, -1.0, residual, weight)
        for side in range(2):
            edge = edges[side]
            beam = first if side == 0 else last
            sign = -1.0 if side == 0 else 1.0
            if edge.kind == OWN:
                ux, uy = edge.x, edge.y
                dx, dy = x - rays.origins[beam, 0], y - rays.origins[beam, 1]
                std = np.sqrt(dx * dx + dy * dy) * edge.blur / np.sqrt(12.0)
                beyond = 0.0
            elif both_unknown:
                ux, uy = rays.directions[beam, 0], rays.directions[beam, 1]
                dx, dy = x - rays.origins[beam, 0], y - rays.origins[beam, 1]
                std, beyond = hidden / np.sqrt(12.0), 0.5 * hidden
            else:
                continue
            std = max(std, ROUNDNESS)
            # For the left edge the centre is r to the right of the tangent: u x (c - o) = -(r - beyond).
            residual = ux * dy - uy * dx + sign * (r - beyond)
            normed = abs(residual) / std
            strain += normed * normed
            weight = min(1.0, HUBER / max(normed, HUBER)) / (std * std)
            weigh(normal, right, -uy, ux, sign, residual, weight)
        determinant = inverse(normal, covariance)
        if not determinant > 0.0:
            break
        step_x = covariance[0] * right[0] + covariance[1] * right[1] + covariance[2] * right[2]
        step_y = covariance[1] * right[0] + covariance[3] * right[1] + covariance[4] * right[2]
        step_r = covariance[2] * right[0] + covariance[4] * right[1] + covariance[5] * right[2]
        length = np.sqrt(step_x * step_x + step_y * step_y)
        share = min(1.0, MAX_STEP / length) if length > 0.0 else 1.0
        x, y, r = x + share * step_x, y + share * step_y, max(r + share * step_r, 0.01)
        if length < 1e-4 and iteration > APPROACHES:
            break
    return Circle(x, y, r, covariance[0], covariance[1], covariance[3], misfit, strain)


@kernel
def inverse(normal, out):
    """Inverts a symmetric 3 x 3 matrix, given as its upper triangle, into that of `out`; returns the determinant."""
    a, b, c, d, e, f = normal[0], normal[1], normal[2], normal[3], normal[4], normal[5]
    out[0], out[1], out[2] = d * f - e * e, c * e - b * f, b * e - c * d
    determinant = a * out[0] + b * out[1] + c * out[2]
    out[3], out[4], out[5] = a * f - c * c, b * c - a * e, a * d - b * b
    if determinant > 0.0:
        for k in range(6):
            out[k] /= determinant
    return determinant


# ---------------------------------------------------------------------------- division of a cluster


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
