"""How far a robot drives along a circular arc before it first touches a disc, a wall or a line.

From the origin of its own frame, heading along +x, with curvature k, the robot is after the way s at

    x = w / (1 + k^2 w^2 / 4),   y = (k w^2 / 2) / (1 + k^2 w^2 / 4),   w = (2 / k) tan(k s / 2),

and w = s where k = 0. With that, both |P - o|^2 = R^2 (a disc at o) and m . P + e = R (a line at the signed distance e)
become A w^2 - 2 b w + C = 0,

    disc:  A = 1 - k o_y + k^2 C / 4,      b = o_x,        C = |o|^2 - R^2
    line:  A = k m_y / 2 + k^2 C / 4,      b = -m_x / 2,   C = e - R,

and the distance shrinks at the root w = (b - sqrt(b^2 - A C)) / A = C / (b + sqrt(b^2 - A C)) alone: that is where the
robot comes into contact. A wall is the two lines at R beside it between its ends, and a disc about either end.

What is nearer than R at the start counts as touched where it would come nearer still, so that the robot may leave it.
A disc that moves is met where it is at the time, which is looked for in small steps.

The substitution is Weierstrass's; the use of the distance is that of Fox, Burgard & Thrun (1997), "The Dynamic Window
Approach to Collision Avoidance".
"""

import numpy as np
from numpy.typing import ArrayLike

from mjnav.compile.compiled import Matrix, Vector, kernel
from mjnav.messages import Array

STRAIGHT = 1e-12  # [1/m] of curvature below which an arc is a straight line
GRAZE = 1e-12  # relative size of what, under the root, is rounding: an obstacle passed at R is not touched
STANDSTILL = 1e-9  # [m/s] of speed below which the robot turns on the spot


@kernel
def _contact(a, b, c, curvature):
    """The way s >= 0 to the root at which the distance shrinks; inf without such a root. curvature >= STRAIGHT."""
    square = b * b - a * c
    root = np.sqrt(max(square, 0.0))
    # Of the two forms of the root the one in which nothing cancels.
    over, under = (c, b + root) if b > 0.0 else (b - root, a)
    over, under = (-over, -under) if over < 0.0 else (over, under)
    way = 2.0 / curvature * np.arctan2(0.5 * curvature * over, under)
    if b == 0.0 and c == 0.0:  # along the edge: it depends on to which side the arc turns
        return 0.0 if a < -STRAIGHT else np.inf
    ahead = under > 0.0 or curvature > STRAIGHT  # a straight line never comes back
    return way if square > GRAZE * b * b and ahead else np.inf


@kernel
def _to_disc(x, y, radius, curvature):
    """The way to a disc at (x, y)."""
    c = max(x * x + y * y - radius * radius, 0.0)
    return _contact(1.0 - curvature * y + 0.25 * curvature * curvature * c, x, c, curvature)


@kernel
def _to_line(mx, my, e, radius, curvature):
    """The way to the line at the signed distance e - radius, from its positive side."""
    c = e - radius
    return _contact(0.5 * curvature * my + 0.25 * curvature * curvature * c, -0.5 * mx, c, curvature)


@kernel
def _place(s, curvature):
    """(x, y) after the way s."""
    h = 0.5 * curvature * s
    chord = s * (np.sin(h) / h if h > 0.0 else 1.0)
    return chord * np.cos(h), chord * np.sin(h)


@kernel
def _to_wall(ax, ay, bx, by, radius, curvature):
    """The way to the wall from a to b."""
    length = np.sqrt((bx - ax) ** 2 + (by - ay) ** 2)
    tx, ty = ((bx - ax) / length, (by - ay) / length) if length > 0.0 else (1.0, 0.0)
    beside = ax * ty - ay * tx
    foot = -(ax * tx + ay * ty)
    beyond = max(max(-foot, foot - length), 0.0)
    near = min(radius, np.sqrt(beside * beside + beyond * beyond) if beyond > 0.0 else abs(beside))
    way = min(_to_disc(ax, ay, near, curvature), _to_disc(bx, by, near, curvature))
    for side in (-1.0, 1.0):
        mx, my = -side * ty, side * tx
        s = _to_line(mx, my, side * beside, near, curvature)
        if s < way:
            x, y = _place(s, curvature)
            along = (x - ax) * tx + (y - ay) * ty
            if 0.0 <= along <= length:
                way = s
    return way


@kernel
def _ways(out: Matrix, v: Vector, omega: Vector, disc: Matrix, wall: Matrix, line: Matrix):
    """See `contact_distance`."""
    num_discs, num_walls = disc.shape[0], wall.shape[0]
    for k in range(v.size):
        if abs(v[k]) < STANDSTILL:
            out[k, :] = np.inf
            continue
        # A robot that drives backwards meets the world turned round, one that turns right the world mirrored.
        back = 1.0 if v[k] > 0.0 else -1.0
        curvature = max(abs(omega[k] / v[k]), STRAIGHT)
        turn = back if omega[k] >= 0.0 else -back
        for b in range(num_discs):
            out[k, b] = _to_disc(back * disc[b, 0], turn * disc[b, 1], disc[b, 2], curvature)
        for b in range(num_walls):
            out[k, num_discs + b] = _to_wall(
                back * wall[b, 0], turn * wall[b, 1], back * wall[b, 2], turn * wall[b, 3], wall[b, 4], curvature
            )
        for b in range(line.shape[0]):
            near = min(line[b, 3], line[b, 2])
            out[k, num_discs + num_walls + b] = _to_line(
                back * line[b, 0], turn * line[b, 1], line[b, 2], near, curvature
            )


@kernel
def _moving_ways(out: Matrix, v: Vector, omega: Vector, disc: Matrix, velocity: Matrix, times: Vector):
    """See `contact_distance_moving`."""
    out[:] = np.inf
    x, y = np.empty(times.size), np.empty(times.size)
    for k in range(v.size):
        if abs(v[k]) < STANDSTILL:
            continue
        ahead, left = 1.0 if v[k] > 0.0 else -1.0, 1.0 if v[k] * omega[k] >= 0.0 else -1.0
        for i in range(times.size):
            along, across = _place(abs(v[k]) * times[i], abs(omega[k] / v[k]))
            x[i], y[i] = ahead * along, left * across
        for b in range(disc.shape[0]):
            last, before = 0.0, disc[b, 0] ** 2 + disc[b, 1] ** 2
            for i in range(times.size):
                dx, dy = disc[b, 0] + times[i] * velocity[b, 0] - x[i], disc[b, 1] + times[i] * velocity[b, 1] - y[i]
                squared = dx * dx + dy * dy
                if squared < min(disc[b, 2] ** 2, before):
                    out[k, b] = abs(v[k]) * last
                    break
                last, before = times[i], squared


def contact_distance_moving(v: Array, omega: Array, disc: Array, velocity: Array, times: Array) -> Array:
    """The way [m] along the arc of every (v, omega), (K,) each, before it meets discs that move: (K, D).

    In the robot's frame: discs (D, 3) x, y, R and their velocities (D, 2) [m/s]. They are met at one of `times` (T,)
    [s], ascending; the way is that of the time before. inf without contact, as for a robot that stands or turns on the
    spot.
    """
    out = np.empty((len(v), len(disc)))
    _moving_ways(out, v, omega, disc, velocity, times)
    return out


def contact_distance(v: ArrayLike, omega: ArrayLike, disc: ArrayLike, wall: ArrayLike, line: ArrayLike) -> Array:
    """The way [m] along the arc of every (v, omega), (K,) each, to every obstacle: (K, D + W + L); inf without contact.

    In the robot's frame: discs (D, 3) x, y, R; walls (W, 5) both ends and R; lines (L, 4) m_x, m_y, e, R, which the
    robot keeps at m . P + e >= R, m of length 1. A robot that stands or turns on the spot touches nothing.
    """
    v, omega = (np.ascontiguousarray(a, dtype=float).reshape(-1) for a in (v, omega))
    shapes = ((disc, 3), (wall, 5), (line, 4))
    disc, wall, line = (np.ascontiguousarray(a, dtype=float).reshape(-1, size) for a, size in shapes)
    out = np.empty((v.size, len(disc) + len(wall) + len(line)))
    _ways(out, v, omega, disc, wall, line)
    return out
