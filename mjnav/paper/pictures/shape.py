"""Samples of the right shape, of its mirror image and Gaussian ones: what each method makes of them."""

from types import MappingProxyType

from matplotlib.figure import Figure

from mjnav.paper.contrast import Cells
from mjnav.paper.pictures.bars import bars
from mjnav.paper.shape import METHODS

FIGURES = MappingProxyType(
    {
        "collision": "collision rate",
        "min_clearance_m": "least clearance [m]",
        "control_cost": "control cost [m²/s³]",
        "mean_deviation_m": "deviation [m]",
    }
)


def figure(cells: Cells) -> Figure:
    """A panel for each noise and shape of samples."""
    return bars(cells, METHODS, FIGURES)
