"""How the paper's figures look: sizes for one and two columns of print, fonts, and colours for all eyes.

Colours are Okabe and Ito's, and Tol's "muted" where those run out; lines differ in dashes or markers as well.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import MappingProxyType
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure

ONE_COLUMN, TWO_COLUMNS = 3.5, 7.16  # [inches] widths
DPI = 200

_RC: Mapping[Any, Any] = MappingProxyType(
    {
        "font.family": "DejaVu Sans",
        "font.size": 7.0,
        "axes.titlesize": 7.5,
        "axes.labelsize": 7.0,
        "axes.linewidth": 0.6,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.axisbelow": True,
        "axes.titlepad": 4.0,
        "axes.labelpad": 2.0,
        "grid.color": "#e4e4e4",
        "grid.linewidth": 0.5,
        "hatch.linewidth": 0.5,
        "legend.fontsize": 6.5,
        "legend.frameon": False,
        "legend.handlelength": 1.6,
        "lines.linewidth": 1.1,
        "lines.markersize": 3.5,
        "patch.linewidth": 0.6,
        "pdf.fonttype": 42,  # so that text stays text
        "xtick.labelsize": 6.5,
        "ytick.labelsize": 6.5,
        "xtick.major.width": 0.6,
        "ytick.major.width": 0.6,
        "xtick.major.size": 2.5,
        "ytick.major.size": 2.5,
        "xtick.minor.size": 1.5,
        "ytick.minor.size": 1.5,
    }
)

INK, GREY, PALE = "#222222", "#8c8c8c", "#d9d9d9"
BLUE, SKY, GREEN, ORANGE, VERMILION, PURPLE = "#0072b2", "#56b4e9", "#009e73", "#e69f00", "#d55e00", "#cc79a7"
SAFE, UNSAFE = BLUE, VERMILION
SEQUENTIAL = "cividis"  # of surfaces
# The degree of the kernel: one hue, darker as it grows.
DEGREES: Mapping[int, str] = MappingProxyType({1: "#7fbfe6", 2: "#2b8cc4", 3: "#08416b"})
METHODS: Mapping[str, str] = MappingProxyType(
    {
        "rkhs": BLUE,
        "rkhs-paper": SKY,
        "gaussian-linearised": VERMILION,
        "gaussian-moments": ORANGE,
        "kld": GREEN,
        "mmd-dirac": PURPLE,
        "mean": GREY,
        "mppi": "#000000",
        "saa": "#882255",
        "cvar": "#332288",
        "orca": "#999933",
        "dwa": "#ddcc77",
    }
)


@contextmanager
def style() -> Iterator[None]:
    """The style while a figure is made, and while it is saved; what was set before comes back."""
    with matplotlib.rc_context(dict(_RC)):
        yield


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of this size [inches]; nothing of it is shared. To be called within `style`."""
    return Figure(figsize=(width, height), dpi=DPI, layout="constrained")


def letter(axes: Axes, which: str, title: str) -> None:
    """A panel's letter and title, above its left end."""
    axes.set_title(title, loc="left", x=0.0)
    axes.annotate(
        which, (0.0, 1.0), xytext=(-4.0, 4.0), xycoords="axes fraction", textcoords="offset points",
        ha="right", va="bottom", fontweight="bold",
    )  # fmt: skip
