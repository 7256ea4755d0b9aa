"""Comparisons as a picture: every method's rate of success with its interval, a panel for each table."""

from math import ceil

from matplotlib.figure import Figure

from mjnav.report.comparison.shown import sight
from mjnav.study.compare.study_comparison import Comparison, StudyComparison

ACROSS = 5  # panels in a row
PANEL, LABELS, ROW = 1.9, 1.6, 0.19  # [inch] width of a panel and of the methods' names, height of a method's line
HEAD = 0.65  # [inch] above and below the lines of a panel
OWN, OTHERS = "#c1440e", "#33475b"  # of the method from which the others differ, and of those


def forest(results: StudyComparison) -> Figure:
    """A Wilson interval a method and table; the method from which the others differ has another colour."""
    tables = results.tables
    across = min(len(tables), ACROSS)
    down = ceil(len(tables) / across)
    methods = max(len(table.rows) for table in tables)
    size = LABELS + PANEL * across, down * (HEAD + ROW * methods)
    figure = Figure(figsize=size, dpi=110, layout="constrained")
    panels = figure.subplots(down, across, sharex=True, squeeze=False)
    for i, axes in enumerate(panels.flat):
        if i >= len(tables):
            axes.set_axis_off()
            continue
        _panel(axes, tables[i], named=i % across == 0 or len(tables[i].rows) != len(tables[i - 1].rows))
    figure.supxlabel("goal reached without contact, in time [%], and its 95 % interval", fontsize=8)
    return figure


def _panel(axes, table: Comparison, *, named: bool) -> None:
    places = range(len(table.rows))
    for place, row in zip(places, table.rows, strict=True):
        success = row.figures["success"]
        colour = OWN if row.method == table.reference else OTHERS
        if success.interval is not None:
            axes.plot([100.0 * end for end in success.interval], [place, place], color=colour, linewidth=1.2)
        axes.plot([100.0 * success.value], [place], "o", markersize=3.5, color=colour)
    axes.set_yticks(places, [row.label for row in table.rows] if named else [""] * len(table.rows), fontsize=7)
    axes.set(ylim=(len(table.rows) - 0.5, -0.5), xlim=(0.0, 101.0))
    axes.tick_params(labelsize=7)
    axes.grid(axis="x", linewidth=0.4, alpha=0.5)
    num = max((row.num for row in table.rows), default=0)
    seen = sight(table.people).replace("people ", "").replace(" the robot", "")
    about = f"n = {num}" + (f", people {seen}" if seen in ("see", "do not see") else "")
    axes.set_title(f"{table.scene}\n{about}", fontsize=8)
