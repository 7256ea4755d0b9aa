"""Comparisons as pictures, a panel for each table: every method's rate of success, alone or over a cost."""

from math import ceil, isfinite
from typing import Any

from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator

from mjnav.report.comparison.shown import sight
from mjnav.report.figure_text import figure_name
from mjnav.study.compare.estimates import Estimate
from mjnav.study.compare.study_comparison import Comparison, MethodRow, StudyComparison

ACROSS = 5  # panels in a row
PANEL, LABELS, ROW = 1.9, 1.6, 0.19  # [inch] width of a panel and of the methods' names, height of a method's line
HEAD = 0.65  # [inch] above and below the lines of a panel
WIDE = 4.0  # an axis of ratios from its least to its greatest, from which on 1, 2 and 5 are enough marks
LINE = 0.15  # [inch] height of a line of a panel's title
SQUARE = 3.2  # [inch] side of a panel over a cost
OWN, OTHERS = "#c1440e", "#33475b"  # of the method from which the others differ, and of those


def forest(results: StudyComparison) -> Figure:
    """A Wilson interval a method and table; the method from which the others differ has another colour."""
    rows = max(len(table.rows) for table in results.tables)
    figure, panels = _panels(results, PANEL, HEAD + ROW * rows, sharex=True)
    for i, (axes, table) in enumerate(panels):
        places = range(len(table.rows))
        for place, row in zip(places, table.rows, strict=True):
            colour = OWN if row.method == table.reference else OTHERS
            _cross(axes, _percent(row), Estimate(place, None, row.num), colour)
        named = i % ACROSS == 0 or len(table.rows) != len(panels[i - 1][1].rows)
        axes.set_yticks(places, [row.label for row in table.rows] if named else [""] * len(table.rows))
        axes.set(ylim=(len(table.rows) - 0.5, -0.5), xlim=(0.0, 101.0))
    figure.supxlabel("goal reached without contact, in time [%], and its 95 % interval", fontsize=8)
    return figure


def pareto(results: StudyComparison, cost: str) -> Figure:
    """Success over the ratio of a cost to the reference's, over common successes: up and to the left is better.

    A line joins the methods that none of the table is better than in both (Pareto's front), by the estimates alone.
    """
    figure, panels = _panels(results, SQUARE, SQUARE, sharex=False)
    methods = list(dict.fromkeys(row.label for _, row in results.rows))
    looks = {name: (f"C{i % 10}", "osv^D"[i // 10 % 5]) for i, name in enumerate(methods)}
    for axes, table in panels:
        points: list[tuple[float, float]] = []
        for row in table.rows:
            ratio, success, (colour, marker) = _ratio(table, row, cost), _percent(row), looks[row.label]
            if ratio is not None:
                _cross(axes, ratio, success, colour, marker)
                points.append((ratio.value, -success.value))
        front: list[tuple[float, float]] = []
        for x, y in sorted(points):
            if not front or y < front[-1][1]:
                front.append((x, y))
        axes.step([x for x, _ in front], [-y for _, y in front], where="post", color="k", linewidth=0.8, linestyle=":")
        axes.set_xscale("log")
        low, high = axes.get_xlim()
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)) if high > WIDE * low else MaxNLocator(4))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_ylim(top=102.0)
    marks = [Line2D([], [], color=colour, marker=marker, linestyle="") for colour, marker in looks.values()]
    figure.legend(marks, methods, loc="outside right upper", fontsize=7)
    figure.supxlabel(
        f"{figure_name(cost).words}, ratio to {results.tables[0].reference_label} over common successes", fontsize=8
    )
    figure.supylabel("goal reached without contact, in time [%]", fontsize=8)
    return figure


def _panels(
    results: StudyComparison, width: float, height: float, *, sharex: bool
) -> tuple[Figure, list[tuple[Any, Comparison]]]:
    """An empty figure, and the axes of every table, each `width` by `height` [inch]."""
    several = len({table.scene for table in results.tables}) < len(results.tables)  # settings of a scene
    height += LINE * several
    across = min(len(results.tables), ACROSS)
    down = ceil(len(results.tables) / across)
    figure = Figure(figsize=(LABELS + width * across, down * height), dpi=110, layout="constrained")
    panels = list(figure.subplots(down, across, squeeze=False, sharex=sharex).flat)
    for axes in panels[len(results.tables) :]:
        axes.set_axis_off()
    for axes, table in zip(panels, results.tables, strict=False):
        axes.tick_params(labelsize=7)
        axes.grid(axis="x", linewidth=0.4, alpha=0.5)
        num = max((row.num for row in table.rows), default=0)
        seen = sight(table.people).replace("people ", "").replace(" the robot", "")
        about = f"n = {num}" + (f", people {seen}" if seen in ("see", "do not see") else "")
        place = f"{table.scene}\n{table.setting_label}" if several else table.scene
        axes.set_title(f"{place}\n{about}", fontsize=8)
    return figure, list(zip(panels, results.tables, strict=False))


def _cross(axes, x: Estimate, y: Estimate, colour: str, marker: str = "o") -> None:
    """A point with its intervals."""
    if x.interval is not None:
        axes.plot(x.interval, [y.value, y.value], color=colour, linewidth=1.0)
    if y.interval is not None:
        axes.plot([x.value, x.value], y.interval, color=colour, linewidth=1.0)
    axes.plot([x.value], [y.value], marker, markersize=3.5, color=colour)


def _percent(row: MethodRow) -> Estimate:
    success = row.figures["success"]
    low_high = None if success.interval is None else (100.0 * success.interval[0], 100.0 * success.interval[1])
    return Estimate(100.0 * success.value, low_high, success.num)


def _ratio(table: Comparison, row: MethodRow, cost: str) -> Estimate | None:
    """Of a cost to the reference's; None where no seed has both."""
    change = row.differences.get(cost)
    ratio = Estimate(1.0, None, row.num) if row.method == table.reference else change.ratio if change else None
    return ratio if ratio is not None and isfinite(ratio.value) else None
