"""The violation of rollouts: how deeply, at worst, a joint sample of what is uncertain comes into what must stay free.

    h_s(k) = max over j, t of  gamma_jt min(2, [R_j + m_jt - d_jts(k)]_+ / m_jt)

d_jts(k) is the distance between sample s of the robot, at the end of step t of rollout k, and sample s of obstacle j
then. 0 where it stays more than the margin m_jt away from the contact at R_j, 1 at a contact where gamma_jt = 1.

A row of `h` (K, S) belongs to a rollout, so that the innermost loops run over the samples. Rollouts are arrays (T, K).
"""

import numpy as np

from mjnav.compile.compiled import Cube, Matrix, Vector, kernel

TINY = 1e-300
DEEPEST = 2.0  # a violation above it counts no more


@kernel
def _centre_and_spread(x, y):
    """The mean of points (n,) and the greatest distance from it."""
    cx, cy, farthest = x.mean(), y.mean(), 0.0
    for i in range(x.size):
        farthest = max(farthest, (x[i] - cx) ** 2 + (y[i] - cy) ** 2)
    return cx, cy, np.sqrt(farthest)


@kernel
def _bounds(x, y):
    """The box around all rollouts at the end of each step: low x, high x, low y, high y, (T, 4)."""
    bounds = np.empty((x.shape[0], 4))
    for t in range(x.shape[0]):
        bounds[t, 0], bounds[t, 1], bounds[t, 2], bounds[t, 3] = x[t].min(), x[t].max(), y[t].min(), y[t].max()
    return bounds


@kernel
def _apart_squared(bounds, low_x, high_x, low_y, high_y):
    """The squared distance of a box around a body from the rollouts' box (4,) of a step."""
    beside_x = max(bounds[0] - high_x, low_x - bounds[1], 0.0)
    beside_y = max(bounds[2] - high_y, low_y - bounds[3], 0.0)
    return beside_x**2 + beside_y**2


@kernel
def meet_discs(
    h: Matrix, x: Matrix, y: Matrix, qx: Cube, qy: Cube, reach: Matrix, per_margin: Matrix, discount: Matrix
):
    """Raises `h` by discs that move: qx, qy (T, B, S) are samples of the discs less those of the robot.

    reach (T, B) is R + m, per_margin (T, B) 1 / m, and discount (T, B) gamma.
    """
    bounds = _bounds(x, y)
    for t in range(qx.shape[0]):
        for b in range(qx.shape[1]):
            px, py = qx[t, b], qy[t, b]
            cx, cy, spread = _centre_and_spread(px, py)
            limit, slope, most = reach[t, b], reach[t, b] * per_margin[t, b], discount[t, b]
            fall = per_margin[t, b]
            outside = (limit + spread) ** 2
            if _apart_squared(bounds[t], cx, cx, cy, cy) >= outside:
                continue
            for k in range(x.shape[1]):
                rx, ry = x[t, k], y[t, k]
                if (rx - cx) ** 2 + (ry - cy) ** 2 >= outside:
                    continue
                for s in range(px.size):
                    dx, dy = rx - px[s], ry - py[s]
                    depth = min(slope - fall * np.sqrt(dx * dx + dy * dy), DEEPEST)
                    h[k, s] = max(h[k, s], most * depth)


@kernel
def meet_walls(
    h: Matrix,
    x: Matrix,
    y: Matrix,
    ex: Vector,
    ey: Vector,
    wall: Matrix,
    reach: Vector,
    margin: float,
    discount: Vector,
):
    """Raises `h` by bodies at rest: segments ax, ay, bx, by (W, 4), a point where its ends are one, with reach R + m.

    ex, ey (S,) are the robot's samples less their mean; `discount` (T,) is gamma.
    """
    _, _, spread = _centre_and_spread(ex, ey)
    spread += np.sqrt(ex.mean() ** 2 + ey.mean() ** 2)
    fall, apart = 1.0 / margin, np.empty(x.shape[1])
    bounds = _bounds(x, y)
    for w in range(wall.shape[0]):
        ax, ay = wall[w, 0], wall[w, 1]
        dx, dy = wall[w, 2] - ax, wall[w, 3] - ay
        per_length = 1.0 / max(dx * dx + dy * dy, TINY)
        outside, slope = (reach[w] + spread) ** 2, reach[w] * fall
        low_x, high_x, low_y, high_y = min(0.0, dx) + ax, max(0.0, dx) + ax, min(0.0, dy) + ay, max(0.0, dy) + ay
        for t in range(x.shape[0]):
            if _apart_squared(bounds[t], low_x, high_x, low_y, high_y) >= outside:
                continue
            xt, yt = x[t], y[t]
            for k in range(xt.size):  # all rollouts at once, as few are near
                px, py = xt[k] - ax, yt[k] - ay
                along = min(max((px * dx + py * dy) * per_length, 0.0), 1.0)
                apart[k] = (px - along * dx) ** 2 + (py - along * dy) ** 2
            for k in range(xt.size):
                if apart[k] >= outside:
                    continue
                px, py = xt[k] - ax, yt[k] - ay
                for s in range(ex.size):
                    qx, qy = px + ex[s], py + ey[s]
                    u = min(max((qx * dx + qy * dy) * per_length, 0.0), 1.0)
                    distance = np.sqrt((qx - u * dx) ** 2 + (qy - u * dy) ** 2)
                    h[k, s] = max(h[k, s], discount[t] * min(slope - fall * distance, DEEPEST))


@kernel
def meet_lane(h: Matrix, x: Matrix, y: Matrix, normal: Vector, excess: Vector, margin: float, discount: Vector):
    """Raises `h` by a lane boundary: sample s is beyond it by normal . (x, y) + excess_s."""
    farthest = excess.max() + margin
    for t in range(x.shape[0]):
        for k in range(x.shape[1]):
            along = normal[0] * x[t, k] + normal[1] * y[t, k]
            if along + farthest <= 0.0:
                continue
            for s in range(excess.size):
                h[k, s] = max(h[k, s], discount[t] * min((along + excess[s] + margin) / margin, DEEPEST))
