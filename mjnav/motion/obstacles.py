"""Distance and direction from a point to the discs and boxes of a floor plan."""

import numpy as np

from mjnav.geometry.compiled import exact


@exact
def from_disc(x, y, disc):
    """(distance [m], n_x, n_y) from the surface of a disc (x, y, radius); negative inside, n points outwards."""
    dx, dy = x - disc[0], y - disc[1]
    distance = np.sqrt(dx * dx + dy * dy)
    if distance == 0.0:
        return -disc[2], 1.0, 0.0
    return distance - disc[2], dx / distance, dy / distance


@exact
def from_box(x, y, box):
    """(distance [m], n_x, n_y) from the surface of a box; negative inside, n points outwards, by the shortest way.

    A box is centre x, y; unit vector along, x, y; half length, half thickness [m].
    """
    dx, dy = x - box[0], y - box[1]
    along, across = dx * box[2] + dy * box[3], dy * box[2] - dx * box[3]
    side, flank = (1.0 if along >= 0.0 else -1.0), (1.0 if across >= 0.0 else -1.0)
    beyond, beside = side * along - box[4], flank * across - box[5]
    if beyond > 0.0 and beside > 0.0:
        distance = np.sqrt(beyond * beyond + beside * beside)
        u, v = side * beyond / distance, flank * beside / distance
    elif beyond > beside:
        distance, u, v = beyond, side, 0.0
    else:
        distance, u, v = beside, 0.0, flank
    return distance, u * box[2] - v * box[3], u * box[3] + v * box[2]
