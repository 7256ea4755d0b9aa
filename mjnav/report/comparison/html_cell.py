"""One figure of one method in a page: its numbers, its difference from the reference, and that drawn as a whisker.

What is printed is rounded; `data-` attributes bear the values themselves.
"""

from collections.abc import Iterable
from math import isfinite

from mjnav.report.comparison.shown import Shown, ShownCell
from mjnav.study.compare.compare import Difference, Estimate

WIDTH, HEIGHT, MARGIN = 100.0, 9.0, 2.0  # of a whisker's own coordinates


class Axis:
    """The axis that a column's differences share: all intervals and zero."""

    def __init__(self, column: Iterable[ShownCell]):
        intervals = [cell.difference.estimate.interval for cell in column if cell.difference is not None]
        ends = [0.0, *(end for interval in intervals if interval is not None for end in interval)]
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


def html_cell(cell: ShownCell, axis: Axis) -> str:
    """The table cell."""
    e, below, found = cell.estimate, cell.below, cell.difference
    if e is None:
        return f'<td data-figure="{cell.figure}" data-value="{_raw(cell.value)}">{cell.own.value}</td>'
    inner = f'<div data-n="{e.num}"{_data(e)}>{_numbers("strong", cell.own)}</div>'
    if below is not None and found is not None:
        kind = "difference marked" if below.marked else "difference"
        data = f'data-pairs="{found.estimate.num}" data-p="{_raw(found.p)}"{_data(found.estimate)}'
        inner += f'<div class="{kind}" {data}>{_numbers("b", below)}{axis.whisker(found)}</div>'
    return f'<td data-figure="{cell.figure}">{inner}</td>'


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
