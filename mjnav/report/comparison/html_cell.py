"""One figure of one method in a page: its numbers, and its difference from the reference.

What is printed is rounded; `data-` attributes bear the values themselves.
"""

from math import inf, isfinite

from mjnav.report.comparison.shown import Shown, ShownCell, of_wins
from mjnav.study.compare.estimates import Estimate
from mjnav.study.compare.wins import WinRatio


def html_cell(cell: ShownCell) -> str:
    """The table cell."""
    e, below, found = cell.estimate, cell.below, cell.difference
    if e is None:
        return f'<td data-figure="{cell.figure}" data-value="{_raw(cell.value)}">{cell.own.value}</td>'
    inner = f'<div data-n="{e.num}"{_data(e)}>{_numbers("strong", cell.own)}</div>'
    if below is not None and found is not None:
        kind = "difference marked" if below.marked else "difference"
        e = found.ratio if cell.as_ratio and found.ratio is not None else found.estimate
        data = f'data-pairs="{e.num}" data-p="{_raw(found.p)}"{_data(e)}'
        inner += f'<div class="{kind}" {data}>{_numbers("b", below)}</div>'
    return f'<td data-figure="{cell.figure}">{inner}</td>'


def wins_cell(wins: WinRatio | None, shown: Shown) -> str:
    """The table cell of a win ratio; empty of a method against itself."""
    if wins is None:
        return '<td data-value=""></td>'
    kind = ' class="marked"' if shown.marked else ""
    data = f'data-wins="{wins.wins}" data-losses="{wins.losses}" data-ties="{wins.ties}" data-p="{_raw(wins.p)}"'
    return f"<td><div{kind} {data}{_data(of_wins(wins))}>{_numbers('strong', shown)}</div></td>"


def _data(e: Estimate) -> str:
    low, high = e.interval or (None, None)
    return f' data-value="{_raw(e.value)}" data-low="{_raw(low)}" data-high="{_raw(high)}"'


def _raw(value: float | None) -> str:
    if value == inf:
        return "Infinity"
    return repr(value) if value is not None and isfinite(value) else ""


def _numbers(element: str, shown: Shown) -> str:
    mark = " *" * shown.marked
    rest = " ".join(part for part in (shown.interval, shown.count) if part)
    tail = f" <span>{rest}</span>" if rest else ""
    return f"<{element}>{shown.value}{mark}</{element}>{tail}".replace("-", "−")
