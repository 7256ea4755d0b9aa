"""The cost surface of one decision as a picture: four panels over (v, omega).

Goal cost, cone and wall terms, lane terms, and their total. Where a term spans more than the eye can tell apart on a
linear scale, its colours follow asinh: linear near its least value, logarithmic far above it. What a method forbids is
hatched. Nothing here touches pyplot, so nothing is shared between figures.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import AsinhNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.ticker import AsinhLocator

from mjnav.control.decision_surface import DecisionSurface
from mjnav.messages import Array

SIZE = (10.0, 8.6)  # [inches]
DPI = 120
COLOURS = "viridis"
NUM_LINES = 9  # contour lines a panel
LARGE_SPAN = 50.0  # of the range over the size of its lowest tenth: beyond it the scale is asinh
LOG_SPAN = 1e9  # of an asinh scale's logarithmic part at most
ZERO_SPAN = 1e3  # the same of a term that is as good as zero in many places
CHOSEN: Mapping[str, Any] = MappingProxyType(
    {"marker": "o", "markersize": 6, "markerfacecolor": "#ff5a36", "markeredgecolor": "white"}
)
NOMINAL: Mapping[str, Any] = MappingProxyType(
    {"marker": "D", "markersize": 12, "markerfacecolor": "none", "markeredgecolor": "white", "markeredgewidth": 2}
)
FORBIDDEN: Mapping[str, Any] = MappingProxyType({"facecolor": "#cfcfcf", "hatch": "////", "edgecolor": "#9a9a9a"})


def decision_surface_figure(surface: DecisionSurface, title: str) -> Figure:
    """The picture; axes 0 to 3 are goal, cone, lane, total, and `title` stands above them."""
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
    for axes, (name, values) in zip(figure.subplots(2, 2, sharex=True, sharey=True).flat, panels, strict=True):
        axes.set_title(name, fontsize=11)
        _draw(figure, axes, s, values)
        _mark(axes, s)
    _label(figure, forbids=bool(np.isinf(s.total).any()))
    return figure


def _draw(figure: Figure, axes: Axes, s: DecisionSurface, values: Array) -> None:
    """The values (V, W) as colours and contour lines, with their scale."""
    axes.patch.set(**FORBIDDEN)
    finite = np.isfinite(values)
    if not finite.any():
        axes.set(xlim=(s.v[0], s.v[-1]), ylim=(s.omega[0], s.omega[-1]))
        return
    shown = np.ma.masked_where(~finite, values).T
    norm = _norm(values[finite])
    mesh = axes.pcolormesh(s.v, s.omega, shown, shading="nearest", cmap=COLOURS, norm=norm, rasterized=True)
    if norm.vmin == norm.vmax:
        if norm.vmax == 0.0:
            axes.text(0.5, 0.25, "zero everywhere", transform=axes.transAxes, ha="center", color="white", fontsize=10)
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


def _mark(axes: Axes, s: DecisionSurface) -> None:
    """The controls and the window, above everything else."""
    low, high = s.reachable
    axes.add_patch(_window(low, high - low))
    under = {**NOMINAL, "markeredgecolor": "#00000099", "markeredgewidth": 4}  # by which white shows on grey as well
    for place, style in ((s.nominal, under), (s.nominal, NOMINAL), ((s.decision.v, s.decision.omega), CHOSEN)):
        axes.plot(*place, linestyle="none", clip_on=False, **style)


def _window(corner: Array, size: Array, label: str = "") -> Rectangle:
    edge = withStroke(linewidth=3.0, foreground="#00000099")
    return Rectangle(
        (corner[0], corner[1]), size[0], size[1],
        fill=False, edgecolor="white", linestyle="--", linewidth=1.4, label=label, path_effects=[edge],
    )  # fmt: skip


def _label(figure: Figure, *, forbids: bool) -> None:
    """The axes' labels and the legend; the colour bars' axes follow the panels'."""
    for axes in figure.axes[2:4]:
        axes.set_xlabel("speed v [m/s]")
    for axes in figure.axes[0:4:2]:
        axes.set_ylabel("turn rate ω [rad/s], left is positive")
    handles: list[Artist] = [
        Line2D([], [], linestyle="none", label="chosen", **CHOSEN),
        Line2D([], [], linestyle="none", label="nominal", **NOMINAL),
        _window(np.zeros(2), np.zeros(2), "reachable in one period"),
    ]
    if forbids:
        handles.append(Patch(label="forbidden", **FORBIDDEN))
    figure.legend(
        handles=handles, loc="outside lower center", ncols=4, facecolor="#3b528b", framealpha=1.0, labelcolor="white"
    )
