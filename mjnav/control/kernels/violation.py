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
SLACK = 1e-9  # relative, and in m: more than rounding does to what is left out without a look at the samples
LEAST_CELL, MOST_CELLS = 0.25, 64  # [m], and along each axis, of the grid that bodies at rest are listed in


@kernel
def _ends(numbers):
    """The lowest and the highest of (n,): `.min()` and `.max()` compile for a second, and take twice the time."""
    low, high = numbers[0], numbers[0]
    for number in numbers:
        low, high = min(low, number), max(high, number)
    return low, high


@kernel
def meet_discs(
    h: Matrix, x: Matrix, y: Matrix, qx: Cube, qy: Cube, reach: Matrix, per_margin: Matrix, discount: Matrix
):
    """Raises `h` by discs that move: qx, qy (T, B, S) are samples of the discs less those of the robot.

    reach (T, B) is R + m, per_margin (T, B) 1 / m, and discount (T, B) gamma. Rollouts that begin alike follow one
    another: as long as they are in one place, they have one depth.
    """
    num, num_samples = h.shape
    apart, depth = np.empty(num), np.empty(num_samples)
    for t in range(qx.shape[0]):
        xt, yt = x[t], y[t]
        (left, right), (bottom, top) = _ends(xt), _ends(yt)  # the box around all rollouts
        for b in range(qx.shape[1]):
            px, py = qx[t, b], qy[t, b]
            (low_x, high_x), (low_y, high_y) = _ends(px), _ends(py)
            fall, most, outside = per_margin[t, b], discount[t, b], reach[t, b] ** 2 * (1.0 + SLACK)
            slope = reach[t, b] * fall
            dx, dy = max(left - high_x, low_x - right, 0.0), max(bottom - high_y, low_y - top, 0.0)
            if dx * dx + dy * dy >= outside:
                continue
            for k in range(num):  # all at once, as few are near
                dx, dy = max(low_x - xt[k], xt[k] - high_x, 0.0), max(low_y - yt[k], yt[k] - high_y, 0.0)
                apart[k] = dx * dx + dy * dy
            before, count = -1, 0.0
            for k in range(num):
                if apart[k] >= outside:
                    continue
                rx, ry = xt[k], yt[k]
                if before < 0 or rx != xt[before] or ry != yt[before]:
                    before, count = k, 0.0
                    for s in range(num_samples):
                        dx, dy = rx - px[s], ry - py[s]
                        count += 1.0 if dx * dx + dy * dy < outside else 0.0
                    if count > 0.0:
                        for s in range(num_samples):
                            dx, dy = rx - px[s], ry - py[s]
                            depth[s] = most * min(slope - fall * np.sqrt(dx * dx + dy * dy), DEEPEST)
                if count > 0.0:
                    for s in range(num_samples):
                        h[k, s] = max(h[k, s], depth[s])


@kernel
def _listed(x, y, body, far):
    """A grid over all positions: its corner, cells a metre and columns, `start` and `who`.

    Bodies (W, 4) that may be nearer than `far` (W,) [m] to a place in cell c are `who` from start[c] to start[c + 1].
    """
    (left, right), (bottom, top) = _ends(x.ravel()), _ends(y.ravel())
    per_cell = 1.0 / max(LEAST_CELL, max(right - left, top - bottom) / MOST_CELLS)
    columns, rows = int((right - left) * per_cell) + 2, int((top - bottom) * per_cell) + 2
    start, who = np.zeros(rows * columns + 2, np.int64), np.empty(0, np.int64)
    for filling in (False, True):
        for w in range(body.shape[0]):
            first = int((min(body[w, 0], body[w, 2]) - far[w] - left) * per_cell)
            last = int((max(body[w, 0], body[w, 2]) + far[w] - left) * per_cell)
            low = int((min(body[w, 1], body[w, 3]) - far[w] - bottom) * per_cell)
            high = int((max(body[w, 1], body[w, 3]) + far[w] - bottom) * per_cell)
            for row in range(max(low, 0), min(high + 1, rows)):
                for c in range(row * columns + max(first, 0), row * columns + min(last + 1, columns)):
                    if filling:
                        who[start[c + 1]] = w
                        start[c + 1] += 1
                    else:
                        start[c + 2] += 1
        if not filling:  # start[c + 1] is where cell c begins, until it is filled
            for c in range(start.size - 1):
                start[c + 1] += start[c]
            who = np.empty(start[-1], np.int64)
    return left, bottom, per_cell, columns, start, who


@kernel
def _raise(h, squared, reach, per_margin):
    """Raises `h` (S,) by squared distances (S,), which are forgotten."""
    for s in range(h.size):
        h[s] = max(h[s], min((reach - np.sqrt(squared[s])) * per_margin, DEEPEST))
        squared[s] = np.inf


@kernel
def meet_walls(h: Matrix, x: Matrix, y: Matrix, ex: Vector, ey: Vector, body: Matrix, reach: Vector, margin: float):
    """Raises `h` by bodies at rest: segments ax, ay, bx, by (W, 4), a point where its ends are one, with reach R + m.

    ex, ey (S,) are the robot's samples less their mean, at most `spread` from it. Of all bodies along a rollout one
    comes nearest to the mean; those that stay 2 `spread` farther are farther than it from every sample.
    """
    most, per_margin = 0.0, 1.0 / margin
    for s in range(ex.size):
        most = max(most, ex[s] * ex[s] + ey[s] * ey[s])
    spread = np.sqrt(most)
    dx, dy, per_length, far = np.empty((4, len(body)))
    for w in range(len(body)):
        dx[w], dy[w] = body[w, 2] - body[w, 0], body[w, 3] - body[w, 1]
        per_length[w] = 1.0 / max(dx[w] * dx[w] + dy[w] * dy[w], TINY)
        far[w] = (reach[w] + spread) * (1.0 + SLACK)
    left, bottom, per_cell, columns, start, who = _listed(x, y, body, far)
    num = x.shape[0] * len(body)
    when, which, gap = np.empty(num, np.int64), np.empty(num, np.int64), np.empty(num)
    squared = np.full(ex.size, np.inf)
    for k in range(x.shape[1]):
        count, least = 0, np.inf
        for t in range(x.shape[0]):
            c = int((y[t, k] - bottom) * per_cell) * columns + int((x[t, k] - left) * per_cell)
            for i in range(start[c], start[c + 1]):
                w = who[i]
                px, py = x[t, k] - body[w, 0], y[t, k] - body[w, 1]
                u = min(max((px * dx[w] + py * dy[w]) * per_length[w], 0.0), 1.0)
                apart = (px - u * dx[w]) ** 2 + (py - u * dy[w]) ** 2
                if apart < far[w] * far[w]:
                    when[count], which[count], gap[count] = t, w, np.sqrt(apart) - reach[w]
                    least = min(least, gap[count])
                    count += 1
        before = -1
        for i in range(count):
            w, t = which[i], when[i]
            if gap[i] > least + 2.0 * spread + SLACK:
                continue
            if before >= 0 and reach[before] != reach[w]:
                _raise(h[k], squared, reach[before], per_margin)
            before = w
            px, py = x[t, k] - body[w, 0], y[t, k] - body[w, 1]
            for s in range(ex.size):
                qx, qy = px + ex[s], py + ey[s]
                u = min(max((qx * dx[w] + qy * dy[w]) * per_length[w], 0.0), 1.0)
                squared[s] = min(squared[s], (qx - u * dx[w]) ** 2 + (qy - u * dy[w]) ** 2)
        if before >= 0:
            _raise(h[k], squared, reach[before], per_margin)


@kernel
def meet_lane(h: Matrix, x: Matrix, y: Matrix, normal: Vector, excess: Vector, margin: float):
    """Raises `h` by a lane boundary: sample s is beyond it by normal . (x, y) + excess_s."""
    farthest = _ends(excess)[1] + margin
    for t in range(x.shape[0]):
        for k in range(x.shape[1]):
            along = normal[0] * x[t, k] + normal[1] * y[t, k]
            if along + farthest <= 0.0:
                continue
            for s in range(excess.size):
                h[k, s] = max(h[k, s], min((along + excess[s] + margin) / margin, DEEPEST))


@kernel
def touching(h: Matrix):
    """The share of samples with a violation of 1 or more, of each row of `h` (K, S): (K,)."""
    shares = np.empty(len(h))
    for k in range(len(h)):
        count = 0
        for s in range(h.shape[1]):
            count += h[k, s] >= 1.0
        shares[k] = count / h.shape[1]
    return shares
