"""The forest plots of `results.md`, from the tables of that page: `python docs/pictures/results.py FOLDER`."""

import re
import sys
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

PAGE = Path(__file__).parents[1] / "results.md"
PICTURES = {
    "Among people": "people",
    "By lidar": "lidar",
}  # by the start of a section's heading
ESTIMATE = re.compile(r"([\d.]+) \[([\d.]+), ([\d.]+)\]")  # and its 95 % interval
RATIOS = (0.5, 1.0, 2.0, 5.0, 10.0)
BLUE, GREY = "#0072b2", "#d0d0d0"


def table(section: str) -> tuple[list[str], list[list[str]]]:
    """The headings and the rows of a section's table."""
    lines = [line for line in section.splitlines() if line.startswith("|")]
    head, _, *rows = [[cell.strip(" `") for cell in line.strip("|").split("|")] for line in lines]
    return head, rows


def panel(axes: Axes, heading: str, cells: list[str]) -> None:
    """The estimates of one column with their intervals, the first row above; a ratio is drawn against 1."""
    for row, cell in enumerate(cells):
        if estimate := ESTIMATE.match(cell):
            value, least, greatest = map(float, estimate.groups())
            axes.plot([least, greatest], [row, row], color=BLUE, linewidth=1.4)
            axes.plot(value, row, "o", color=BLUE, markersize=4)
    if "ratio" in heading:
        axes.set_xscale("log")
        axes.set_xticks(RATIOS, [f"{ratio:g}" for ratio in RATIOS])
        axes.minorticks_off()
        axes.axvline(1.0, color=GREY, zorder=0)
    else:
        axes.set_xlim(0, 103)
        axes.grid(axis="x", color=GREY, linewidth=0.5)
    axes.set_title(heading, fontsize=9)
    axes.tick_params(labelsize=8, length=0)
    axes.spines[["top", "right", "left"]].set_visible(False)


def forest(head: list[str], rows: list[list[str]]) -> Figure:
    """A panel for each column that has intervals; rows are named by the cells before the first of these."""
    shown = [column for column in range(len(head)) if ESTIMATE.match(rows[0][column])]
    figure = Figure(figsize=(9.0, 0.7 + 0.2 * len(rows)), dpi=110, layout="constrained", facecolor="white")
    for axes, column in zip(figure.subplots(1, len(shown), sharey=True), shown, strict=True):
        panel(axes, head[column], [row[column] for row in rows])
    figure.axes[0].set_yticks(range(len(rows)), [", ".join(row[: shown[0]]) for row in rows])
    figure.axes[0].invert_yaxis()
    return figure


def main(folder: Path) -> None:
    """Writes a picture for each headline table."""
    sections = PAGE.read_text(encoding="utf-8").split("\n## ")
    for start, name in PICTURES.items():
        section = next(text for text in sections if text.startswith(start))
        forest(*table(section)).savefig(folder / f"results-{name}.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
