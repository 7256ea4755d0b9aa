"""Cone form x preview x prediction of the delay, for a method that matches distributions and for two that do not."""

from types import MappingProxyType

from matplotlib.figure import Figure

from mjnav.report.paper.bars import bars
from mjnav.study.paper.contrast import Cells
from mjnav.study.paper.factors import METHODS

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
