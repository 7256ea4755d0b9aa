"""The signed distance to a lane boundary a x + b y + c = 0."""

import numpy as np
from numpy.typing import ArrayLike

from mjnav.errors import InvalidValue
from mjnav.messages import Array


def lane_distance(position: ArrayLike, line: tuple[float, float, float]) -> Array:
    """d = (a x + b y + c) / sqrt(a^2 + b^2) [m] for positions (..., 2): (...). Left: d <= 0 is safe; right: d >= 0.

    Source: Nair et al., arXiv 2112.13034. Raises InvalidValue where a = b = 0, or
    where the last axis of the positions is not 2.
    """
    a, b, c = line
    norm = np.hypot(a, b)
    if not norm > 0.0:
        raise InvalidValue("line", line, "a line (a, b, c) with a or b other than 0")
    position = np.asarray(position, float)
    if position.shape[-1:] != (2,):
        raise InvalidValue("position", position.shape, "an array whose last axis is 2")
    return (a * position[..., 0] + b * position[..., 1] + c) / norm
