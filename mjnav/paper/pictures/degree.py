"""The degree of the kernel: what is avoided, how far off and at which cost."""

from types import MappingProxyType

from matplotlib.figure import Figure

from mjnav.paper.contrast import Cells
from mjnav.paper.pictures.bars import bars
from mjnav.paper.pictures.lane import COLORS, METHODS

FIGURES = MappingProxyType(
    {
        "mean_safe_share": "safe share of samples",
        "min_clearance_m": "least clearance [m]",
        "mean_deviation_m": "deviation [m]",
        "control_cost": "control cost [m²/s³]",
    }
)


def figure(cells: Cells) -> Figure:
    """Degrees at one weight, and at weights that make the mean's term weigh alike."""
    return bars(cells, METHODS, FIGURES, colors=COLORS)
