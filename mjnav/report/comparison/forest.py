"""Figures of the methods side by side, as SVG: a row a method, its value and its 95 % interval on a common axis.

Rates are shown themselves, other figures as differences from the reference where there is one.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from html import escape
from math import ceil, floor, isfinite, log10

from mjnav.printable import printable
from mjnav.report.comparison.shown import shown_tables
from mjnav.report.figure_text import Shown
from mjnav.study.compare.chosen_figures import is_rate
from mjnav.study.compare.study_comparison import Comparison

WIDTH, RIGHT = 360.0, 10.0  # of the drawing, of its margin
LABELS = (122.0, 200.0)  # least and greatest width of the methods' labels
CHARACTER = 6.5  # width of most characters of a label
ROW, TOP, FOOT = 19.0, 5.0, 20.0
NUM_TICKS = 4


def forests(table: Comparison) -> Iterator[str]:
    """A drawing of each rate and figure; what has no interval in any row is left out."""
    shown = next(shown_tables(table))
    for column in shown.columns:
        rate = is_rate(column.figure)
        differences = not rate and bool(table.reference)
        parts = [cell.below if differences else cell.own for cell in column.cells]
        rows = [(method, part) for method, part in zip(shown.methods, parts, strict=True) if part is not None]
        if column.figure in table.rows[0].figures and any(part.interval for _, part in rows):
            about = f"difference from {table.reference_label}" if differences else ""
            yield forest_svg(str(column.name), about, rows, per_cent=rate, zero=differences)


def forest_svg(
    title: str, about: str, rows: list[tuple[str, Shown]], *, per_cent: bool = False, zero: bool = False
) -> str:
    """A drawing with its title, where `zero` with a line at zero. Colours are the page's classes."""
    labels = [printable(label) for label, _ in rows]
    width = min(max(LABELS[0], *(CHARACTER * len(label) for label in labels)), LABELS[1])
    axis = _axis([part for _, part in rows], width + 8.0, per_cent=per_cent, zero=zero)
    foot = TOP + ROW * len(rows)
    vertical = f'y1="{TOP:g}" y2="{foot:g}"'
    drawn = "".join(
        f'<line class="grid" x1="{axis.x(tick):.1f}" x2="{axis.x(tick):.1f}" {vertical}/>'
        f'<text class="tick" x="{axis.x(tick):.1f}" y="{foot + 14:g}" text-anchor="middle">{_minus(f"{tick:g}")}</text>'
        for tick in axis.ticks
    )
    if zero:
        drawn += f'<line class="zero" x1="{axis.x(0):.1f}" x2="{axis.x(0):.1f}" {vertical}/>'
    for i, (label, (_, part)) in enumerate(zip(labels, rows, strict=True)):
        y = TOP + ROW * (i + 0.5)
        text = escape(_shortened(label, int(width / CHARACTER)))
        drawn += f'<text class="label" y="{y + 4:g}"><title>{escape(label)}</title>{text}</text>'
        drawn += _interval(part, axis, y, width + 8.0)
    title, about = escape(printable(title)), escape(printable(about))
    return (
        f'<figure class="panel"><figcaption>{title} <small>{about}</small></figcaption>'
        f'<svg viewBox="0 0 {WIDTH:g} {foot + FOOT:g}" role="img" '
        f'aria-label="{title} {about}: the values are in the table">{drawn}</svg></figure>'
    )


@dataclass(frozen=True, slots=True)
class _Axis:
    """A linear map of values to places, with ticks at round values."""

    ticks: list[float]
    scale: float  # 100 of what is shown in per cent
    origin: float  # the place of 0
    stretch: float  # places by value

    def x(self, value: float) -> float:
        """The place of a value that is scaled already, in the drawing's units."""
        return self.origin + self.stretch * value


def _axis(parts: list[Shown], left: float, *, per_cent: bool, zero: bool) -> _Axis:
    """All intervals, zero where it has a line there, and a little room."""
    scale = 100.0 if per_cent else 1.0
    estimates = [part.estimate for part in parts if part.estimate is not None]
    ends = [scale * end for e in estimates for end in (e.value, *(e.interval or ())) if isfinite(end)] + [0.0] * zero
    room = 0.05 * (max(ends) - min(ends)) or 0.5 * abs(max(ends)) or 1.0
    low, high = min(ends) - room, max(ends) + room
    if per_cent:
        low, high = max(low, 0.0), min(high, 100.0)
    power = 10.0 ** floor(log10((high - low) / NUM_TICKS))
    step = next(f * power for f in (1.0, 2.0, 5.0, 10.0) if f * power >= 0.999 * (high - low) / NUM_TICKS)
    ticks = [step * i for i in range(ceil(low / step - 1e-9), floor(high / step + 1e-9) + 1)]
    stretch = (WIDTH - left - RIGHT) / (high - low)
    return _Axis(ticks, scale, left - stretch * low, stretch)


def _interval(part: Shown, axis: _Axis, y: float, left: float) -> str:
    e = part.estimate
    if e is None or not isfinite(e.value):
        return f'<text class="tick" x="{left:g}" y="{y + 4:g}">undefined</text>'
    line = ""
    if e.interval is not None:
        low, high = (axis.x(axis.scale * end) for end in e.interval)
        line = f'<line class="interval" x1="{low:.1f}" x2="{high:.1f}" y1="{y:g}" y2="{y:g}"/>'
    kind = "marked" if part.marked else "open"
    return f'<g class="{kind}">{line}<circle cx="{axis.x(axis.scale * e.value):.1f}" cy="{y:g}" r="3.5"/></g>'


def _shortened(label: str, most: int) -> str:
    """Beginning and end of a label that is too long: those of a grid differ at their ends."""
    return label if len(label) <= most else f"{label[: (most - 1) // 2]}…{label[len(label) - most // 2 :]}"


def _minus(text: str) -> str:
    return text.replace("-", "\N{MINUS SIGN}")
