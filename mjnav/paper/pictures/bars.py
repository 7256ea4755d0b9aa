"""Methods side by side in every setting: a bar a method, as the paper has them, with the intervals that it lacks."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from mjnav.paper.contrast import Cells, place, short, values
from mjnav.paper.pictures.style import DEGREES, GREY, INK, METHODS, TWO_COLUMNS, new_figure, style
from mjnav.study.compare.compare import Estimate

ROW_HEIGHT = 1.25  # [inches]


def bars(
    cells: Cells, methods: Sequence[str], figures: Mapping[str, str], *, colors: Mapping[str, str] | None = None
) -> Figure:
    """A row of panels for each of `figures` (column -> axis label), a panel a setting, in it a group of bars a scene.

    Bars are means (rates: shares), whiskers 95 % intervals over seeds. A panel's title says how many episodes with a
    result its cells have.
    """
    scenes, settings = (list(dict.fromkeys(getattr(cell, name) for cell in cells)) for name in ("scene", "setting"))
    colors = colors or {method: color(method) for method in methods}
    found = {figure: {method: values(cells, method, figure) for method in methods} for figure in figures}
    with style():
        figure = new_figure(max(TWO_COLUMNS, 0.95 * len(settings)), 0.6 + ROW_HEIGHT * len(figures))
        panels = figure.subplots(len(figures), max(len(settings), 1), sharex=True, sharey="row", squeeze=False)
        for row, (name, label) in zip(panels, figures.items(), strict=True):
            for axes, setting in zip(row, settings, strict=False):
                for group, scene in enumerate(scenes):
                    _group(axes, group, [found[name][m].get(place(scene, setting)) for m in methods], colors.values())
                names = [scene.removeprefix("crossing") for scene in scenes]
                axes.set_xticks(range(len(scenes)), names if len(scenes) > 1 else [""])
                axes.tick_params(axis="x", length=0.0)
                axes.grid(axis="y")
            row[0].set_ylabel(label)
        for axes, setting in zip(panels[0], settings, strict=False):
            here = [cell for cell in cells if cell.setting == setting and cell.method in methods]
            axes.set_title("\n".join([*short(setting).replace(", ", " ").split(" "), with_result(here)]), fontsize=6.0)
        if len(scenes) > 1:
            for axes in panels[-1]:
                axes.set_xlabel("obstacles" if scenes[0].startswith("crossing") else "scene")
        handles = [Patch(facecolor=colors[method], label=method) for method in methods]
        figure.legend(handles=handles, loc="outside lower center", ncols=min(len(methods), 6))
    return figure


def _group(axes: Axes, group: int, found: Sequence[Estimate | None], colors: Iterable[str]) -> None:
    """The bars of one scene, around x = group."""
    width = 0.84 / len(found)
    for i, (estimate, shade) in enumerate(zip(found, colors, strict=True)):
        x = group + (i - 0.5 * (len(found) - 1)) * width
        if estimate is None or not np.isfinite(estimate.value):
            gap(axes, x, "not run" if estimate is None else "undefined")
            continue
        axes.bar(x, estimate.value, width=0.95 * width, color=shade)
        if estimate.interval is not None:
            axes.vlines(x, *estimate.interval, color=INK, linewidth=0.7)


def gap(axes: Axes, x: float, word: str) -> None:
    """A word where a bar would be."""
    axes.annotate(
        word,
        (x, 0.0),
        xycoords=("data", "axes fraction"),
        ha="center",
        va="bottom",
        rotation=90.0,
        color=GREY,
        fontsize=5.0,
    )


def with_result(cells: Cells) -> str:
    """How many episodes with a result these cells have: n = 12–200."""
    counts = [int((~cell.failed).sum()) for cell in cells]
    if not counts:
        return "n = 0"
    return f"n = {min(counts)}" if min(counts) == max(counts) else f"n = {min(counts)}–{max(counts)}"


def legend(figure: Figure, panels: Iterable[Axes], *, ncols: int) -> None:
    """One for all panels, below them, of what any of them shows."""
    found = {label: handle for axes in panels for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    figure.legend(found.values(), found.keys(), loc="outside lower center", ncols=ncols)


def color(label: str) -> str:
    """Of a method's label: a degree's own shade, else the method's."""
    for degree, shade in DEGREES.items():
        if f"d={degree}" in label:
            return shade
    return next((shade for name, shade in METHODS.items() if label.startswith(name)), INK)
