"""Controls that lead a robot on simple ways, from which a planner's rollouts start.

`lead` makes two moves and then drives the way to the goal, `approach` drives straight there.
"""

import numpy as np

from mjnav.compile.compiled import Matrix, Vector, kernel, scalar
from mjnav.control.parameters import GoalParameters
from mjnav.control.rollouts import ControlLimits, chord
from mjnav.geometry.angles import shortest_turn
from mjnav.geometry.way_field import WayGrid, way_lookup
from mjnav.messages import Array

turn_by = scalar(shortest_turn)


@kernel
def lead(
    out_v: Matrix,
    out_omega: Matrix,
    out_x: Matrix,
    out_y: Matrix,
    out_heading: Matrix,
    moves: Matrix,
    pose: Vector,
    way: WayGrid,
    first: Matrix,
    bounds: Matrix,
    change: Vector,
    speed: float,
    approach_time: float,
    preview: float,
    step: float,
):
    """Controls (T, K) of `moves` (K, 6), and then of the way to the goal; and the poses, from the start, at their ends.

    Each row is two moves, one behind the other: v [m/s], omega [rad/s], and until when [s]. On the way the robot turns
    to where it leads within `preview`, drives at `speed` [m/s] and at most way left / `approach_time`, and slower while
    it faces another way. first and bounds (2, 2): lowest and highest (v, omega), of the first control and of all;
    `change` (2,) is the most from one to the next. `pose` (3,) is in the world, as `way` is.
    """
    num = moves.shape[0]
    same = np.ones(num, np.bool_)  # as the rollout before up to now: it is copied
    for t in range(out_v.shape[0]):  # step by step: rollouts do not wait for one another, steps do
        time = t * step + 1e-9
        before = (False, np.nan, np.nan)
        for k in range(num):
            move = 0 if time < moves[k, 2] else 3
            on_way = move > 0 and time >= moves[k, 5]
            wanted_v, wanted_omega = (0.0, 0.0) if on_way else (moves[k, move], moves[k, move + 1])
            wanted = (on_way, wanted_v, wanted_omega)
            same[k] &= wanted == before
            before = wanted
            if same[k]:
                out_v[t, k], out_omega[t, k] = out_v[t, k - 1], out_omega[t, k - 1]
                out_x[t, k], out_y[t, k], out_heading[t, k] = out_x[t, k - 1], out_y[t, k - 1], out_heading[t, k - 1]
                continue
            x, y, heading = (out_x[t - 1, k], out_y[t - 1, k], out_heading[t - 1, k]) if t > 0 else (0.0, 0.0, pose[2])
            if on_way:
                left, by_x, by_y = way_lookup(way, pose[0] + x, pose[1] + y)
                turn = turn_by(np.arctan2(-by_y, -by_x) - heading) if left > 0.0 else 0.0
                wanted_v, wanted_omega = min(speed, left / approach_time) * max(np.cos(turn), 0.0), turn / preview
            low_v, high_v, low_omega, high_omega = first[0, 0], first[1, 0], first[0, 1], first[1, 1]
            if t > 0:
                v, omega = out_v[t - 1, k], out_omega[t - 1, k]
                low_v, high_v = max(bounds[0, 0], v - change[0]), min(bounds[1, 0], v + change[0])
                low_omega, high_omega = max(bounds[0, 1], omega - change[1]), min(bounds[1, 1], omega + change[1])
            v = min(max(wanted_v, low_v), high_v)
            omega = min(max(wanted_omega, low_omega), high_omega)
            out_v[t, k], out_omega[t, k] = v, omega
            half = 0.5 * step * omega
            length = chord(v, half, step)
            out_x[t, k] = x + length * np.cos(heading + half)
            out_y[t, k] = y + length * np.sin(heading + half)
            out_heading[t, k] = heading + 2.0 * half


@kernel
def ways_left(left: Matrix, by_x: Matrix, by_y: Matrix, x: Matrix, y: Matrix, at: Vector, way: WayGrid):
    """The way left [m] from points `at` + (x, y), (T, K), and its derivatives, into matrices of that shape."""
    for t in range(x.shape[0]):
        for k in range(x.shape[1]):
            if k > 0 and x[t, k] == x[t, k - 1] and y[t, k] == y[t, k - 1]:
                left[t, k], by_x[t, k], by_y[t, k] = left[t, k - 1], by_x[t, k - 1], by_y[t, k - 1]
            else:
                left[t, k], by_x[t, k], by_y[t, k] = way_lookup(way, at[0] + x[t, k], at[1] + y[t, k])


@kernel
def _approach(
    out: Matrix,
    heading: float,
    goal_x: float,
    goal_y: float,
    first: Matrix,
    bounds: Matrix,
    change: Vector,
    speed: float,
    approach_time: float,
    preview: float,
    step: float,
):
    """Controls (2, T) that turn to the goal and drive there, from the origin at `heading`.

    first and bounds (2, 2): lowest and highest (v, omega), of the first control and of all; `change` (2,) is the most
    from one to the next.
    """
    x, y = 0.0, 0.0
    for t in range(out.shape[1]):
        dx, dy = goal_x - x, goal_y - y
        distance = np.sqrt(dx * dx + dy * dy)
        turn = turn_by(np.arctan2(dy, dx) - heading) if distance > 0.0 else 0.0
        out[0, t] = min(speed, distance / approach_time) * max(np.cos(turn), 0.0)
        out[1, t] = turn / preview
        for c in range(2):
            low, high = first[0, c], first[1, c]
            if t > 0:
                before = out[c, t - 1]
                low, high = max(bounds[0, c], before - change[c]), min(bounds[1, c], before + change[c])
            out[c, t] = min(max(out[c, t], low), high)
        half = 0.5 * step * out[1, t]
        length = chord(out[0, t], half, step)
        x += length * np.cos(heading + half)
        y += length * np.sin(heading + half)
        heading += 2.0 * half


def approach(
    goal: Array, heading: float, limits: ControlLimits, speed: float, step: float, num: int, parameters: GoalParameters
) -> Array:
    """`num` controls (2, T) within the limits, straight to `goal` (2,), which is relative to the robot.

    The robot turns to the goal within the preview, and drives as fast as the goal cost wants it to, `speed` [m/s] far
    from the goal, slower while it faces another way.
    """
    out = np.empty((2, num))
    _approach(
        out, heading, goal[0], goal[1], limits.first, limits.all, limits.change, speed, parameters.approach_time,
        parameters.preview, step,
    )  # fmt: skip
    return out
