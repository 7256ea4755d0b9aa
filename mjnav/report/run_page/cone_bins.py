"""F and F^des of every tick as histograms over one common axis."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mjnav.messages import Array
from mjnav.report.run_page.packed import LARGEST

NUM_BINS = 36  # at least; one edge is zero, where safe ends
LOWEST = 0.005  # quantile of all samples where the axis begins: a few that are very safe would squeeze all others


@dataclass(frozen=True, slots=True)
class ConeBins:
    """Shares of samples; bin i holds low + i width < f <= low + (i + 1) width, the first also what lies below."""

    low: float
    width: float
    shares: NDArray[np.uint8]  # (T, 2, B) of F and F^des in 255ths, more than none is at least one


def cone_bins(cones: Mapping[int, tuple[Array, Array]], num_frames: int) -> ConeBins | None:
    """The histograms of (samples, desired) by frame; None where no frame has any."""
    every = np.concatenate([part for pair in cones.values() for part in pair]) if cones else np.zeros(0)
    every = every[np.abs(every) <= LARGEST]
    if not every.size:
        return None
    low, high = min(float(np.quantile(every, LOWEST)), -1e-3), max(float(every.max()), 1e-3)
    width = (high - low) / NUM_BINS
    num_safe, num_unsafe = int(np.ceil(-low / width - 1e-9)), int(np.ceil(high / width - 1e-9))
    edges = width * np.arange(-num_safe, num_unsafe + 1)
    shares = np.zeros((num_frames, 2, num_safe + num_unsafe), np.uint8)
    for frame, pair in cones.items():
        for row, part in enumerate(pair):
            if part.size:
                place = np.clip(np.searchsorted(edges, part, side="left") - 1, 0, len(edges) - 2)
                share = np.bincount(place, minlength=len(edges) - 1) / part.size
                shares[frame, row] = np.ceil(255 * share - 0.5 * (share > 1 / 255))
    return ConeBins(-num_safe * width, width, shares)
