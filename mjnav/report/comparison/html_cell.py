"""One figure of one method in a page: its numbers, and its difference from the reference.

What is printed is rounded; `data-` attributes bear the values themselves.
"""

from math import isfinite

from mjnav.report.comparison.shown import Shown, ShownCell
from mjnav.study.compare.estimates import Estimate


def html_cell(cell: ShownCell) -> str:
    """The table cell."""
    e, below, found = cell.estimate, cell.below, cell.difference
    if e is None:
        return f'<td data-figure="{cell.figure}" data-value="{_raw(cell.value)}">{cell.own.value}</td>'
    inner = f'<div data-n="{e.num}"{_data(e)}>{_numbers("strong", cell.own)}</div>'
    if below is not None and found is not None:
        kind = "difference marked" if below.marked else "difference"
        data = f'data-pairs="{found.estimate.num}" data-p="{_raw(found.p)}"{_data(found.estimate)}'
        inner += f'<div class="{kind}" {data}>{_numbers("b", below)}</div>'
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
