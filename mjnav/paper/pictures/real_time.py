"""How long a decision takes: its distribution at the paper's size, against samples, and against obstacles."""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mjnav.paper.pictures import style
from mjnav.paper.real_time import DEGREES, OBSTACLES, SAMPLES, RealTimeData, Times

HEIGHT = 2.6  # [inches]
P99 = 0.99
CPU: Mapping[str, Any] = MappingProxyType({"linestyle": "-.", "linewidth": 0.8})  # processor time
DODGE = 0.05  # of a size, between the degrees


def figure(data: RealTimeData) -> Figure:
    """The picture, two columns wide."""
    with style.style():
        fig = style.new_figure(style.TWO_COLUMNS, HEIGHT)
        shares, samples, obstacles = fig.subplots(1, 3)
        style.letter(shares, "a", f"{SAMPLES} samples, {OBSTACLES} obstacles")
        _draw_shares(shares, data)
        style.letter(samples, "b", f"{OBSTACLES} obstacles")
        style.letter(obstacles, "c", f"{SAMPLES} samples")
        for degree in DEGREES:
            of_samples = data.of(degree=degree, obstacles=OBSTACLES)
            _draw_growth(samples, of_samples, lambda t: t.samples, degree, "-")
            _draw_growth(samples, data.of(degree=degree, gram=True), lambda t: t.samples, degree, "--")
            _draw_growth(obstacles, data.of(degree=degree, samples=SAMPLES), lambda t: t.obstacles, degree, "-")
        for axes, label in ((samples, "samples N = M"), (obstacles, "obstacles")):
            axes.axhline(1e3 * data.period, color=style.INK, linewidth=0.7, linestyle=":")
            axes.set(xscale="log", yscale="log", xlabel=label, ylabel="time of a decision [ms]")
            axes.minorticks_off()
            axes.grid()
        samples.set_xticks(sorted({t.samples for t in data.times}), minor=False)
        obstacles.set_xticks(sorted({t.obstacles for t in data.times}), minor=False)
        for axes in (samples, obstacles):
            axes.set_xticklabels([f"{tick:g}" for tick in axes.get_xticks()])
        _legend(fig)
        return fig


def _draw_shares(axes: Axes, data: RealTimeData) -> None:
    for degree in DEGREES:
        for times in data.of(degree=degree, samples=SAMPLES, obstacles=OBSTACLES):
            axes.ecdf(1e3 * times.seconds, color=style.DEGREES[degree])
            axes.ecdf(1e3 * times.cpu, color=style.DEGREES[degree], **CPU)
    axes.axhline(P99, color=style.GREY, linewidth=0.5)
    axes.annotate("99 %", (1.0, P99), xycoords=axes.get_yaxis_transform(), ha="right", va="top", color=style.GREY)
    axes.set(xscale="log", xlabel="time of a decision [ms]", ylabel="share of decisions", ylim=(0.0, 1.02))
    axes.grid(which="both", axis="x")


def _draw_growth(axes: Axes, times: Sequence[Times], size: Callable[[Times], int], degree: int, dashes: str) -> None:
    """Medians, and up to the 99th percentile a line each."""
    if not times:
        return
    sizes = [size(t) * (1.0 + DODGE * (degree - 2)) for t in times]
    middle, p99 = (1e3 * np.array([np.quantile(t.seconds, share) for t in times]) for share in (0.5, P99))
    axes.plot(sizes, middle, color=style.DEGREES[degree], linestyle=dashes, marker="o")
    axes.vlines(sizes, middle, p99, color=style.DEGREES[degree], linewidth=0.8)


def _legend(fig: Figure) -> None:
    handles = [Line2D([], [], color=style.DEGREES[degree], marker="o", label=f"d = {degree}") for degree in DEGREES]
    handles += [
        Line2D([], [], color=style.GREY, label="by moments: median, up to p99"),
        Line2D([], [], color=style.GREY, linestyle="--", label="by Gram matrices"),
        Line2D([], [], color=style.GREY, label="processor time", **CPU),
        Line2D([], [], color=style.INK, linestyle=":", linewidth=0.7, label="the control period"),
    ]
    fig.legend(handles=handles, loc="outside lower center", ncols=7, columnspacing=1.2)
