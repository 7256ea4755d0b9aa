"""The lane: distance of the robot's edge from the boundary that it is nearer to, by degree."""

from types import MappingProxyType

from matplotlib.figure import Figure

from mjnav.paper.contrast import Cells
from mjnav.paper.pictures.bars import bars

METHODS = ("d=1", "d=2", "d=3", "d=2 matched", "d=3 matched")
FIGURES = MappingProxyType(
    {
        "mean_lane_clearance_m": "mean distance [m]",
        "min_lane_clearance_m": "least distance [m]",
        "mean_deviation_m": "deviation [m]",
    }
)
COLORS = MappingProxyType(
    {"d=1": "#7fbfe6", "d=2": "#2b8cc4", "d=3": "#08416b", "d=2 matched": "#e6b07f", "d=3 matched": "#a85a10"}
)


def figure(cells: Cells) -> Figure:
    """Degrees at one weight, and at weights that make the mean's term weigh alike."""
    return bars(cells, METHODS, FIGURES, colors=COLORS)
