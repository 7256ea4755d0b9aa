"""Figures of the methods side by side, as SVG: a row a method, its value and its 95 % interval on a common axis.

Rates are shown themselves, other figures as differences from the reference where there is one.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from math import ceil, floor, isfinite, log10

from mjnav.printable import printable
from mjnav.report.figure_names import figure_name
from mjnav.study.compare.chosen_figures import RATES, is_rate
from mjnav.study.compare.compare import Comparison
from mjnav.study.compare.estimates import Estimate

WIDTH, RIGHT = 360.0, 10.0  # of the drawing, of its margin
LABELS = (122.0, 200.0)  # least and greatest width of the methods' labels
CHARACTER = 6.5  # width of most characters of a label
ROW, TOP, FOOT = 19.0, 5.0, 20.0
NUM_TICKS = 4
ALPHA = 0.05


@dataclass(frozen=True, slots=True)
class ForestRow:
    """One method's figure; `marked` where it is a difference beyond chance."""

    label: str
    estimate: Estimate
    marked: bool = False


@dataclass(frozen=True, slots=True)
class Forest:
    """One figure of all methods."""

    title: str  # in words, with its unit
    about: str  # what the values are, where they are differences
    rows: tuple[ForestRow, ...]
    scale: float = 1.0  # 100 of what is shown in per cent
    zero: bool = False  # whether the axis has a line at zero, as differences have
    bounds: tuple[float, float] | None = None  # that the axis keeps within

    @property
    def label_width(self) -> float:
        """That the longest label takes, within LABELS."""
        least, most = LABELS
        return min(max(least, *(CHARACTER * len(row.label) for row in self.rows)), most)


def forests(table: Comparison, figures: Sequence[str]) -> Iterator[Forest]:
    """The rates, then the figures asked for; what has no interval in any row is left out."""
    for figure in (*RATES, *figures):
        rate = is_rate(figure)
        of_differences = not rate and bool(table.reference)
        rows = []
        for row in table.rows:
            found = row.differences.get(figure)
            if not of_differences:
                rows.append(ForestRow(row.method, row.figures[figure]))
            elif found is not None:
                rows.append(ForestRow(row.method, found.estimate, found.p is not None and found.p < ALPHA))
        if any(row.estimate.interval is not None for row in rows):
            about = f"difference from {table.reference}" if of_differences else ""
            bounds = (0.0, 100.0) if rate else None
            name = str(figure_name(figure))
            yield Forest(name, about, tuple(rows), 100.0 if rate else 1.0, of_differences, bounds)


def forest_svg(forest: Forest) -> str:
    """The drawing with its title. Colours are the page's classes."""
    axis = _Axis(forest)
    height = TOP + ROW * len(forest.rows) + FOOT
    floor_ = height - FOOT
    ticks = "".join(
        f'<line class="grid" x1="{x:.1f}" x2="{x:.1f}" y1="{TOP:g}" y2="{floor_:g}"/>'
        f'<text class="tick" x="{x:.1f}" y="{floor_ + 14:g}" text-anchor="middle">{_text(f"{tick:g}")}</text>'
        for tick, x in ((tick, axis.x(tick)) for tick in axis.ticks)
    )
    zero = f'<line class="zero" x1="{axis.x(0):.1f}" x2="{axis.x(0):.1f}" y1="{TOP:g}" y2="{floor_:g}"/>'
    rows = "".join(_row(forest, row, axis, TOP + ROW * (i + 0.5)) for i, row in enumerate(forest.rows))
    title, about = escape(printable(forest.title)), escape(printable(forest.about))
    return (
        f'<figure class="panel"><figcaption>{title} <small>{about}</small></figcaption>'
        f'<svg viewBox="0 0 {WIDTH:g} {height:g}" role="img" aria-label="{title} {about}: the values are in the table">'
        f"{ticks}{zero * forest.zero}{rows}</svg></figure>"
    )


class _Axis:
    """All intervals of a forest, zero where it has a line there, and a little room."""

    def __init__(self, forest: Forest):
        ends = [0.0] * forest.zero
        for e in (row.estimate for row in forest.rows):
            ends += [forest.scale * end for end in (e.value, *(e.interval or ())) if isfinite(end)]
        low, high = min(ends), max(ends)
        room = 0.05 * (high - low) or 0.5 * abs(high) or 1.0
        self._low, self._high = low - room, high + room
        self._left = forest.label_width + 8.0
        if forest.bounds is not None:
            self._low, self._high = max(self._low, forest.bounds[0]), min(self._high, forest.bounds[1])
        step = _round_step((self._high - self._low) / NUM_TICKS)
        self.ticks = [step * i for i in range(ceil(self._low / step - 1e-9), floor(self._high / step + 1e-9) + 1)]

    def x(self, value: float) -> float:
        """The place of a value, in the drawing's units."""
        return self._left + (WIDTH - self._left - RIGHT) * (value - self._low) / (self._high - self._low)


def _round_step(rough: float) -> float:
    power = 10.0 ** floor(log10(rough))
    return next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= 0.999 * rough)


def _row(forest: Forest, row: ForestRow, axis: _Axis, y: float) -> str:
    label, width, e = printable(row.label), forest.label_width, row.estimate
    name = (  # an svg of its own cuts off what is too long
        f'<svg width="{width:g}" height="{ROW:g}" y="{y - 0.5 * ROW:g}"><title>{escape(label)}</title>'
        f'<text class="label" y="{0.5 * ROW + 4:g}">{escape(_shortened(label, int(width / CHARACTER)))}</text></svg>'
    )
    if not isfinite(e.value):
        return f'{name}<text class="tick" x="{width + 8:g}" y="{y + 4:g}">undefined</text>'
    x, line = axis.x(forest.scale * e.value), ""
    if e.interval is not None:
        low, high = (axis.x(forest.scale * end) for end in e.interval)
        line = f'<line class="interval" x1="{low:.1f}" x2="{high:.1f}" y1="{y:g}" y2="{y:g}"/>'
    kind = "marked" if row.marked else "open"
    return f'{name}<g class="{kind}">{line}<circle cx="{x:.1f}" cy="{y:g}" r="3.5"/></g>'


def _shortened(label: str, most: int) -> str:
    """Beginning and end of a label that is too long: those of a grid differ at their ends."""
    if len(label) <= most:
        return label
    return f"{label[: (most - 1) // 2]}…{label[len(label) - most // 2 :]}"


def _text(text: str) -> str:
    return text.replace("-", "\N{MINUS SIGN}")
