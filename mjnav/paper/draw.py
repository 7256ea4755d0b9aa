"""How the paper's figures look, and the drawings that several of them share.

Colours are Okabe and Ito's, which all readers can tell apart; lines differ in dashes or markers as well.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from types import MappingProxyType
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from mjnav.paper.claims import Cells, by_place, place, short
from mjnav.report.figure_text import figure_name
from mjnav.study.compare.cell_rows import CellRows
from mjnav.study.compare.estimates import estimate

TWO_COLUMNS = 7.16  # [inches] of print
ROW_HEIGHT = 1.25  # [inches] of bars
DPI = 200

_RC: Mapping[Any, Any] = MappingProxyType(
    {
        "font.size": 7.0,
        "axes.titlesize": 7.5,
        "axes.linewidth": 0.6,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.axisbelow": True,
        "grid.color": "#e4e4e4",
        "grid.linewidth": 0.5,
        "legend.frameon": False,
        "lines.linewidth": 1.1,
        "lines.markersize": 3.5,
        "pdf.fonttype": 42,  # so that text stays text
    }
)

INK, GREY = "#222222", "#8c8c8c"
BLUE, SKY, GREEN, ORANGE, VERMILION = "#0072b2", "#56b4e9", "#009e73", "#e69f00", "#d55e00"
COLOURS = (SKY, BLUE, "#08416b", VERMILION, ORANGE, GREEN, "#882255", GREY)  # of methods, in the order of a figure


@contextmanager
def style() -> Iterator[None]:
    """Applies the style while a figure is made, and while it is saved; restores the settings afterwards."""
    with matplotlib.rc_context(dict(_RC)):
        yield


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of this size [inches], without pyplot's shared state. To be called within `style`."""
    return Figure(figsize=(width, height), dpi=DPI, layout="constrained")


def legend(figure: Figure, panels: Iterable[Axes], *, ncols: int) -> None:
    """One legend for all panels, below them."""
    handles = {label: line for axes in panels for line, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=ncols)


def axis(figure: str) -> tuple[str, float]:
    """An axis's label for a figure, and what its values are multiplied by: rates are shown in per cent."""
    name = figure_name(figure)
    return f"{name.words}\n[{name.unit}]" if name.unit else name.words, 100.0 if name.unit == "%" else 1.0


def bars(cells: Cells, methods: Sequence[str], figures: Sequence[str]) -> Figure:
    """A row of panels for each of `figures`, a panel a setting, in it a group of bars a scene.

    Bars are means (rates: shares), whiskers 95 % intervals over seeds. A panel's title says how many episodes with a
    result its cells have.
    """
    scenes, settings = (list(dict.fromkeys(getattr(cell, name) for cell in cells)) for name in ("scene", "setting"))
    placed = {method: by_place(cells, method) for method in methods}
    with style():
        figure = new_figure(max(TWO_COLUMNS, 0.95 * len(settings)), 0.6 + ROW_HEIGHT * len(figures))
        panels = figure.subplots(len(figures), max(len(settings), 1), sharex=True, sharey="row", squeeze=False)
        for row, name in zip(panels, figures, strict=True):
            for axes, setting in zip(row, settings, strict=False):
                for group, scene in enumerate(scenes):
                    _group(axes, group, {m: at.get(place(scene, setting)) for m, at in placed.items()}, name)
                names = [scene.removeprefix("crossing") for scene in scenes]
                axes.set_xticks(range(len(scenes)), names if len(scenes) > 1 else [""])
                axes.grid(axis="y")
            row[0].set_ylabel(axis(name)[0])
        for axes, setting in zip(panels[0], settings, strict=False):
            used = [cell for cell in cells if cell.setting == setting and cell.method in methods]
            words = short(setting).replace(", ", " ").split(" ")
            axes.set_title("\n".join([*words, with_result(used)]), fontsize=6.0)
        if len(scenes) > 1:
            panels[-1, panels.shape[1] // 2].set_xlabel("obstacles")
        handles = [Patch(facecolor=color, label=method) for method, color in zip(methods, COLOURS, strict=False)]
        figure.legend(handles=handles, loc="outside lower center", ncols=min(len(methods), 5))
    return figure


def _group(axes: Axes, group: int, cells: Mapping[str, CellRows | None], name: str) -> None:
    """The bars of one scene, around x = group; a word where there is none."""
    width, scale = 0.84 / len(cells), axis(name)[1]
    for i, (cell, color) in enumerate(zip(cells.values(), COLOURS, strict=False)):
        x = group + (i - 0.5 * (len(cells) - 1)) * width
        e = None if cell is None else estimate(cell, name)
        if e is None or not np.isfinite(e.value):
            word, across = "not run" if e is None else "undefined", axes.get_xaxis_transform()
            axes.text(x, 0.02, word, transform=across, ha="center", rotation=90.0, color=GREY, fontsize=5.0)
            continue
        axes.bar(x, scale * e.value, width=0.95 * width, color=color)
        if e.interval is not None:
            axes.vlines(x, scale * e.interval[0], scale * e.interval[1], color=INK, linewidth=0.7)


def with_result(cells: Cells) -> str:
    """How many episodes with a result these cells have: n = 12–200."""
    counts = [int((~cell.failed).sum()) for cell in cells] or [0]
    return f"n = {min(counts)}" if min(counts) == max(counts) else f"n = {min(counts)}–{max(counts)}"
