"""Surfels: pieces of surface, one for each cell of a grid of evidence that lasts, as scans are matched with them.

The places of the cells around one, weighed by their beams, have a mean m and a covariance with the eigenvalues
l1 >= l2 and the axis t of l1. Where l2 <= FLAT l1 they make a line, and the surfel is the place on it in the cell, with
the variance l2 across it. So neither noise nor where a cell begins is taken for a surface's shape, and a scan that
slides along a wall stays as near to it. Else the surfel is the cell's own place: of a leg, a pillar, a corner.
(Surfels: Pfister et al. 2000; cells with normals: Biber & Strasser 2003, the normal distributions transform.)

Nobody who walks makes a line of this length. So lines count sooner than points.
"""

from typing import NamedTuple

import numpy as np

from mjnav.compile.compiled import Indices, Matrix, Vector, kernel
from mjnav.geometry.evidence_grid import CELL, OCCUPIED, EvidenceGrid

AROUND = 6  # cells to each side that make a line
FLAT = 0.06
FEWEST = 3  # cells that make a line
COUNTED = 10.0  # beams of a cell, beyond which they add no weight
POINTS = 2.5  # log odds from which on a cell may be a point: somebody who walks is not as long in one
POINT = 0.25  # weight of a return beside a point, for where it lies on the surface there is not known
NODE = 0.5 * CELL  # [m] between the places at which the nearest surfel is known


class Surfels(NamedTuple):
    """Pieces of surface as kernels take them; the node [0] lies at (x, y) [m]."""

    places: Matrix  # (k, 2) [m] of their middles
    normals: Matrix  # (k, 2) unit vectors across them, to either side; 0 of a point
    frames: Matrix  # (k, 6) covariance of the frame in which they were placed (`EvidenceGrid.frames`)
    scatter: Vector  # (k,) [m^2] variance of cells' places across their line; 0 of a point
    nearest: Indices  # (n * n,) the place that is nearest to each node, rows along y; -1 where none is in reach
    columns: int  # n
    x: float
    y: float


def surfels_of(grid: EvidenceGrid, reach: float) -> Surfels:
    """Of a grid; they are known within `reach` [m] of them."""
    columns = round(CELL / NODE) * len(grid.odds) + 1
    surfels = Surfels(*_pieces(grid), nearest=np.full(columns * columns, -1), columns=columns, x=grid.x, y=grid.y)
    _fill(surfels, reach)
    return surfels


@kernel
def _pieces(grid: EvidenceGrid):
    n, most = len(grid.odds), int(np.sum(grid.odds > OCCUPIED))
    places, normals, frames, scatter = np.empty((most, 2)), np.empty((most, 2)), np.empty((most, 6)), np.empty(most)
    k = 0
    for j in range(n):
        for i in range(n):
            if grid.odds[j, i] <= OCCUPIED:
                continue
            x, y, nx, ny, scatter[k] = _line(grid, j, i)
            if nx == 0.0 and ny == 0.0 and grid.odds[j, i] <= POINTS:
                continue
            places[k, 0], places[k, 1], normals[k, 0], normals[k, 1] = x, y, nx, ny
            frames[k] = grid.frames[j, i]
            k += 1
    return places[:k], normals[:k], frames[:k], scatter[:k]


@kernel
def _line(grid, j, i):
    """The place of a cell on the line of those around it, its normal and scatter; its own place and 0 of none."""
    n = len(grid.odds)
    x, y = grid.places_x[j, i], grid.places_y[j, i]
    cells, weight, mx, my, xx, xy, yy = 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for b in range(max(j - AROUND, 0), min(j + AROUND, n - 1) + 1):
        for a in range(max(i - AROUND, 0), min(i + AROUND, n - 1) + 1):
            if grid.odds[b, a] > OCCUPIED:
                w, dx, dy = min(grid.counts[b, a], COUNTED), grid.places_x[b, a] - x, grid.places_y[b, a] - y
                cells += 1
                weight += w
                mx, my = mx + w * dx, my + w * dy
                xx, xy, yy = xx + w * dx * dx, xy + w * dx * dy, yy + w * dy * dy
    mx, my = mx / weight, my / weight  # from the cell's own place
    xx, xy, yy = xx / weight - mx * mx, xy / weight - mx * my, yy / weight - my * my
    middle, half = 0.5 * (xx + yy), np.sqrt(0.25 * (xx - yy) ** 2 + xy * xy)
    across = middle - half
    if cells < FEWEST or across > FLAT * (middle + half):
        return x, y, 0.0, 0.0, 0.0
    axis = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    nx, ny = -np.sin(axis), np.cos(axis)
    away = nx * mx + ny * my
    return x + away * nx, y + away * ny, nx, ny, across


@kernel
def _fill(surfels: Surfels, reach: float):
    n, far = surfels.columns, reach / NODE
    squared = np.full(n * n, far * far)
    for k in range(len(surfels.places)):
        u, v = (surfels.places[k, 0] - surfels.x) / NODE, (surfels.places[k, 1] - surfels.y) / NODE
        for j in range(max(int(np.ceil(v - far)), 0), min(int(v + far), n - 1) + 1):
            for i in range(max(int(np.ceil(u - far)), 0), min(int(u + far), n - 1) + 1):
                away = (i - u) * (i - u) + (j - v) * (j - v)
                if away < squared[j * n + i]:
                    squared[j * n + i] = away
                    surfels.nearest[j * n + i] = k


@kernel
def nearest(surfels: Surfels, x: float, y: float):
    """The surfel that is nearest to the node next to (x, y) [m]; -1 for none."""
    i, j = int(np.floor((x - surfels.x) / NODE + 0.5)), int(np.floor((y - surfels.y) / NODE + 0.5))
    if not (0 <= i < surfels.columns and 0 <= j < surfels.columns):
        return -1
    return surfels.nearest[j * surfels.columns + i]


@kernel
def frame_error(surfels: Surfels, points: Matrix, pose: Vector):
    """The mean covariance (6,) of the frames of surfels on which points (n, 2) of the robot's frame at `pose` lie."""
    total, count = np.zeros(6), 0
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    for b in range(len(points)):
        x = pose[0] + cos * points[b, 0] - sin * points[b, 1]
        y = pose[1] + sin * points[b, 0] + cos * points[b, 1]
        k = nearest(surfels, x, y)
        if k >= 0:
            total += surfels.frames[k]
            count += 1
    return total / max(count, 1)


@kernel
def normal_equations(surfels: Surfels, points: Matrix, variance: Vector, pose: Vector, map_variance: float, m: float):
    """sum w J^T J / var (3, 3), sum w J^T c / var (3,) and mean w of points (n, 2), var (n,) of their ranges.

    As `lidar.scan_matching` has them of a map: c is the distance across a line, or from a point.
    """
    hessian, gradient, total, count = np.zeros((3, 3)), np.zeros(3), 0.0, 0
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    for b in range(len(points)):
        x, y = cos * points[b, 0] - sin * points[b, 1], sin * points[b, 0] + cos * points[b, 1]
        k = nearest(surfels, pose[0] + x, pose[1] + y)
        if k < 0:
            continue
        dx, dy = pose[0] + x - surfels.places[k, 0], pose[1] + y - surfels.places[k, 1]
        gx, gy, part = surfels.normals[k, 0], surfels.normals[k, 1], 1.0
        if gx == 0.0 and gy == 0.0:
            away = max(np.sqrt(dx * dx + dy * dy), 1e-9)
            gx, gy, part = dx / away, dy / away, POINT
        c, along = gx * dx + gy * dy, (gx * x + gy * y) / max(np.sqrt(x * x + y * y), 1e-9)
        inverse = 1.0 / (along * along * variance[b] + map_variance + surfels.scatter[k])
        weight = (m / (m + c * c * inverse)) ** 2
        count += 1
        total += weight
        weight *= part
        row = (gx, gy, gy * x - gx * y)
        for a in range(3):
            gradient[a] += weight * inverse * c * row[a]
            for e in range(3):
                hessian[a, e] += weight * inverse * row[a] * row[e]
    return hessian, gradient, total / max(count, 1)
