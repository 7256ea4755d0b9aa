"""Pictures: the cost of a decision over (v, omega), and fitted laws.

Nothing here touches pyplot, so nothing is shared between figures.
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import AsinhNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.ticker import AsinhLocator

from mjnav.control.decision_surface import DecisionSurface
from mjnav.messages import Array
from mjnav.noise.correlated import DistributionFunction
from mjnav.noise.fit import Fit

DPI = 120
EDGE = withStroke(linewidth=4.0, foreground="#00000099")  # by which white shows on grey as well

# -------------------------------------------------------------------------------------- a cost surface

SIZE = (10.0, 8.6)  # [inches]
NUM_LINES = 9  # contour lines a panel
LARGE_SPAN = 50.0  # of the range over the size of its lowest tenth: beyond it the scale is asinh
LOG_SPAN = 1e9  # of an asinh scale's logarithmic part at most
ZERO_SPAN = 1e3  # the same of a term that is as good as zero in many places
Style = Mapping[str, Any]
CHOSEN: Style = MappingProxyType(
    {"marker": "o", "markersize": 6, "markerfacecolor": "#ff5a36", "markeredgecolor": "white", "linestyle": "none"}
)
NOMINAL: Style = MappingProxyType(
    {"marker": "D", "markersize": 12, "markerfacecolor": "none", "markeredgecolor": "white", "markeredgewidth": 2}
    | {"linestyle": "none", "path_effects": [EDGE]}
)
WINDOW: Style = MappingProxyType({"fill": False, "edgecolor": "white", "linestyle": "--", "path_effects": [EDGE]})
FORBIDDEN: Style = MappingProxyType({"facecolor": "#cfcfcf", "hatch": "////", "edgecolor": "#9a9a9a"})


def decision_surface_figure(surface: DecisionSurface, title: str) -> Figure:
    """Four panels over (v, omega): goal cost, cone and wall terms, lane terms, and their total; `title` is above them.

    Where a term spans more than the eye can tell apart on a linear scale, its colours follow asinh: linear near its
    least value, logarithmic far above it. What a method forbids is hatched.
    """
    s = surface
    figure = Figure(figsize=SIZE, dpi=DPI, layout="constrained")
    figure.suptitle(title, fontsize=13)
    kind = "weighted risk" if s.weighted else "greatest risk"
    panels = (
        ("goal cost", s.goal),
        (f"obstacles and walls: {kind}", s.cone_term),
        (f"lanes: {kind}", s.lane_term),
        ("total cost", s.total),
    )
    grid = figure.subplots(2, 2, sharex=True, sharey=True)
    for axes, (name, values) in zip(grid.flat, panels, strict=True):
        axes.set_title(name, fontsize=11)
        axes.patch.set(**FORBIDDEN)
        if np.isfinite(values).any():
            _draw_values(figure, axes, s, values)
        else:
            axes.set(xlim=(s.v[0], s.v[-1]), ylim=(s.omega[0], s.omega[-1]))
        axes.add_patch(Rectangle(s.reachable[0], *(s.reachable[1] - s.reachable[0]), **WINDOW))
        axes.plot(*s.nominal, clip_on=False, **NOMINAL)
        axes.plot(s.decision.v, s.decision.omega, clip_on=False, **CHOSEN)
    for axes in grid[1]:
        axes.set_xlabel("speed v [m/s]")
    for axes in grid[:, 0]:
        axes.set_ylabel("turn rate ω [rad/s], left is positive")
    handles = [
        Line2D([], [], label="chosen", **CHOSEN),
        Line2D([], [], label="nominal", **NOMINAL),
        Patch(label="reachable in one period", **WINDOW),
        *([Patch(label="forbidden", **FORBIDDEN)] if np.isinf(s.total).any() else ()),
    ]
    figure.legend(
        handles=handles, loc="outside lower center", ncols=4, facecolor="#3b528b", framealpha=1.0, labelcolor="white"
    )
    return figure


def _draw_values(figure: Figure, axes: Axes, s: DecisionSurface, values: Array) -> None:
    """The values (V, W) as colours and contour lines, with their scale."""
    finite = np.isfinite(values)
    shown, norm = np.ma.masked_where(~finite, values).T, _norm(values[finite])
    mesh = axes.pcolormesh(s.v, s.omega, shown, shading="nearest", norm=norm, rasterized=True)
    if norm.vmin == norm.vmax:
        return
    levels = np.asarray(norm.inverse(np.linspace(0.0, 1.0, NUM_LINES + 2)))
    axes.contour(s.v, s.omega, shown, levels=levels[1:-1], colors="black", linewidths=0.5, alpha=0.5)
    ticks = AsinhLocator(norm.linear_width, numticks=7) if isinstance(norm, AsinhNorm) else None
    figure.colorbar(mesh, ax=axes, pad=0.02, ticks=ticks)


def _norm(values: Array) -> Normalize:
    """The colour scale of finite values (n,)."""
    least, low, high = np.quantile(values, [0.0, 0.1, 1.0])
    if high - least <= LARGE_SPAN * max(abs(low), low - least):
        return Normalize(least, high)
    width = abs(low) if abs(low) >= abs(high) / LOG_SPAN else abs(high) / ZERO_SPAN
    return AsinhNorm(width, least, high)


# ---------------------------------------------------------------------------------------- fitted laws


MOST = 1000  # points of a curve


def quantile_figure(errors: Array, found: Sequence[Fit], column: str) -> Figure:
    """A curve of each law; on the diagonal the law has the quantiles of the errors (n,)."""
    figure = Figure(figsize=(5.0, 5.0), dpi=120, layout="constrained")
    axes = figure.subplots()
    shares = (np.arange(min(len(errors), MOST)) + 0.5) / min(len(errors), MOST)
    measured = np.quantile(errors, shares)
    for fit in found:
        label = f"{fit.name}, largest |F_n - F| {fit.distance:.3f}"
        axes.plot(DistributionFunction.of(fit.law).quantile(shares), measured, ".", markersize=3, label=label)
    ends = measured[[0, -1]]
    axes.plot(ends, ends, color="black", linewidth=0.8)
    axes.set(xlabel="quantiles of the law", ylabel=f"quantiles of the errors, {column}", title=f"{len(errors)} errors")
    axes.legend()
    return figure
