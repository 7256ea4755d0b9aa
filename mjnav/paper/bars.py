"""Methods side by side in every setting: a bar a method, as in the paper, with the intervals that the paper lacks."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from mjnav.paper.contrast import place, short, values
from mjnav.paper.item import Cells
from mjnav.paper.style import GREY, INK, TWO_COLUMNS, color, new_figure, style
from mjnav.study.compare.estimates import Estimate

ROW_HEIGHT = 1.25  # [inches]
AXES: Mapping[str, str] = MappingProxyType(
    {
        "collision": "collision rate",
        "control_cost": "control cost [m²/s³]",
        "mean_deviation_m": "deviation [m]",
        "min_clearance_m": "least clearance [m]",
        "time_to_avoid_s": "time to avoid [s]",
        "mean_safe_share": "safe share of samples",
        "mean_lane_clearance_m": "mean distance [m]",
        "min_lane_clearance_m": "least distance [m]",
        "compute_ms_control_p50": "decision [ms]",
    }
)


def bars(cells: Cells, methods: Sequence[str], figures: Sequence[str]) -> Figure:
    """A row of panels for each of `figures` (columns in AXES), a panel a setting, in it a group of bars a scene.

    Bars are means (rates: shares), whiskers 95 % intervals over seeds. A panel's title says how many episodes with a
    result its cells have.
    """
    scenes, settings = (list(dict.fromkeys(getattr(cell, name) for cell in cells)) for name in ("scene", "setting"))
    with style():
        figure = new_figure(max(TWO_COLUMNS, 0.95 * len(settings)), 0.6 + ROW_HEIGHT * len(figures))
        panels = figure.subplots(len(figures), max(len(settings), 1), sharex=True, sharey="row", squeeze=False)
        for row, name in zip(panels, figures, strict=True):
            found = [values(cells, method, name) for method in methods]
            for axes, setting in zip(row, settings, strict=False):
                for group, scene in enumerate(scenes):
                    _group(axes, group, methods, [of.get(place(scene, setting)) for of in found])
                names = [scene.removeprefix("crossing") for scene in scenes]
                axes.set_xticks(range(len(scenes)), names if len(scenes) > 1 else [""])
                axes.tick_params(axis="x", length=0.0)
                axes.grid(axis="y")
            row[0].set_ylabel(AXES[name])
        for axes, setting in zip(panels[0], settings, strict=False):
            entitle(axes, setting, [cell for cell in cells if cell.setting == setting and cell.method in methods])
        if len(scenes) > 1:
            for axes in panels[-1]:
                axes.set_xlabel("obstacles" if scenes[0].startswith("crossing") else "scene")
        handles = [Patch(facecolor=color(method), label=method) for method in methods]
        figure.legend(handles=handles, loc="outside lower center", ncols=min(len(methods), 6))
    return figure


def _group(axes: Axes, group: int, methods: Sequence[str], found: Sequence[Estimate | None]) -> None:
    """The bars of one scene, around x = group."""
    width = 0.84 / len(found)
    for i, (method, estimate) in enumerate(zip(methods, found, strict=True)):
        x = group + (i - 0.5 * (len(found) - 1)) * width
        if estimate is None or not np.isfinite(estimate.value):
            gap(axes, x, "not run" if estimate is None else "undefined")
            continue
        axes.bar(x, estimate.value, width=0.95 * width, color=color(method))
        if estimate.interval is not None:
            axes.vlines(x, *estimate.interval, color=INK, linewidth=0.7)


def gap(axes: Axes, x: float, word: str) -> None:
    """Writes a word where a bar would be."""
    axes.annotate(
        word, (x, 0.0), xycoords=("data", "axes fraction"), ha="center", va="bottom", rotation=90.0, color=GREY,
        fontsize=5.0,
    )  # fmt: skip


def entitle(axes: Axes, setting: str, cells: Cells) -> None:
    """A panel's title: the setting word by word, and how many episodes with a result its cells have."""
    words = short(setting).replace(", ", " ").split(" ")
    axes.set_title("\n".join([*words, with_result(cells)]), fontsize=6.0)


def with_result(cells: Cells) -> str:
    """How many episodes with a result these cells have: n = 12–200."""
    counts = [int((~cell.failed).sum()) for cell in cells] or [0]
    return f"n = {min(counts)}" if min(counts) == max(counts) else f"n = {min(counts)}–{max(counts)}"
