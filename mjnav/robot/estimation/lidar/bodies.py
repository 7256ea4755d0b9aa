"""Bodies that a scan shows and the map does not have: centres, radii and covariances from clusters of returns.

Before that, returns that belong to no body are told apart: mixed pixels and outliers. A beam has a width, and where it
meets two surfaces its return may come from anywhere between them: a mixed pixel. One edge mixes no more beams than the
width covers. And noise with heavy tails now and then moves a single return far.

A cluster that a circle of a person's radius fits is a person. Any other is divided into parts, each a person if such
a circle fits it (parts.py). What remains is no person: a small thing keeps its size, a larger one is cut at multiples
of PIECE in the world, so that the pieces of a wall stay where they are while the robot drives along it.
"""

import numpy as np

from mjnav.compile.compiled import Matrix, Vector, exact
from mjnav.geometry.distance_field import FieldGrid
from mjnav.robot.estimation.lidar.clusters import (
    EXPLAINED,
    OUTLIER,
    SIGMAS,
    explained,
    joined,
    meets_map,
    runs_of,
    step_between,
)
from mjnav.robot.estimation.lidar.parts import Circle, divided, edges_of, fit_circle, fits, is_narrow, point, width_of
from mjnav.robot.estimation.lidar.scan import Rays

# ------------------------------------------------------------------------ mixed pixels and outliers


MAX_LONE = 8  # lone returns of bodies in a scan; more come from a lidar that errs, and then pairs count no more either
MIN_EVIDENCE = 50.0  # sum of squares of the excess of two returns or more; of a lone one it is OUTLIER squared


@exact
def bodies_among(rays, excess, beams, starts, grid, covariance):
    """Which runs of returns are of a body that the map does not have, a flag each.

    excess (B,): by how many standard deviations the map fails to explain each beam.
    """
    kept, lone = np.zeros(len(starts) - 1, np.bool_), 0
    for c in range(len(starts) - 1):
        run = beams[starts[c] : starts[c + 1]]
        evidence = 0.0
        for k in range(len(run)):
            evidence += excess[run[k]] ** 2
        least = MIN_EVIDENCE if len(run) > 1 else OUTLIER * OUTLIER
        kept[c] = evidence >= least and not straggler(rays, run, grid, covariance)
        lone += kept[c] and len(run) == 1
    if lone > MAX_LONE:
        for c in range(len(starts) - 1):
            kept[c] = kept[c] and starts[c + 1] - starts[c] > 2
    return kept


@exact
def straggler(rays, beams, grid, covariance):
    """Whether returns no more than one edge may mix are none of a body of their own.

    But mixed pixels, between what is nearer at one side and farther at the other, or beyond a surface of the map that
    the beam passed by less than its width and SIGMAS of the robot's uncertainty; or an outlier of what the beam beside
    met.
    """
    first, last, num = beams[0], beams[-1], len(rays.ranges)
    if len(beams) == 1:
        here, noise = rays.ranges[first], OUTLIER * rays.spread[first]
        if min(abs(rays.ranges[first - 1] - here), abs(rays.ranges[(first + 1) % num] - here)) < noise:
            return True
    mixed = 1 + int(rays.width / rays.step + 0.5)
    if len(beams) > mixed or rays.width == 0.0:
        return False
    least, most = min(rays.ranges[first], rays.ranges[last]), max(rays.ranges[first], rays.ranges[last])
    beside = np.zeros((2, 2), np.bool_)  # at either side: something nearer, farther
    for k in range(1, mixed + 1):
        for side, other in ((0, first - k), (1, last + k)):
            away = rays.ranges[other % num]
            beside[side, 0] |= away < least
            beside[side, 1] |= away > most
    if (beside[0, 0] and beside[1, 1]) or (beside[0, 1] and beside[1, 0]):
        return True
    spread = 0.5 * rays.width + SIGMAS * np.sqrt(covariance[2, 2])
    margin = SIGMAS * np.sqrt(max(covariance[0, 0], covariance[1, 1]))
    end = least - step_between(rays, first, first) - margin - spread * least
    return meets_map(rays, first, grid, end, margin, spread) or meets_map(rays, last, grid, end, margin, spread)


# ------------------------------------------------------------------------------ bodies of a cluster


PIECE = 0.35  # [m] along x or y: up to 0.5 m of a slanted wall
MIN_LONG = 4  # returns of a long thing of which single ones are pieces
MIN_RADIUS = 0.03  # [m] reported
MAX_GROWTHS = 3
NEARBY = 0.01  # [m] from a circle at which a return beside the part lies on it
SAME = 0.8  # share of the larger radius at which two bodies' centres are those of one body
COLUMNS = 8  # of a body: x, y, xx, xy, yy, radius, number of beams, time


@exact
def lies_on(rays, beam, circle):
    """Whether a return lies on a circle, on the side towards the lidar."""
    x, y = point(rays, beam)
    nx, ny = x - circle.x, y - circle.y
    distance = max(np.sqrt(nx * nx + ny * ny), 1e-6)
    incidence = (nx * rays.directions[beam, 0] + ny * rays.directions[beam, 1]) / distance
    std = np.sqrt((rays.spread[beam] * incidence) ** 2 + NEARBY * NEARBY)
    return incidence <= 0.0 and abs(distance - circle.radius) <= 2.0 * std


@exact
def grown(rays, states, beams, circle):
    """The part with the returns beside it that lie on its circle though the map explains them: a wall is close."""
    num, m = len(rays.ranges), len(beams)
    added = np.zeros(2, np.int64)  # before the first beam, behind the last one
    for side in range(2):
        turn, other = (-1, beams[0]) if side == 0 else (1, beams[m - 1])
        while m + added[0] + added[1] < num:
            other += turn
            if not rays.closed and not 0 <= other < num:
                break
            other %= num
            if states[other] != EXPLAINED or not lies_on(rays, other, circle):
                break
            added[side] += 1
    out = np.empty(m + added[0] + added[1], np.int64)
    for k in range(len(out)):
        i = k - added[0]
        out[k] = (beams[0] + i) % num if i < 0 else beams[i] if i < m else (beams[m - 1] + i - m + 1) % num
    return out


@exact
def enclosing(rays, beams):
    """The circle around the returns of a part that is no person.

    Its centre is half a radius behind them: on them if they are a flat face, a whole radius behind them if an arc.
    """
    x0, y0 = point(rays, beams[0])
    x1, y1 = point(rays, beams[-1])
    radius = 0.5 * width_of(rays, beams)
    middle = beams[len(beams) // 2]
    ux, uy = rays.directions[middle, 0], rays.directions[middle, 1]
    x, y = 0.5 * (x0 + x1 + radius * ux), 0.5 * (y0 + y1 + radius * uy)
    variance = rays.spread[middle] ** 2 + radius * radius / 12.0
    return Circle(x, y, radius, variance, 0.0, variance, 0.0, 0.0)


@exact
def note(rays, beams, circle, pose, covariance, out):
    """Writes a body's row, with the robot's uncertainty: J P J^T for J = [I, (-(y - q_y), x - q_x)]."""
    lever_x, lever_y = -(circle.y - pose[1]), circle.x - pose[0]
    cross_x, cross_y, turn = covariance[0, 2], covariance[1, 2], covariance[2, 2]
    out[0], out[1] = circle.x, circle.y
    out[2] = circle.xx + covariance[0, 0] + 2.0 * lever_x * cross_x + lever_x * lever_x * turn
    out[3] = circle.xy + covariance[0, 1] + lever_x * cross_y + lever_y * cross_x + lever_x * lever_y * turn
    out[4] = circle.yy + covariance[1, 1] + 2.0 * lever_y * cross_y + lever_y * lever_y * turn
    out[5] = max(circle.radius, MIN_RADIUS)
    out[6] = len(beams)
    time = 0.0
    for k in range(len(beams)):
        time += rays.times[beams[k]] / len(beams)
    out[7] = time


@exact
def find_bodies(rays: Rays, pose: Vector, covariance: Matrix, grid: FieldGrid, radius: float, radius_std: float):
    """A row of COLUMNS for each body that the scan shows and the map does not, (n, 8).

    pose (3,) and covariance (3, 3) of the robot; grid of the map's distance field; mean and standard deviation of a
    person's radius [m].
    """
    states, excess = explained(rays, pose, covariance, grid)
    beams, starts = runs_of(rays, states, radius)
    kept = bodies_among(rays, excess, beams, starts, grid, covariance)
    order, starts = joined(rays, beams, starts, kept, radius)
    rows, count = np.empty((len(order), COLUMNS)), 0
    for c in range(len(starts) - 1):
        whole = order[starts[c] : starts[c + 1]]
        parts = divided(rays, whole, radius, radius_std)
        for p in range(len(parts) - 1):
            beams = whole[parts[p] : parts[p + 1]]
            if len(beams) == 1 and len(parts) > 2:
                continue
            circle, arc = person(rays, states, beams, radius, radius_std)
            if len(arc) > 0:
                note(rays, arc, circle, pose, covariance, rows[count])
                count += 1
            else:
                count = pieces(rays, beams, pose, covariance, rows, count)
    return single(rows[:count])


@exact
def single(rows):
    """The rows without those of bodies that overlap so much that they are one: the one with more returns stays."""
    stays = np.ones(len(rows), np.bool_)
    for i in range(len(rows)):
        for j in range(len(rows)):
            near = SAME * max(rows[i, 5], rows[j, 5])
            if i != j and stays[j] and (rows[i, 0] - rows[j, 0]) ** 2 + (rows[i, 1] - rows[j, 1]) ** 2 < near * near:
                stays[i] = stays[i] and (rows[i, 6] > rows[j, 6] or (rows[i, 6] == rows[j, 6] and i < j))
    return rows[stays]


@exact
def person(rays, states, beams, radius, radius_std):
    """The circle of a part and the returns on it: those of the part, and what the map explains beside them.

    No returns where no circle fits.
    """
    circle = Circle(0.0, 0.0, radius, 0.0, 0.0, 0.0, 0.0, 0.0)
    arc = beams
    for _ in range(MAX_GROWTHS):
        if not is_narrow(rays, arc, radius, radius_std):
            return circle, arc[:0]
        circle = fit_circle(rays, arc, edges_of(rays, arc), radius, radius_std)
        if not fits(circle, len(arc)):
            return circle, arc[:0]
        whole = grown(rays, states, arc, circle)
        if len(whole) == len(arc):
            break
        arc = whole
    return circle, arc


@exact
def pieces(rays, beams, pose, covariance, rows, count):
    """Writes the rows of a part that is no person; returns the new number of rows.

    A long one is cut at multiples of PIECE, along x or y, whichever it follows.
    """
    cut = width_of(rays, beams) > PIECE * np.sqrt(2.0)
    x0, y0 = point(rays, beams[0])
    x1, y1 = point(rays, beams[-1])
    axis = 0 if abs(x1 - x0) > abs(y1 - y0) else 1
    begin = 0
    for k in range(1, len(beams) + 1):
        if k < len(beams):
            if not cut:
                continue
            at = np.floor(point(rays, beams[k])[axis] / PIECE)
            if at == np.floor(point(rays, beams[k - 1])[axis] / PIECE):
                continue
        part = beams[begin:k]
        begin = k
        if len(part) == 1 and 1 < len(beams) < MIN_LONG:
            continue
        note(rays, part, enclosing(rays, part), pose, covariance, rows[count])
        count += 1
    return count
