"""Controls that lead a robot on simple ways, from which a planner's rollouts start.

`lead` makes two moves and then drives the way to the goal, `approach` drives straight there.
"""

import numpy as np

from mjnav.compile.compiled import Matrix, Vector, kernel, scalar
from mjnav.control.parameters import GoalParameters
from mjnav.control.rollouts import ControlLimits
from mjnav.geometry.angles import shortest_turn
from mjnav.geometry.way_field import WayGrid, way_lookup
from mjnav.messages import Array
from mjnav.motion.unicycle import arc_onward

turn_by = scalar(shortest_turn)


@kernel
def _towards(left, dx, dy, c, s, speed, approach_time, preview):
    """The control that turns from the direction (c, s) to (dx, dy) within `preview`, with a way `left` [m] to go."""
    v, length = min(speed, left / approach_time), np.sqrt(dx * dx + dy * dy)
    if left <= 0.0 or length == 0.0:
        return v, 0.0
    ahead, aside = c * dx + s * dy, c * dy - s * dx
    return v * max(ahead / length, 0.0), turn_by(np.arctan2(aside, ahead)) / preview


@kernel
def lead(
    out_v: Matrix,
    out_omega: Matrix,
    out_x: Matrix,
    out_y: Matrix,
    out_heading: Matrix,
    out_c: Matrix,
    out_s: Matrix,
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

    c and s are the cosine and the sine of the heading.
    Each row is two moves, one behind the other: v [m/s], omega [rad/s], and until when [s]. On the way the robot turns
    to where it leads within `preview`, drives at `speed` [m/s] and at most way left / `approach_time`, and slower while
    it faces another way. first and bounds (2, 2): lowest and highest (v, omega), of the first control and of all;
    `change` (2,) is the most from one to the next. `pose` (3,) is in the world, as `way` is.
    """
    num, (start_c, start_s) = moves.shape[0], (np.cos(pose[2]), np.sin(pose[2]))
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
                out_c[t, k], out_s[t, k] = out_c[t, k - 1], out_s[t, k - 1]
                continue
            x, y, heading, c, s = 0.0, 0.0, pose[2], start_c, start_s
            if t > 0:
                x, y, heading = out_x[t - 1, k], out_y[t - 1, k], out_heading[t - 1, k]
                c, s = out_c[t - 1, k], out_s[t - 1, k]
            if on_way:
                left, by_x, by_y = way_lookup(way, pose[0] + x, pose[1] + y)
                wanted_v, wanted_omega = _towards(left, -by_x, -by_y, c, s, speed, approach_time, preview)
            low_v, high_v, low_omega, high_omega = first[0, 0], first[1, 0], first[0, 1], first[1, 1]
            if t > 0:
                v, omega = out_v[t - 1, k], out_omega[t - 1, k]
                low_v, high_v = max(bounds[0, 0], v - change[0]), min(bounds[1, 0], v + change[0])
                low_omega, high_omega = max(bounds[0, 1], omega - change[1]), min(bounds[1, 1], omega + change[1])
            v = min(max(wanted_v, low_v), high_v)
            omega = min(max(wanted_omega, low_omega), high_omega)
            out_v[t, k], out_omega[t, k] = v, omega
            half = 0.5 * step * omega
            out_heading[t, k] = heading + 2.0 * half
            out_x[t, k], out_y[t, k], out_c[t, k], out_s[t, k] = arc_onward(x, y, c, s, half, step * v)


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
    x, y, c, s = 0.0, 0.0, np.cos(heading), np.sin(heading)
    for t in range(out.shape[1]):
        dx, dy = goal_x - x, goal_y - y
        out[0, t], out[1, t] = _towards(np.sqrt(dx * dx + dy * dy), dx, dy, c, s, speed, approach_time, preview)
        for i in range(2):
            low, high = first[0, i], first[1, i]
            if t > 0:
                before = out[i, t - 1]
                low, high = max(bounds[0, i], before - change[i]), min(bounds[1, i], before + change[i])
            out[i, t] = min(max(out[i, t], low), high)
        x, y, c, s = arc_onward(x, y, c, s, 0.5 * step * out[1, t], step * out[0, t])


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
