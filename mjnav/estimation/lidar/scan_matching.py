"""The pose at which a scan lies best on the surfaces of a map, and how well the scan determines it.

A point p of the scan, in the robot's frame, lies at q = (x, y) + R(theta) p in the world. Its residual is the map's
clearance c(q), which is 0 on a surface. With g = grad c(q) the residual's derivative by the pose is

    J = (g_x, g_y, g . R'(theta) p)

and its variance, for a range of variance s^2 along the beam's direction u, is (g . u)^2 s^2 + t^2, t that of the map:
a beam along a wall says as much of the way to the wall as one that meets it squarely. Points that no surface of the
map explains, on people before a wall, get the weight of Geman and McClure,

    w = (m / (m + e^2))^2,   e = c / std,

with m large at first and then small (graduated non-convexity: Blake & Zisserman 1987; Yang et al. 2020), and the pose
follows from Gauss-Newton steps (sum w J^T J / var) d = -sum w J^T c / var. The field takes the place of
correspondences, as in the likelihood field of Thrun, Burgard & Fox (2005, ch. 6.4) and Biber & Strasser (2003).

A beam sees only faces that are turned to it. Where the nearest face is turned away (g . u > 0), as for a point in the
farther half of a wall, the face that was seen is at least |c| before the point: then c = -|c| and g = -g.

Directions that the scan does not determine, such as along a corridor, stay as guessed (Zhang, Kaess & Singh 2016).
"""

from dataclasses import dataclass

import numpy as np
from numpy.linalg import eigh

from mjnav.constant import Constant
from mjnav.estimation.base import MAX_LOG_DENSITY
from mjnav.geometry.angles import wrap
from mjnav.geometry.compiled import Matrix, Vector, kernel
from mjnav.geometry.distance_field import DistanceField, FieldGrid, lookup
from mjnav.messages import Array
from mjnav.noise import Distribution
from mjnav.scenarios.sensors import Lidar

LEAST_FACING = 0.1  # cosine of the angle between a beam and a face, of which the expected range is told
WITHIN = 2.5  # standard deviations
UNKNOWN = 10.0  # [m], [rad] std of a direction that the scan does not determine


@dataclass(frozen=True, slots=True)
class MatchSettings(Constant):
    """What a match believes of map and scan.

    map_std      [m] of the map's surfaces and of the field between its nodes
    scale        e beyond which a point counts for little: 2 std
    wide_scale   the same in the first step, doubled by the spread of the guess
    max_steps    of Gauss-Newton; most matches take four to six
    precision    [m], [rad] of a step that is the last one
    loosest      [m], [rad] std of a direction that is still determined
    inflation    factor on the covariance: neighbouring beams share errors
    shared_std   [m], [m], [rad] of the pose by errors that all beams share: of the map, its field and the beams' times
    """

    map_std: float = 0.01
    scale: float = 2.0
    wide_scale: float = 8.0
    max_steps: int = 15
    precision: float = 1e-5
    loosest: float = 0.2
    inflation: float = 1.4
    shared_std: tuple[float, float, float] = (0.0015, 0.0015, 0.001)


@dataclass(frozen=True, slots=True)
class ScanMatch(Constant):
    """A pose as a scan measures it."""

    pose: Array  # (3,)
    covariance: Array  # (3, 3)
    num_points: int  # of the scan that met something
    explained: float  # mean weight of those within reach: about the share that lies on surfaces of the map


def match_scan(
    field: DistanceField,
    points: Array,
    range_std: Array,
    guess: Array,
    settings: MatchSettings | None = None,
    reach: float = np.inf,
) -> ScanMatch:
    """Matches points (n, 2) [m] in the robot's frame, NaN where a beam met nothing, from a guessed pose (3,) on.

    range_std (n,) [m] is that of each range. Surfaces beyond `reach` [m] do not count (`reach_of`). Without points,
    and on an empty map, the pose is the guess and every direction unknown.
    """
    settings = settings or MatchSettings()
    there = np.isfinite(points).all(axis=1)
    points, variance = np.ascontiguousarray(points[there]), np.ascontiguousarray(range_std[there] ** 2)
    pose, scale = np.array(guess, float), settings.wide_scale
    hessian, explained = np.zeros((3, 3)), 0.0
    for _ in range(settings.max_steps if len(points) and field.grid.clearance.size else 0):
        hessian, gradient, explained = normal_equations(
            points, variance, pose, field.grid, settings.map_std**2, scale**2, reach
        )
        step = -_inverse(hessian, settings.loosest, 0.0) @ gradient
        if scale == settings.scale and np.abs(step).max() < settings.precision:
            break
        pose += step
        scale = max(0.5 * scale, settings.scale)
    pose[2] = wrap(pose[2])
    covariance = _inverse(hessian / settings.inflation, settings.loosest, UNKNOWN**2)
    covariance += np.diag(np.square(settings.shared_std))
    return ScanMatch(pose, covariance, len(points), explained)


def reach_of(lidar: Lidar, noise: Distribution) -> float:
    """How far [m] a surface may be for nearly all of its returns to be within the lidar's range.

    Of a surface at the end of the range only the returns come back that err to the near side.
    """
    end = lidar.max_range
    return float(end - lidar.bias(end, noise) - WITHIN * lidar.std(end, noise))


def _inverse(hessian: Array, loosest: float, unknown: float) -> Array:
    """Of the symmetric matrix (3, 3), `unknown` in place of the variances of directions beyond std `loosest`."""
    values, vectors = eigh(hessian)
    known = values > loosest**-2
    variances = np.where(known, 1.0 / np.where(known, values, 1.0), unknown)
    return (vectors * variances) @ vectors.T


def weighted_law(noise: Distribution, settings: MatchSettings | None = None) -> tuple[float, float]:
    """What the weights make of ranges with errors of this law, z = (error - mean) / std.

    First the centre, the b with E[w z'] = 0, z' = z - b: a match takes ranges with the error b for right. It is 0 for a
    symmetric law; of a skewed one the weights draw it to the mode. Second the variance of a match over what its weights
    sum up to, E[(w z')^2] E[w] / E[d(w z')/dz]^2 / (1 + t^2 / std^2), t the std of the map (Huber 1981, ch. 3.2).
    (0, 1) of a law without a spread.
    """
    if noise.std == 0.0:
        return 0.0, 1.0
    settings = settings or MatchSettings()
    z = np.linspace(-12.0, 12.0, 4801)
    density = np.exp(np.minimum(noise.logpdf(noise.mean + noise.std * z), MAX_LOG_DENSITY))
    density /= density.sum()
    widened = 1.0 + (settings.map_std / noise.std) ** 2
    m = settings.scale**2 * widened
    centre = 0.0
    for _ in range(100):
        weights = density * (m / (m + (z - centre) ** 2)) ** 2
        centre = float(weights @ z / weights.sum())
    squared = (z - centre) ** 2
    w = (m / (m + squared)) ** 2
    slope = density @ (w * (1.0 - 4.0 * squared / (m + squared)))
    return centre, float((density @ (w * w * squared)) * (density @ w) / slope**2 / widened)


@kernel
def normal_equations(
    points: Matrix, variance: Vector, pose: Vector, grid: FieldGrid, map_variance: float, m: float, reach: float
):
    """sum w J^T J / var (3, 3), sum w J^T c / var (3,) and mean w of points (n, 2), var (n,) of their ranges.

    Of points on surfaces at most `reach` [m] away: length - c / (g . u) along the beam.
    """
    hessian, gradient, total, count = np.zeros((3, 3)), np.zeros(3), 0.0, 0
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    for i in range(len(points)):
        x, y = cos * points[i, 0] - sin * points[i, 1], sin * points[i, 0] + cos * points[i, 1]
        c, gx, gy = lookup(grid, pose[0] + x, pose[1] + y)
        length = max(np.sqrt(x * x + y * y), 1e-9)
        along = (gx * x + gy * y) / length
        if along > 0.0:
            c, gx, gy, along = -abs(c), -gx, -gy, -along
        if length - c / min(along, -LEAST_FACING) > reach:
            continue
        count += 1
        turn = gy * x - gx * y
        inverse = 1.0 / (along * along * variance[i] + map_variance)
        weight = m / (m + c * c * inverse)
        weight *= weight
        total += weight
        share = weight * inverse
        hessian[0, 0] += share * gx * gx
        hessian[0, 1] += share * gx * gy
        hessian[0, 2] += share * gx * turn
        hessian[1, 1] += share * gy * gy
        hessian[1, 2] += share * gy * turn
        hessian[2, 2] += share * turn * turn
        gradient[0] += share * c * gx
        gradient[1] += share * c * gy
        gradient[2] += share * c * turn
    hessian[1, 0], hessian[2, 0], hessian[2, 1] = hessian[0, 1], hessian[0, 2], hessian[1, 2]
    return hessian, gradient, total / max(count, 1)
