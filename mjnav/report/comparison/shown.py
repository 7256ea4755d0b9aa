"""The figures of a comparison as they are printed, the same in text, LaTeX and HTML.

A column has as many decimals as its narrowest interval needs for one digit of its half width: 12.34 [11.82, 12.91],
and the difference +0.61 [+0.20, +1.10] below it, or the ratio of a cost ×0.95 [0.91, 0.99]. Ratios have three digits.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from math import floor, isfinite, isnan, log10, nan

from mjnav.study.compare.chosen_figures import RATES, is_cost, is_rate
from mjnav.study.compare.compare import Comparison, MethodRow
from mjnav.study.compare.estimates import Difference, Estimate, WinRatio
from mjnav.study.compare.study_comparison import StudyComparison

ALPHA = 0.05  # below it a difference is marked
MAX_DECIMALS = 6
NEGLIGIBLE = 1e-4  # of the widest interval: what is narrower is rounding
DASH = "-"
NEVER = "\N{INFINITY}"  # the win ratio of a method that lost no pair
WINS = "win_ratio"
PLAIN = ("infeasible %", "decision ms", "decision p99 ms")  # titles of the columns without intervals


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
    as_ratio: bool = False  # whether `below` is of the difference's ratio


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
    ratios: bool  # whether ratios are shown below costs

    def cell(self, row: MethodRow) -> ShownCell:
        """The method's own figure and its difference from the reference."""
        e, found = row.figures[self.figure], row.differences.get(self.figure)
        own = self._shown(e, row.num, "")
        if found is None:
            return ShownCell(self.figure, own, e.value, e)
        as_ratio, marked = self.ratios and is_cost(self.figure), is_marked(found.p)
        if as_ratio:
            below = shown_ratio(found.ratio, row.num, "×", marked=marked)
        else:
            below = self._shown(found.estimate, row.num, "+", marked=marked)
        return ShownCell(self.figure, own, e.value, e, below, found, as_ratio)

    def _shown(self, e: Estimate, num: int, sign: str, *, marked: bool = False) -> Shown:
        count = f"({e.num})" if e.num != num else ""
        if not isfinite(e.value):
            return Shown(DASH, count=count)
        low_high = [self._number(end, sign) for end in e.interval or ()]
        return Shown(self._number(e.value, sign), f"[{', '.join(low_high)}]" * bool(low_high), count, marked)

    def _number(self, value: float, sign: str) -> str:
        rounded = round(self.scale * value, self.decimals) + 0.0  # no -0.0
        return f"{rounded:{sign if rounded else ''}.{self.decimals}f}"


def is_marked(p: float | None) -> bool:
    """Whether a p-value gets a mark."""
    return p is not None and p < ALPHA


def shown_ratio(e: Estimate | None, num: int, sign: str = "", *, marked: bool = False) -> Shown:
    """A ratio: 0.953 [0.912, 0.995]; `num` is how many seeds the row has."""
    if e is None or isnan(e.value):
        return Shown(DASH, count="" if e is None or e.num == num else f"({e.num})")
    interval = "" if e.interval is None else f"[{', '.join(map(_digits, e.interval))}]"
    return Shown(sign + _digits(e.value), interval, f"({e.num})" if e.num != num else "", marked)


def _digits(ratio: float) -> str:
    if not isfinite(ratio):
        return NEVER
    return f"{ratio:.{0 if ratio >= 100.0 else 1 if ratio >= 10.0 else 2 if ratio >= 1.0 else 3}f}"


def shown_wins(wins: WinRatio, num: int) -> Shown:
    """A win ratio."""
    return shown_ratio(of_wins(wins), num, marked=is_marked(wins.p))


def of_wins(wins: WinRatio) -> Estimate:
    """A win ratio as an estimate: its value and interval, and of how many pairs."""
    return Estimate(wins.value, wins.interval, wins.pairs)


def shown_table(results: StudyComparison, table: Comparison) -> ShownTable:
    """All figures of a table: rates, what has no interval, and the figures asked for."""
    rates, figures = _columns(table, RATES), _columns(table, results.figures, ratios=results.ratios)
    compared = any(row.wins is not None for row in table.rows)
    rows = []
    for row in table.rows:
        plain = (
            ShownCell("infeasible_share", _plain(row.infeasible_share, 100.0, 1), row.infeasible_share),
            ShownCell("decision_ms", _plain(row.decision_ms, 1.0, 2), row.decision_ms),
            ShownCell("decision_p99_ms", _plain(row.decision_p99_ms, 1.0, 2), row.decision_p99_ms),
        )
        wins = [_wins(row)] if compared else []
        cells = (*(column.cell(row) for column in rates), *wins, *plain, *(column.cell(row) for column in figures))
        missing = results.missing[table.scene, table.setting, row.method]
        rows.append(ShownRow(row.method, _episodes(row, missing), cells))
    first = [WINS] if compared else []
    titles = (*(column.title for column in rates), *first, *PLAIN, *(column.title for column in figures))
    names = (*RATES, *first, "infeasible_share", "decision_ms", "decision_p99_ms", *results.figures)
    return ShownTable(titles, names, tuple(rows))


def _wins(row: MethodRow) -> ShownCell:
    if row.wins is None:
        return ShownCell(WINS, Shown(""), nan)
    return ShownCell(WINS, shown_wins(row.wins, row.num), row.wins.value, of_wins(row.wins))


def _plain(value: float, scale: float, decimals: int) -> Shown:
    return Shown(f"{scale * value:.{decimals}f}" if isfinite(value) else DASH)


def _columns(table: Comparison, figures: Iterable[str], *, ratios: bool = False) -> list[_Column]:
    found = []
    for figure in figures:
        scale = 100.0 if is_rate(figure) else 1.0
        title = f"{figure} %" if is_rate(figure) else figure
        found.append(_Column(figure, title, _decimals(table, figure, scale), scale, ratios))
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
