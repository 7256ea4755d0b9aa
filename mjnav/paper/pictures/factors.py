"""Cone form x preview x prediction of the delay, for a method that matches distributions and for two that do not."""

from types import MappingProxyType

from matplotlib.figure import Figure

from mjnav.paper.contrast import Cells
from mjnav.paper.factors import METHODS
from mjnav.paper.pictures.bars import bars

FIGURES = MappingProxyType(
    {
        "collision": "collision rate",
        "control_cost": "control cost [m²/s³]",
        "mean_deviation_m": "deviation [m]",
        "min_clearance_m": "least clearance [m]",
    }
)


def figure(cells: Cells) -> Figure:
    """A panel for each combination of levels."""
    return bars(cells, METHODS, FIGURES)
