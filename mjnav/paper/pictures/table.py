"""The table: the share of runs that went between its legs, around it, or did not arrive unharmed."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from mjnav.metrics.intervals import wilson
from mjnav.paper.contrast import Cells, by_place
from mjnav.paper.pictures.bars import gap, with_result
from mjnav.paper.pictures.style import BLUE, INK, ORANGE, PALE, TWO_COLUMNS, new_figure, style
from mjnav.paper.table import between_legs

METHODS = ("d=1", "d=2", "d=3", "d=1 matched")
SHADES = (("between the legs", BLUE), ("around", ORANGE), ("collision or timeout", PALE))


def figure(cells: Cells) -> Figure:
    """A panel for each setting, a bar for each degree; whiskers are Wilson intervals of the way between the legs."""
    places = list(dict.fromkeys(place for method in METHODS for place in by_place(cells, method)))
    with style():
        figure = new_figure(TWO_COLUMNS, 2.3)
        panels = figure.subplots(1, max(len(places), 1), sharey=True, squeeze=False)[0]
        for axes, place in zip(panels, places, strict=False):
            for x, method in enumerate(METHODS):
                cell = by_place(cells, method).get(place)
                num = 0 if cell is None else int((~cell.failed).sum())
                if cell is None or not num:
                    gap(axes, x, "not run" if cell is None else "undefined")
                    continue
                between = between_legs(cell)
                counts = np.array([between.sum(), between.size - between.sum(), num - between.size])
                shares = counts / num
                for share, start, (_, shade) in zip(shares, np.cumsum(shares) - shares, SHADES, strict=True):
                    axes.bar(x, share, bottom=start, width=0.75, color=shade)
                interval = wilson(int(between.sum()), num)
                if interval is not None:
                    axes.vlines(x, *interval, color=INK, linewidth=0.7)
            axes.set_xticks(range(len(METHODS)), [name.replace(" ", "\n") for name in METHODS])
            here = [by_place(cells, method)[place] for method in METHODS if place in by_place(cells, method)]
            axes.set_title("\n".join([*place.split(", ")[1:], with_result(here)]))
        panels[0].set_ylabel("share of runs")
        handles = [Patch(facecolor=shade, label=label) for label, shade in SHADES]
        figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure
