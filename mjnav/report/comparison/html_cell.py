"""One figure of one method in a page: its numbers, its difference from the reference, and that drawn as a whisker.

What is printed is rounded; `data-` attributes bear the values themselves.
"""

from math import isfinite

from mjnav.report.comparison.shown import Column, Shown
from mjnav.study.compare.compare import Comparison, Difference, Estimate, MethodRow

WIDTH, HEIGHT, MARGIN = 100.0, 9.0, 2.0  # of a whisker's own coordinates


class Axis:
    """The axis that a figure's differences in one table share: all intervals and zero."""

    def __init__(self, figure: str, table: Comparison):
        found = [row.differences[figure].estimate for row in table.rows if figure in row.differences]
        ends = [0.0, *(end for e in found if e.interval is not None for end in e.interval)]
        self._low, self._span = min(ends), max(ends) - min(ends) or 1.0

    def whisker(self, difference: Difference) -> str:
        """The interval, the value in it and zero; nothing where it is undefined."""
        e = difference.estimate
        if e.interval is None:
            return ""
        middle = 0.5 * HEIGHT
        lines = (
            ("zero", 0.0, 0.0, 0.0, HEIGHT),
            ("interval", *e.interval, middle, middle),
            ("value", e.value, e.value, 1.5, HEIGHT - 1.5),
        )
        drawn = "".join(
            f'<line class="{kind}" x1="{self._x(x1):.4g}" x2="{self._x(x2):.4g}" y1="{y1:g}" y2="{y2:g}"/>'
            for kind, x1, x2, y1, y2 in lines
        )
        return f'<svg viewBox="0 0 {WIDTH:g} {HEIGHT:g}" preserveAspectRatio="none" aria-hidden="true">{drawn}</svg>'

    def _x(self, value: float) -> float:
        return MARGIN + (WIDTH - 2.0 * MARGIN) * (value - self._low) / self._span


def cell(column: Column, row: MethodRow, axis: Axis) -> str:
    """The table cell."""
    e, difference = row.figures[column.figure], column.difference(row)
    inner = f'<div data-n="{e.num}"{_data(e)}>{_numbers("strong", column.own(row))}</div>'
    if difference is not None:
        found = row.differences[column.figure]
        kind = "difference marked" if difference.marked else "difference"
        data = f'data-pairs="{found.estimate.num}" data-p="{_raw(found.p)}"{_data(found.estimate)}'
        inner += f'<div class="{kind}" {data}>{_numbers("b", difference)}{axis.whisker(found)}</div>'
    return f'<td data-figure="{column.figure}">{inner}</td>'


def plain(figure: str, value: float, text: str) -> str:
    """The table cell of a figure without an interval."""
    return f'<td data-figure="{figure}" data-value="{_raw(value)}">{text}</td>'


def _data(e: Estimate) -> str:
    low, high = e.interval or (None, None)
    return f' data-value="{_raw(e.value)}" data-low="{_raw(low)}" data-high="{_raw(high)}"'


def _raw(value: float | None) -> str:
    return repr(value) if value is not None and isfinite(value) else ""


def _numbers(element: str, shown: Shown) -> str:
    mark = " *" * shown.marked
    rest = " ".join(part for part in (shown.interval, shown.count) if part)
    tail = f" <span>{rest}</span>" if rest else ""
    return f"<{element}>{shown.value}{mark}</{element}>{tail}".replace("-", "−")
