"""Distances of points from segments."""

import numpy as np
from numpy.typing import ArrayLike

from mjnav.messages import Array


def segment_distance(points: ArrayLike, start: ArrayLike, end: ArrayLike) -> Array:
    """Least distance of each point from the segment start-end [m]; the last axis of all is 2, the others broadcast."""
    points, start, end = (np.asarray(a, float) for a in (points, start, end))
    along = end - start
    length_squared = np.maximum((along * along).sum(-1), np.finfo(float).tiny)
    t = np.clip(((points - start) * along).sum(-1) / length_squared, 0.0, 1.0)
    return np.linalg.norm(points - start - t[..., None] * along, axis=-1)
