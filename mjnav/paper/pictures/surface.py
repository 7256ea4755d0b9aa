"""The cost over (v, omega) with its kinks, and where a gradient method and the sampled grid end on it.

a-d   the cost of one decision: tuned with d = 1, 2, 3, and as published
e     the slope along omega, with the places where pairs of samples meet the clip
f     its largest jump from one step to the next: it falls with the step where the cost is smooth
g, h  how often SLSQP ends above or below the grid;  i  the time that each takes
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import AsinhNorm
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from mjnav.messages import Array
from mjnav.paper.continuous_cost import VARIANTS
from mjnav.paper.cost_view import STEPS, View
from mjnav.paper.pictures import style
from mjnav.paper.surface import NEAR, STARTS, SurfaceData

HEIGHT = 6.0  # [inches]
COLOURS = (*style.DEGREES.values(), style.ORANGE)
CUT = 2  # the variant whose slope is drawn: d = 3
ENDS: Mapping[str, Any] = MappingProxyType(
    {"marker": "o", "markersize": 3.0, "markerfacecolor": style.SKY, "markeredgecolor": "black", "markeredgewidth": 0.4}
)
LEAST: Mapping[str, Any] = MappingProxyType(
    {"marker": "*", "markersize": 10, "markerfacecolor": style.VERMILION, "markeredgecolor": "white"}
)
WORSE, SAME, BETTER = style.VERMILION, style.PALE, style.GREEN


def figure(data: SurfaceData) -> Figure:
    """The picture, two columns wide."""
    with style.style():
        fig = style.new_figure(style.TWO_COLUMNS, HEIGHT)
        rows = fig.subfigures(3, 1, height_ratios=(1.15, 1.0, 1.1), squeeze=False)[:, 0]
        scene, seed, time = data.drawn
        panels = rows[0].subplots(1, len(VARIANTS), sharex=True, sharey=True)
        for axes, which, name, view in zip(panels, "abcd", VARIANTS, data.views, strict=False):
            _draw_surface(rows[0], axes, view)
            style.letter(axes, which, name)
            axes.set_xlabel("speed v [m/s]")
        panels[0].set_ylabel("turn rate ω [rad/s]")
        rows[0].suptitle(f"cost of one decision: {scene}, seed {seed}, {time:.1f} s", fontsize=7.5)
        _surface_legend(rows[0])
        slope, jumps = rows[1].subplots(1, 2, width_ratios=(1.25, 1.0))
        style.letter(slope, "e", f"slope along ω at the chosen v, d = {CUT + 1}")
        _draw_slope(slope, data.views[CUT])
        style.letter(jumps, "f", "largest jump of the slope within a step")
        _draw_jumps(jumps, data.views)
        reachable, bounds, times = rows[2].subplots(1, 3)
        style.letter(reachable, "g", "within one period's reach")
        style.letter(bounds, "h", "between the limits")
        style.letter(times, "i", "time, within one period's reach")
        _draw_shares(reachable, data.against_grid[:, :, 0])
        _draw_shares(bounds, data.against_grid[:, :, 1])
        bounds.tick_params(labelleft=False)
        _draw_times(times, data)
        reachable.set_ylabel("share of decisions")
        against = f"than the grid, from 1, {STARTS[1]} and {STARTS[2]} starts"
        keys = (
            (WORSE, f"SLSQP more than {100 * NEAR:g} % worse"),
            (SAME, "as good"),
            (BETTER, f"as much better {against}"),
        )
        handles = [Patch(facecolor=colour, label=label) for colour, label in keys]
        rows[2].legend(handles=handles, loc="outside lower left", ncols=3)
        return fig


def _draw_surface(fig: SubFigure, axes: Axes, view: View) -> None:
    s = view.surface
    low, high = float(s.total.min()), float(s.total.max())
    norm = AsinhNorm(max(low, 1e-9 * high), low, high)
    mesh = axes.pcolormesh(
        s.v, s.omega, s.total.T, shading="nearest", cmap=style.SEQUENTIAL, norm=norm, rasterized=True
    )
    levels = np.asarray(norm.inverse(np.linspace(0.0, 1.0, 12)))[1:-1]
    axes.contour(s.v, s.omega, s.total.T, levels=levels, colors="white", linewidths=0.35, alpha=0.7)
    corner, end = s.reachable
    size = end - corner
    axes.add_patch(
        Rectangle((corner[0], corner[1]), *size, fill=False, edgecolor="white", linestyle="--", linewidth=0.9)
    )
    i, j = s.minimum or (0, 0)
    axes.plot(s.v[i], s.omega[j], linestyle="none", clip_on=False, **LEAST)
    axes.plot(*view.ends.T, linestyle="none", clip_on=False, **ENDS)
    bar = fig.colorbar(mesh, ax=axes, location="top", shrink=0.9, aspect=25, pad=0.02)
    bar.outline.set_linewidth(0.4)


def _surface_legend(fig: SubFigure) -> None:
    window = Line2D([], [], color=style.GREY, linestyle="--", label="one period's reach")
    handles = [
        Line2D([], [], linestyle="none", label="least cost", **LEAST),
        Line2D([], [], linestyle="none", label="where SLSQP ends from 16 starts", **ENDS),
        window,
    ]
    fig.legend(handles=handles, loc="outside lower center", ncols=3)


def _draw_slope(axes: Axes, view: View) -> None:
    axes.plot(view.slope_omega, view.slope, color=COLOURS[CUT], linewidth=0.8)
    axes.set(xlim=(view.slope_omega[0], view.slope_omega[-1]), xlabel="turn rate ω [rad/s]", ylabel="dcost/dω [s/rad]")
    clips = axes.twinx()
    clips.hist(view.clips, bins=np.linspace(*axes.get_xlim(), 101).tolist(), color=style.ORANGE, alpha=0.45)
    clips.set_ylabel("pairs that meet the clip", color=style.ORANGE)
    clips.spines["right"].set_visible(True)
    clips.set_ylim(0.0, 3.0 * max(1.0, clips.get_ylim()[1]))
    axes.set_zorder(clips.get_zorder() + 1)
    axes.patch.set_visible(False)


def _draw_jumps(axes: Axes, views: tuple[View, ...]) -> None:
    for name, colour, view in zip(VARIANTS, COLOURS, views, strict=False):
        axes.plot(STEPS, view.jumps, marker="o", markersize=2.5, color=colour, label=name)
    axes.plot(STEPS, views[-1].jumps, color=style.DEGREES[3], linestyle=":", label="d = 3, not clipped")
    axes.set(xscale="log", yscale="log", xlabel="step in ω [rad/s]", ylabel="share of the slope's range")
    axes.grid(which="major")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def _draw_shares(axes: Axes, against: Array) -> None:
    """Stacked shares of decisions (D, V, S): a bar for every variant and number of starts."""
    num_starts = against.shape[-1]
    ticks, labels = [], []
    for v in range(against.shape[1]):
        for s in range(num_starts):
            x = v * (num_starts + 1) + s
            bottom = 0.0
            for colour, sign in ((WORSE, 1.0), (SAME, 0.0), (BETTER, -1.0)):
                share = float((against[:, v, s] == sign).mean())
                axes.bar(x, share, width=0.85, bottom=bottom, color=colour)
                bottom += share
            ticks.append(x)
            labels.append(str(STARTS[s]))
        axes.annotate(
            tuple(VARIANTS)[v], (v * (num_starts + 1) + 0.5 * (num_starts - 1), 0.0), xytext=(0.0, -16.0),
            xycoords="data", textcoords="offset points", ha="center", va="top", annotation_clip=False,
        )  # fmt: skip
    axes.set_xticks(ticks, labels)
    axes.set_ylim(0.0, 1.0)


def _draw_times(axes: Axes, data: SurfaceData) -> None:
    """Median and the middle 80 % of times, a group for every way to search."""
    ways = [("grid", data.grid_seconds[:, :, 0])]
    ways += [(f"SLSQP, {num}", data.seconds[:, :, 0, s]) for s, num in enumerate(STARTS)]
    for x, (_, seconds) in enumerate(ways):
        for v, colour in enumerate(COLOURS):
            low, middle, high = 1e3 * np.quantile(seconds[:, v], [0.1, 0.5, 0.9])
            place = x + 0.16 * (v - 1.5)
            axes.vlines(place, low, high, color=colour, linewidth=1.6)
            axes.plot(place, middle, marker="o", color=colour, markersize=3.0)
    axes.set_xticks(range(len(ways)), [name for name, _ in ways])
    axes.set(yscale="log", ylabel="time [ms]")
    axes.grid(axis="y")
