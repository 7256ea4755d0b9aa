"""How the paper's figures look: width in print, fonts, and colours that all readers can tell apart.

Colours are Okabe and Ito's, and Tol's "muted" where those run out; lines differ in dashes or markers as well.
"""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from types import MappingProxyType
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure

TWO_COLUMNS = 7.16  # [inches] of print
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
UNSAFE = VERMILION
SEQUENTIAL = "cividis"  # of surfaces
# The degree of the kernel: one hue, darker as it grows; another where the mean's term weighs as much as of degree 1.
DEGREES: Mapping[int, str] = MappingProxyType({1: "#7fbfe6", 2: "#2b8cc4", 3: "#08416b"})
MATCHED: Mapping[int, str] = MappingProxyType({2: "#e6b07f", 3: "#a85a10"})
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
        "mppi-plus": "#6b4a2b",
        "rkhs-plan": "#aa4499",
        "saa": "#882255",
        "cvar": "#332288",
        "orca": "#999933",
        "dwa": "#ddcc77",
    }
)


@contextmanager
def style() -> Iterator[None]:
    """Applies the style while a figure is made, and while it is saved; restores the settings afterwards."""
    with matplotlib.rc_context(dict(_RC)):
        yield


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of this size [inches], without pyplot's shared state. To be called within `style`."""
    return Figure(figsize=(width, height), dpi=DPI, layout="constrained")


def letter(axes: Axes, which: str, title: str) -> None:
    """A panel's letter and title, above its left end."""
    axes.set_title(title, loc="left", x=0.0)
    axes.annotate(
        which, (0.0, 1.0), xytext=(-4.0, 4.0), xycoords="axes fraction", textcoords="offset points",
        ha="right", va="bottom", fontweight="bold",
    )  # fmt: skip


def color(label: str) -> str:
    """The colour of a method's label: of its degree, else of the method."""
    for degree, shade in (MATCHED if "matched" in label else DEGREES).items():
        if f"d={degree}" in label:
            return shade
    return next((shade for name, shade in METHODS.items() if label.startswith(name)), INK)


def legend(figure: Figure, panels: Iterable[Axes], *, ncols: int) -> None:
    """One legend for all panels, below them."""
    found = {label: handle for axes in panels for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    figure.legend(found.values(), found.keys(), loc="outside lower center", ncols=ncols)
