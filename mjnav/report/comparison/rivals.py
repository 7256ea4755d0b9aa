"""The win ratios of every two methods as a table: a row against a column, the same in text, LaTeX and HTML."""

from mjnav.report.comparison.shown import Shown, shown_wins
from mjnav.study.compare.compare import Comparison
from mjnav.study.compare.wins import WinRatio

ABOUT = "win ratio, row against column"


def win_ratio_between(table: Comparison, method: str, other: str) -> WinRatio | None:
    """Of two methods of a table that was made with rivals; None of a method against itself."""
    for found in table.rivals:
        if (found.method, found.other) == (method, other):
            return found.ratio
        if (found.other, found.method) == (method, other):
            return found.ratio.inverse
    return None


def shown_between(table: Comparison, method: str, other: str) -> Shown:
    """The same as it is printed; nothing of a method against itself."""
    found = win_ratio_between(table, method, other)
    return Shown("") if found is None else shown_wins(found, _episodes(table, method))


def _episodes(table: Comparison, method: str) -> int:
    return next(row.num for row in table.rows if row.method == method)
