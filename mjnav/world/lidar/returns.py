"""From exact ranges to what a lidar returns: footprint and mixed pixels, missing returns, errors, steps, limits.

A beam has a width. Its footprint is sampled by three rays: through the middle and along both edges. Where they meet one
surface, the middle ray's range counts. Where they meet two, at an edge, the light of both returns, and a share of such
beams, the mixed pixels, has a range anywhere between the near and the far surface.

Sources: Tuley, Vandapel and Hebert, Analysis and removal of artifacts in 3-D LADAR data, ICRA 2005, and Photonics
5(2):12, 2018 (mixed pixels); Thrun, Burgard and Fox, Probabilistic Robotics, 2005, section 6.3 (errors and missing
returns of a beam).
"""

import numpy as np

from mjnav.geometry.compiled import exact
from mjnav.geometry.kernel_types import Matrix
from mjnav.messages import Array
from mjnav.noise import Distribution
from mjnav.rng import stream
from mjnav.scenarios.lidar import Lidar

EDGE = 0.05  # [m] that the middle ray departs from the line through the others' points: two surfaces, no flat one


class Returns:
    """What a lidar returns, and its draws: as many from every stream for each scan, whatever there is to see."""

    def __init__(self, lidar: Lidar, noise: Distribution, seed: int):
        self._lidar, self._noise = lidar, noise
        self._errors = stream(seed, "lidar.range")
        is_wide = lidar.beam_width > 0.0
        self._mixed = stream(seed, "lidar.mixed") if is_wide else None
        loses = any(share > 0.0 for _, share in lidar.missing_rows)
        self._missing = stream(seed, "lidar.missing") if loses else None
        half = 0.5 * lidar.beam_width
        self._rays = np.array([0.0, half, -half] if is_wide else [0.0])[:, None] + lidar.angles

    @property
    def num_rays(self) -> int:
        """Of each beam."""
        return len(self._rays)

    def rays(self, start: int, stop: int) -> Array:
        """(num_rays, n) [rad] against the mount's heading of the beams from `start` on, the middle ones first."""
        return self._rays[:, start:stop]

    def measure(self, exact_ranges: Array) -> Array:
        """What returns (B,) [m], inf for nothing, of the rays' exact ranges (num_rays, B)."""
        lidar, num_beams = self._lidar, exact_ranges.shape[1]
        ranges = exact_ranges[0]
        if self._mixed is not None:
            ranges = footprint(exact_ranges, lidar.beam_width, lidar.mixed, self._mixed.random((2, num_beams)))
        hits = np.isfinite(ranges) & (ranges >= lidar.min_range)
        if self._missing is not None:
            hits &= self._missing.random(num_beams) >= lidar.missing(ranges)
        measured = ranges + self._draw_errors(ranges)
        if lidar.resolution > 0.0:
            measured = lidar.resolution * np.round(measured / lidar.resolution)
        if lidar.has_own_errors:
            hits &= (measured >= lidar.min_range) & (measured <= lidar.max_range)
        else:
            measured = np.clip(measured, lidar.min_range, lidar.max_range)
        return np.where(hits, measured, np.inf)

    def _draw_errors(self, ranges: Array) -> Array:
        """Of each beam [m]: the lidar's own by range, in the shape of the noise profile's law, or that law's."""
        lidar, noise = self._lidar, self._noise
        draws = noise.sample(self._errors, len(ranges))
        if not lidar.has_own_errors:
            return draws
        shape = (draws - noise.mean) / noise.std if noise.std > 0.0 else np.zeros(len(ranges))
        return lidar.bias(ranges, noise) + lidar.std(ranges, noise) * shape


@exact
def footprint(rays: Matrix, width: float, mixed: float, draws: Matrix):
    """The range of each beam, (B,) [m], from its middle ray and the two at its edges, rays (3, B).

    With ranges m, l, r and h half the width, three points lie on a line where 2 cos(h)/m = 1/l + 1/r. Where m departs
    from that by more than EDGE, there are two surfaces. Then, where draws[0] < mixed, the range is
    near + draws[1] (far - near). A beam whose middle meets nothing returns from what its edges meet.
    """
    ranges = rays[0].copy()
    for i in range(len(ranges)):
        middle, left, right = rays[0, i], rays[1, i], rays[2, i]
        near, far = min(middle, left, right), max(middle, left, right)
        if not np.isfinite(middle):
            ranges[i] = near
        elif np.isfinite(far) and far - near > EDGE and near > 0.0:
            on_line = 2.0 * np.cos(0.5 * width) / (1.0 / left + 1.0 / right)
            if abs(middle - on_line) > EDGE and draws[0, i] < mixed:
                ranges[i] = near + draws[1, i] * (far - near)
    return ranges
