"""The figures of a comparison as they are printed, the same in text, LaTeX and HTML.

A column has as many decimals as its narrowest interval needs for one digit of its half width: 12.34 [11.82, 12.91],
and the difference +0.61 [+0.20, +1.10] below it.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from math import floor, isfinite, log10

from mjnav.study.compare.chosen_figures import RATES, is_rate
from mjnav.study.compare.compare import Comparison, MethodRow
from mjnav.study.compare.estimates import Difference, Estimate
from mjnav.study.compare.study_comparison import StudyComparison

ALPHA = 0.05  # below it a difference is marked
MAX_DECIMALS = 6
NEGLIGIBLE = 1e-4  # of the widest interval: what is narrower is rounding
DASH = "-"
PLAIN = ("infeasible %", "decision ms")  # titles of the columns without intervals


@dataclass(frozen=True, slots=True)
class Shown:
    """An estimate in parts; "-" and nothing where it is undefined."""

    value: str
    interval: str = ""  # [low, high]
    count: str = ""  # (4): how many seeds, where they are not all of the row's
    marked: bool = False

    def __str__(self) -> str:
        return " ".join(part for part in (self.value, self.interval, self.count, "*" * self.marked) if part)


@dataclass(frozen=True, slots=True)
class ShownCell:
    """One figure of one method."""

    figure: str
    own: Shown
    value: float
    estimate: Estimate | None = None  # of which `own` was made; None of a figure without an interval
    below: Shown | None = None  # the difference from the reference; None of the reference itself and without one
    difference: Difference | None = None  # of which `below` was made


@dataclass(frozen=True, slots=True)
class ShownRow:
    """One method."""

    method: str
    episodes: str
    cells: tuple[ShownCell, ...]


@dataclass(frozen=True, slots=True)
class ShownTable:
    """One scene under one setting."""

    titles: tuple[str, ...]  # of the cells, as `--figure` takes them
    figures: tuple[str, ...]  # the same without units
    rows: tuple[ShownRow, ...]


@dataclass(frozen=True, slots=True)
class _Column:
    """A figure of one table."""

    figure: str
    title: str
    decimals: int
    scale: float  # 100 for what is shown in per cent

    def cell(self, row: MethodRow) -> ShownCell:
        """The method's own figure and its difference from the reference."""
        e, found = row.figures[self.figure], row.differences.get(self.figure)
        own, below = self._shown(e, row.num, ""), None
        if found is not None:
            below = self._shown(found.estimate, row.num, "+", marked=found.p is not None and found.p < ALPHA)
        return ShownCell(self.figure, own, e.value, e, below, found)

    def _shown(self, e: Estimate, num: int, sign: str, *, marked: bool = False) -> Shown:
        count = f"({e.num})" if e.num != num else ""
        if not isfinite(e.value):
            return Shown(DASH, count=count)
        low_high = [self._number(end, sign) for end in e.interval or ()]
        return Shown(self._number(e.value, sign), f"[{', '.join(low_high)}]" * bool(low_high), count, marked)

    def _number(self, value: float, sign: str) -> str:
        rounded = round(self.scale * value, self.decimals) + 0.0  # no -0.0
        return f"{rounded:{sign if rounded else ''}.{self.decimals}f}"


def shown_table(results: StudyComparison, table: Comparison) -> ShownTable:
    """All figures of a table: rates, what has no interval, and the figures asked for."""
    rates, figures = _columns(table, RATES), _columns(table, results.figures)
    rows = []
    for row in table.rows:
        plain = (
            ShownCell("infeasible_share", _plain(row.infeasible_share, 100.0, 1), row.infeasible_share),
            ShownCell("decision_ms", _plain(row.decision_ms, 1.0, 2), row.decision_ms),
        )
        cells = (*(column.cell(row) for column in rates), *plain, *(column.cell(row) for column in figures))
        missing = results.missing[table.scene, table.setting, row.method]
        rows.append(ShownRow(row.method, _episodes(row, missing), cells))
    titles = (*(column.title for column in rates), *PLAIN, *(column.title for column in figures))
    names = (*RATES, "infeasible_share", "decision_ms", *results.figures)
    return ShownTable(titles, names, tuple(rows))


def _plain(value: float, scale: float, decimals: int) -> Shown:
    return Shown(f"{scale * value:.{decimals}f}" if isfinite(value) else DASH)


def _columns(table: Comparison, figures: Iterable[str]) -> list[_Column]:
    found = []
    for figure in figures:
        scale = 100.0 if is_rate(figure) else 1.0
        title = f"{figure} %" if is_rate(figure) else figure
        found.append(_Column(figure, title, _decimals(table, figure, scale), scale))
    return found


def _decimals(table: Comparison, figure: str, scale: float) -> int:
    estimates = [row.figures[figure] for row in table.rows]
    if not is_rate(figure):  # whose differences are no finer than they
        estimates += [row.differences[figure].estimate for row in table.rows if figure in row.differences]
    halves = [0.5 * scale * (e.interval[1] - e.interval[0]) for e in estimates if e.interval is not None]
    least = min((half for half in halves if half > NEGLIGIBLE * max(halves)), default=0.0)
    if not least:  # values that are all the same
        return 0 if is_rate(figure) else 3
    return min(max(-floor(log10(least)), 0), MAX_DECIMALS)


def _episodes(row: MethodRow, missing: int) -> str:
    """How many episodes: 20, 18/20 where some are missing, 20 (1 failed)."""
    wanted = f"/{row.num + missing}" if missing else ""
    return f"{row.num}{wanted}" + f" ({row.num_failed} failed)" * bool(row.num_failed)
