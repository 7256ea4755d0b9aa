"""Social forces: how people accelerate towards where they want to go, and away from one another and from walls.

With p, v the position and velocity of a person, w the velocity that they want, d, e distance and unit vector to
another (from p_i to p_j),

    a_i = (w_i - v_i) / tau  or  k w_i                                                       the way
          + sum_j f_ij                                                                       people, and the robot
          + sum_o or nearest o:  A_o exp(-(d_o - r_o) / B_o) n_o                             walls, tables, pillars
          + lookahead_i,                                                                     those who come towards them

n_o the unit vector away from the nearest point of an obstacle, r_o the person's radius, or 0 where d_o counts from the
centre. Two published forms of f_ij:

`moussaid` (Moussaid, Helbing, Garnier, Johansson, Combe & Theraulaz 2009, "Experimental study of the behavioural
mechanisms underlying self-organization in human crowds"):

    D = lambda (v_i - v_j) + e,   t = D / |D|,   n its left normal,   theta the angle from t to e,   B = gamma |D|,
    f_ij = -A exp(-d / B) [exp(-(n' B theta)^2) t + K exp(-(n B theta)^2) n],   K = sign(theta), here 1 for theta = 0.

`helbing` (Helbing & Molnar 1995, "Social force model for pedestrian dynamics"):

    f_ij = -c grad V(b),   V = V0 exp(-b / sigma),   2 b = sqrt((|r| + |r - Dt v_j|)^2 - (Dt |v_j|)^2),   r = p_i - p_j,

c = 1 where the other is within the field of view of 2 phi about w_i, else 0.5. Obstacles have U0 exp(-d / R), thus
A_o = U0 / R and B_o = R.

The forms were made for people and count distances between centres; whom somebody passes does not push them aside. From
the robot d and r count from surface to surface, and it pushes as an obstacle does, too, whose surface is that of a
personal space s around it. Whoever takes the robot for a thing at rest takes v_j = 0 in f_ij.

The lookahead is that of the crowd simulator libpedsim (Gloor): of all within 20 m who walk against w_i (by more than
2.5 rad) and are seen less than 0.3 rad to the one or the other side, those to the left count -1 and those to the right
1; where the sum is not 0, half a m/s^2 pushes to the side of the fewer.
"""

from math import cos, radians
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from mjnav.compile.compiled import Flags, Indices, Matrix, Vector, exact
from mjnav.geometry.floor import box_surface, disc_surface

LOOKAHEAD_RANGE = 20.0  # [m] (libpedsim)
AGAINST = cos(2.5)  # cosine of the angle to w above which another walks against it (libpedsim)
AHEAD = 0.3  # [rad] to either side (libpedsim)
LOOKAHEAD_PUSH = 0.5  # times |w| / |w| [m/s^2] (libpedsim)
TINY = 1e-9  # [m] of distances that have no direction
MOST_DEPTH = 20.0  # times the range of a push, inside a personal space, behind which it grows no more


class SocialForce(NamedTuple):
    """The constants of one form. What a form does not have is 0."""

    relaxation_time: float  # [s] tau; 0: k w in its place
    drive: float  # k [1/s]
    elliptic: bool  # Helbing's f_ij, else Moussaid's
    strength: float  # A [m/s^2] of Moussaid's, V0 [m^2/s^2] of Helbing's
    velocity_weight: float  # lambda [s/m]
    interaction_range: float  # gamma [m] of Moussaid's, sigma [m] of Helbing's
    turn_sharpness: float  # n [1/m]
    slow_sharpness: float  # n' [1/m]
    step_time: float  # Dt [s]
    view_cosine: float  # cos(phi)
    unseen: float  # c outside the field of view
    cut: float  # [m] of distance beyond which nobody counts
    obstacle_strength: float  # A_o [m/s^2]
    obstacle_range: float  # B_o [m]
    from_surface: bool  # r_o is the person's radius
    nearest_only: bool
    lookahead: float  # its weight
    excess: float  # greatest speed over the desired one
    personal_space: float = 0.0  # s [m]


# `moussaid_2009`: A = 4.5 m/s^2, tau = 0.54 s and walls of 3 exp(-d / 0.1), as Moussaid et al. (2009) fitted them.
# `moussaid`: the weights, walls and push of libpedsim as pedestrian_simulator (TU Delft) runs it in the corridor in
# which T-MPC, safe-horizon MPC and DRA-MPPI were measured; nobody beyond 2 m counts there. The papers' forms have no
# cut: the 5 m, at which two who meet at 1.3 m/s each push by 0.4 m/s^2, are mjnav's, as is the 1.3 of `moussaid_2009`.
FORMS = MappingProxyType(
    {
        "moussaid": SocialForce(
            0.0, 1.0, False, 2.1, 2.0, 0.35, 2.0, 3.0, 0.0, -1.0, 1.0, 2.0, 3.0, 0.8, True, True, 1.0, 1.0
        ),
        "moussaid_2009": SocialForce(
            0.54, 0.0, False, 4.5, 2.0, 0.35, 2.0, 3.0, 0.0, -1.0, 1.0, 5.0, 3.0, 0.1, True, False, 0.0, 1.3
        ),
        "helbing": SocialForce(
            0.5, 0.0, True, 2.1, 0.0, 0.3, 0.0, 0.0, 2.0, cos(radians(100.0)), 0.5, 5.0, 50.0, 0.2, False, False, 0.0,
            1.3,
        ),
    }
)  # fmt: skip


@exact
def _falling(x):
    """exp(-x), 0 where it is below 1e-17: most pairs of a crowd cost no exponential."""
    return np.exp(-x) if x < 40.0 else 0.0


@exact
def _moussaid(dx, dy, d, ux, uy, law):
    """f_ij for the way (dx, dy) of length d to the other and the velocity u = v_i - v_j relative to it."""
    ex, ey = dx / d, dy / d
    x, y = law.velocity_weight * ux + ex, law.velocity_weight * uy + ey
    size = np.sqrt(x * x + y * y)
    if size < TINY:
        return 0.0, 0.0
    tx, ty = x / size, y / size
    theta = np.arctan2(tx * ey - ty * ex, tx * ex + ty * ey)
    reach = law.interaction_range * size
    slow = _falling(d / reach + (law.slow_sharpness * reach * theta) ** 2)
    turn = _falling(d / reach + (law.turn_sharpness * reach * theta) ** 2)
    turn = turn if theta >= 0.0 else -turn
    return -law.strength * (slow * tx - turn * ty), -law.strength * (slow * ty + turn * tx)


@exact
def _helbing(dx, dy, d, vx, vy, wx, wy, law):
    """f_ij for the way (dx, dy) of length d to the other, its velocity v, and the velocity w that this one wants."""
    stepx, stepy = law.step_time * vx, law.step_time * vy
    rx, ry = -dx, -dy
    qx, qy = rx - stepx, ry - stepy
    q = max(np.sqrt(qx * qx + qy * qy), TINY)
    b = 0.5 * np.sqrt(max((d + q) ** 2 - (stepx * stepx + stepy * stepy), TINY * TINY))
    size = law.strength / law.interaction_range * np.exp(-b / law.interaction_range) * (d + q) / (4.0 * b)
    fx, fy = size * (rx / d + qx / q), size * (ry / d + qy / q)
    ahead = -(wx * fx + wy * fy) >= law.view_cosine * np.sqrt((wx * wx + wy * wy) * (fx * fx + fy * fy))
    return (fx, fy) if ahead else (law.unseen * fx, law.unseen * fy)


@exact
def _obstacles(x, y, radius, discs, boxes, law):
    """The repulsion of the nearest obstacle, or of all."""
    ax, ay, nearest = 0.0, 0.0, np.inf
    skin = radius if law.from_surface else 0.0
    for k in range(len(discs) + len(boxes)):
        if k < len(discs):
            distance, nx, ny = disc_surface(x, y, discs[k])
        else:
            distance, nx, ny = box_surface(x, y, boxes[k - len(discs)])
        if law.nearest_only and distance >= nearest:
            continue
        nearest = min(nearest, distance)
        # Deep inside a table the push is that of its edge, a body's width within.
        push = law.obstacle_strength * np.exp(-(max(distance, -radius) - skin) / law.obstacle_range)
        if law.nearest_only:
            ax, ay = push * nx, push * ny
        else:
            ax, ay = ax + push * nx, ay + push * ny
    return ax, ay


@exact
def _lookahead(body, x, y, wx, wy, position, velocity, unseen):
    """Towards the side of the fewer of those who come towards this one."""
    size, balance = np.sqrt(wx * wx + wy * wy), 0
    if size < TINY:
        return 0.0, 0.0
    ex, ey = wx / size, wy / size
    for j in range(len(position)):
        dx, dy = position[j, 0] - x, position[j, 1] - y
        if j in (body, unseen) or not dx * dx + dy * dy <= LOOKAHEAD_RANGE**2:
            continue
        vx, vy = velocity[j, 0], velocity[j, 1]
        if vx * ex + vy * ey < AGAINST * np.sqrt(vx * vx + vy * vy):
            angle = np.arctan2(ex * dy - ey * dx, ex * dx + ey * dy)  # positive to the left
            if 0.0 < abs(angle) < AHEAD:
                balance += -1 if angle > 0.0 else 1
    push = 0.0 if balance == 0 else LOOKAHEAD_PUSH if balance > 0 else -LOOKAHEAD_PUSH
    return -push * ey, push * ex


@exact
def accelerations(
    position: Matrix,
    velocity: Matrix,
    radius: Vector,
    walkers: Indices,
    desired: Matrix,
    own: Matrix,
    sees_robot: Flags,
    at_rest: Flags,
    robot: int,
    discs: Matrix,
    boxes: Matrix,
    law: SocialForce,
):
    """Accelerations (n, 2) [m/s^2] of the n walkers among m bodies: people, and the robot as one more.

    position, velocity (m, 2), radius (m,): bodies at NaN are not there. `walkers` (n,): their places among the bodies;
    `desired` (n, 2): w; `own` (n, 2): v, for a walker's body may lag behind its will. `robot` is the robot's place
    among the bodies, or -1; it is no body for walkers who do not see it (`sees_robot` (n,)), and a thing at rest for
    those who take it so (`at_rest` (n,)). `discs` (k, 3) x, y, radius; `boxes` (l, 6) as in `geometry.floor.Floor`.
    Sums run in the order of the bodies.
    """
    near, out = np.empty(len(position), np.int64), np.zeros((len(walkers), 2))
    for i in range(len(walkers)):
        body = walkers[i]
        x, y, wx, wy, vx, vy = (
            position[body, 0], position[body, 1], desired[i, 0], desired[i, 1], own[i, 0], own[i, 1],
        )  # fmt: skip
        if np.isnan(x):
            continue
        if law.relaxation_time > 0.0:
            ax, ay = (wx - vx) / law.relaxation_time, (wy - vy) / law.relaxation_time
        else:
            ax, ay = law.drive * wx, law.drive * wy
        unseen = -1 if sees_robot[i] else robot
        count = 0
        for j in range(len(position)):
            dx, dy = position[j, 0] - x, position[j, 1] - y
            if dx * dx + dy * dy <= law.cut * law.cut and j not in (body, unseen):
                near[count] = j
                count += 1
        for j in near[:count]:
            dx, dy = position[j, 0] - x, position[j, 1] - y
            d = np.sqrt(dx * dx + dy * dy)
            if d < TINY:  # who stand at one place part in the order of their indices
                dx, dy, d = (TINY if j > body else -TINY), 0.0, TINY
            ux, uy = velocity[j, 0], velocity[j, 1]
            if j == robot:
                gap = max(d - radius[body] - radius[j], TINY)
                depth = max((gap - law.personal_space) / law.obstacle_range, -MOST_DEPTH)
                push = law.obstacle_strength * _falling(depth) / d
                ax, ay = ax - push * dx, ay - push * dy
                dx, dy, d = gap / d * dx, gap / d * dy, gap
                if at_rest[i]:
                    ux, uy = 0.0, 0.0
            if law.elliptic:
                fx, fy = _helbing(dx, dy, d, ux, uy, wx, wy, law)
            else:
                fx, fy = _moussaid(dx, dy, d, vx - ux, vy - uy, law)
            ax, ay = ax + fx, ay + fy
        fx, fy = _obstacles(x, y, radius[body], discs, boxes, law)
        ax, ay = ax + fx, ay + fy
        if law.lookahead > 0.0:
            fx, fy = _lookahead(body, x, y, wx, wy, position, velocity, unseen)
            ax, ay = ax + law.lookahead * fx, ay + law.lookahead * fy
        out[i, 0], out[i, 1] = ax, ay
    return out
