"""Matching by MMD against matching fitted mixtures by KL divergence: cost, deviation, time."""

from types import MappingProxyType

from matplotlib.figure import Figure

from mjnav.paper.contrast import Cells, each
from mjnav.paper.pictures.bars import bars

METHODS = ("rkhs d=1", "rkhs d=3", "kld")
FIGURES = MappingProxyType(
    {
        "control_cost": "control cost [m²/s³]",
        "mean_deviation_m": "deviation [m]",
        "compute_ms_control_p50": "decision [ms]",
        "collision": "collision rate",
    }
)


def figure(cells: Cells) -> Figure:
    """With one and with three obstacles."""
    return bars(each(cells, lambda cell: cell.scene in ("crossing1", "crossing3")), METHODS, FIGURES)
