"""Results of studies as HTML tables, for notebooks."""

from collections.abc import Iterable, Sequence
from html import escape
from math import isfinite

from mjnav.study.compare.estimates import Estimate


def html_table(caption: str, heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table; the first cell of a row is its head."""
    top = "".join(f"<th scope='col'>{escape(head)}</th>" for head in heads)
    body = "".join(f"<tr>{_cells(row)}</tr>" for row in rows)
    return f"<table><caption>{escape(caption)}</caption><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"


def _cells(row: Sequence[object]) -> str:
    first, *others = (escape(str(cell)) for cell in row)
    return f"<th scope='row'>{first}</th>{''.join(f'<td>{cell}</td>' for cell in others)}"


def percent(rate: Estimate, *, signed: bool = False) -> str:
    """A rate with its interval, in per cent."""
    if not isfinite(rate.value):
        return "-"
    form = "+.0f" if signed else ".0f"
    interval = "" if rate.interval is None else f" [{', '.join(format(100.0 * end, form) for end in rate.interval)}]"
    return f"{100.0 * rate.value:{form}}{interval}"
