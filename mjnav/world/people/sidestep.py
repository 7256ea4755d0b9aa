"""How people get past one another when they touch: who walks into another goes round them instead.

A layer over any behaviour, for both engines: bodies do not overlap, and two people who meet head-on would otherwise
push against each other for the rest of the run.
"""

import numpy as np

from mjnav.geometry.compiled import exact
from mjnav.geometry.kernel_types import Flags, Matrix, Vector
from mjnav.messages import Array

TOUCHING = 0.05  # [m] between two people's surfaces below which they touch
AHEAD = 0.3  # cosine of the angle between the way and the other person, above which they are in the way: 73 degrees
SIDEWAYS = 0.6  # share of the speed with which somebody steps to the side, at least


def sidestepped(desired: Array, position: Array, radii: Array, straight: Array) -> Array:
    """Desired velocities (P, 2) [m/s] of people at position (P, 2) [m] with radii (P,) who go round whom they touch.

    With n towards the nearest of those who are touched and in the way (d.n > AHEAD |d|), and t across it, the velocity
    becomes s |d| max(|d.t| / |d|, SIDEWAYS) t, where s is the side of d.t; to the right where d.t = 0. Who walks
    `straight` (P,) does not.
    """
    if len(desired) < 2:
        return desired
    return _sidestepped(np.ascontiguousarray(desired), np.ascontiguousarray(position), radii, straight)


@exact
def _sidestepped(desired: Matrix, position: Matrix, radii: Vector, straight: Flags):
    num_people = len(desired)
    turned = desired.copy()
    for i in range(num_people):
        if straight[i]:
            continue
        speed = np.hypot(desired[i, 0], desired[i, 1])
        nearest = TOUCHING
        for j in range(num_people):
            reach = radii[i] + radii[j] + TOUCHING
            x, y = position[j, 0] - position[i, 0], position[j, 1] - position[i, 1]
            if j == i or not (abs(x) < reach and abs(y) < reach):  # nor with somebody who is not there
                continue
            distance = np.hypot(x, y)
            gap = distance + TOUCHING - reach
            ahead = desired[i, 0] * x + desired[i, 1] * y
            if gap < nearest and ahead > AHEAD * speed * distance:
                nearest = gap
                right = (desired[i, 0] * y - desired[i, 1] * x) / distance  # d.t with t = (y, -x) / distance
                side = 1.0 if right >= 0.0 else -1.0
                share = side * max(abs(right), SIDEWAYS * speed) / distance
                turned[i, 0], turned[i, 1] = share * y, -share * x
    return turned
