"""One, two and three obstacles: rkhs with d = 3 against the linearised Gaussian."""

from types import MappingProxyType

from matplotlib.figure import Figure

from mjnav.paper.contrast import Cells, each
from mjnav.paper.many import SCENES
from mjnav.paper.pictures.bars import bars

METHODS = ("rkhs d=3", "gaussian-linearised")
FIGURES = MappingProxyType(
    {
        "control_cost": "control cost [m²/s³]",
        "mean_deviation_m": "deviation [m]",
        "time_to_avoid_s": "time to avoid [s]",
        "collision": "collision rate",
    }
)


def figure(cells: Cells) -> Figure:
    """A panel for every number of obstacles and setting."""
    return bars(each(cells, lambda cell: cell.scene in SCENES), METHODS, FIGURES)
