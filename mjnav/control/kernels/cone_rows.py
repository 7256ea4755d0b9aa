"""f of one pair of samples at all controls, or of one sample at one control against all of the robot's: compiled loops.

The innermost loop runs over the controls: a pair of samples is then a handful of constants, and even an obstacle with
one sample fills the vector units. For discs, lengths come multiplied by sqrt(unit) and, in the segment form, times
divided by the horizon, so that the innermost loop needs neither.
"""

import numpy as np

from mjnav.constraints.collision_cone import LINE, RAY, SEGMENT, cone_line, cone_ray, cone_segment
from mjnav.constraints.wall import wall_segment
from mjnav.control.kernels.cone_blocks import Controls, RobotSamples
from mjnav.geometry.compiled import kernel, scalar


@scalar
def units(b, blocks, rule):
    """What the lengths and the velocities of block b are multiplied by."""
    if b >= blocks.num_discs:
        return 1.0, 1.0
    length = np.sqrt(blocks.unit[b])
    return length, length * rule.horizon if rule.form == SEGMENT else length


@kernel
def _disc_row(f, total, vx, vy, x, y, ovx, ovy, radius_squared, form, floor):
    """f of one pair at all controls into `f` (K,), and added to `total`; vx, vy (K,): its robot sample's velocity."""
    if form == LINE:
        for k in range(f.size):
            f[k] = max(cone_line(x, y, vx[k] - ovx, vy[k] - ovy, radius_squared, 1.0), floor)
            total[k] += f[k]
    elif form == RAY:
        for k in range(f.size):
            f[k] = max(cone_ray(x, y, vx[k] - ovx, vy[k] - ovy, radius_squared, 1.0), floor)
            total[k] += f[k]
    else:
        for k in range(f.size):
            f[k] = max(cone_segment(x, y, vx[k] - ovx, vy[k] - ovy, radius_squared, 1.0), floor)
            total[k] += f[k]


@kernel
def _wall_row(f, total, vx, vy, x, y, ax, ay, bx, by, radius_squared, unit, horizon, floor):
    """f of one position and one wall at all controls into `f` (K,), and added to `total`."""
    for k in range(f.size):
        f[k] = max(unit * wall_segment(x, y, vx[k], vy[k], ax, ay, bx, by, radius_squared, horizon), floor)
        total[k] += f[k]


@scalar
def fill_row(f, total, vx, vy, x, y, m, b, length, speed, blocks, rule, floor):
    """f of a robot sample at (x, y) and sample m, which is in block b, at all controls into `f`; added to `total`."""
    if b < blocks.num_discs:
        _disc_row(
            f, total, vx, vy,
            length * (x - blocks.position[m, 0]), length * (y - blocks.position[m, 1]),
            speed * blocks.velocity[m, 0], speed * blocks.velocity[m, 1],
            blocks.unit[b] * blocks.radius_squared[b], rule.form, floor,
        )  # fmt: skip
    else:
        _wall_row(
            f, total, vx, vy, x, y, blocks.wall[b, 0], blocks.wall[b, 1], blocks.wall[b, 2], blocks.wall[b, 3],
            blocks.radius_squared[b], blocks.unit[b], rule.wall_horizon, floor,
        )  # fmt: skip


@kernel
def velocity_row(vx, vy, v, cos_turn, sin_turn, speed_noise, cos_heading, sin_heading):
    """The velocity of one robot sample at all controls, by the addition theorems."""
    for k in range(v.size):
        speed = v[k] + speed_noise
        vx[k] = speed * (cos_heading * cos_turn[k] - sin_heading * sin_turn[k])
        vy[k] = speed * (sin_heading * cos_turn[k] + cos_heading * sin_turn[k])


@kernel
def _circle(x, y, scale):
    """A circle around all points scale (x, y): centre x, centre y, radius."""
    left = bottom = np.inf
    right = top = -np.inf
    for k in range(x.size):
        left, right = min(left, scale[k] * x[k]), max(right, scale[k] * x[k])
        bottom, top = min(bottom, scale[k] * y[k]), max(top, scale[k] * y[k])
    cx, cy, squared = 0.5 * (left + right), 0.5 * (bottom + top), 0.0
    for k in range(x.size):
        squared = max(squared, (scale[k] * x[k] - cx) ** 2 + (scale[k] * y[k] - cy) ** 2)
    return cx, cy, np.sqrt(squared)


@kernel
def velocity_circles(controls: Controls, robot: RobotSamples):
    """For each robot sample a circle around its velocities at all controls, (N, 3): centre, radius.

    Turned back by its heading they are v e + dv_i e with e = [cos(omega tau), sin(omega tau)]: the sum of a point in
    the circle around all v e and of dv_i times one in the circle around all e.
    """
    ex, ey, e_radius = _circle(controls.cos_turn, controls.sin_turn, np.ones(controls.v.size))
    vx, vy, v_radius = _circle(controls.cos_turn, controls.sin_turn, controls.v)
    out = np.empty((robot.speed_noise.size, 3))
    for i in range(len(out)):
        dv, c, s = robot.speed_noise[i], robot.cos_heading[i], robot.sin_heading[i]
        x, y = vx + dv * ex, vy + dv * ey
        out[i, 0], out[i, 1], out[i, 2] = c * x - s * y, s * x + c * y, v_radius + abs(dv) * e_radius
    return out


@kernel
def reach_of(radius_squared, floor):
    """The distance beyond which f is cut off at the floor."""
    return (1.0 + 1e-9) * np.sqrt(radius_squared - floor)


@kernel
def mark_near(near, circle, x, y, position, velocity, length, speed, reach):
    """Which samples of a disc, (M,) each, come within `reach` of a robot sample for some velocity in its circle.

    |r + t (q + e)| >= |r + t q| - |e| for t from 0 to 1, the horizon. The others' f is the floor, exactly. Returns
    how many are near.
    """
    num_near = 0
    for m in range(near.size):
        squared = -cone_segment(
            length * (x - position[m, 0]), length * (y - position[m, 1]),
            speed * (circle[0] - velocity[m, 0]), speed * (circle[1] - velocity[m, 1]), 0.0, 1.0,
        )  # fmt: skip
        near[m] = squared <= (reach + speed * circle[2]) ** 2
        num_near += near[m]
    return num_near


@kernel
def disc_column(f, vx, vy, position, x, y, ovx, ovy, length, radius_squared, form):
    """f of one sample of a disc against all of the robot's at one control into `f` (N,); x, y, position unscaled."""
    if form == LINE:
        for i in range(f.size):
            rx, ry = length * (position[i, 0] - x), length * (position[i, 1] - y)
            f[i] = cone_line(rx, ry, vx[i] - ovx, vy[i] - ovy, radius_squared, 1.0)
    elif form == RAY:
        for i in range(f.size):
            rx, ry = length * (position[i, 0] - x), length * (position[i, 1] - y)
            f[i] = cone_ray(rx, ry, vx[i] - ovx, vy[i] - ovy, radius_squared, 1.0)
    else:
        for i in range(f.size):
            rx, ry = length * (position[i, 0] - x), length * (position[i, 1] - y)
            f[i] = cone_segment(rx, ry, vx[i] - ovx, vy[i] - ovy, radius_squared, 1.0)


@kernel
def wall_column(f, vx, vy, position, ax, ay, bx, by, radius_squared, unit, horizon):
    """f of one wall against all of the robot's samples at one control into `f` (N,)."""
    for i in range(f.size):
        x, y = position[i, 0], position[i, 1]
        f[i] = unit * wall_segment(x, y, vx[i], vy[i], ax, ay, bx, by, radius_squared, horizon)
