"""Comparisons for a terminal: columns that do not fit side by side go below one another, under the same methods.

The win ratios of every two methods are a table in which a row is compared with a column; `win_ratio_between` and
`shown_between` give its entries in the same way to text, LaTeX and HTML.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from rich.cells import cell_len
from rich.console import Console
from rich.table import Table
from rich.text import Text

from mjnav.printable import printable
from mjnav.report.comparison.notes import layouts, meaning, sight, warnings
from mjnav.report.comparison.shown import Shown, ShownCell, shown_table, shown_wins
from mjnav.study.compare.compare import Comparison
from mjnav.study.compare.estimates import WinRatio
from mjnav.study.compare.study_comparison import StudyComparison

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


GAP = 2  # [characters] between columns
MAX_LABEL = 0.4  # of the width; longer labels are folded


@dataclass(frozen=True, slots=True)
class _Printed:
    """A column, its cells of one or two lines."""

    title: str
    cells: tuple[Text, ...]

    @property
    def width(self) -> int:
        return max(cell_len(line) for text in (self.title, *map(str, self.cells)) for line in text.split("\n"))


def write(results: StudyComparison, console: Console) -> None:
    """All tables, then what they mean and what is missing."""
    results = results.labelled
    for table in results.tables:
        reference = f"reference {table.reference}" if table.reference else ""
        known = filter(None, (layouts(table.num_layouts), sight(table.people), reference))
        about = "".join(f"; {printable(part)}" for part in known)
        console.print(Text(f"{printable(table.scene)}, {printable(table.setting)}", "bold").append(about, "not bold"))
        write_table(results, table, console)
        if table.rivals:
            console.print(f"\n{ABOUT}", style="bold")
            _write_columns(*_rivals(table), console=console)
        console.print()
    for sentence in meaning(results):
        console.print(sentence, style="dim")
    for sentence in warnings(results):
        console.print(sentence, style="bold")


def write_table(results: StudyComparison, table: Comparison, console: Console) -> None:
    """One table."""
    _write_columns(*_columns(results, table), console=console)


def _write_columns(label: _Printed, *others: _Printed, console: Console) -> None:
    for band in _bands(label, others, console.width):
        console.print(_table(label, band, console.width))


def _columns(results: StudyComparison, table: Comparison) -> Iterator[_Printed]:
    shown = shown_table(results, table)
    yield _Printed("method", tuple(Text(printable(row.method)) for row in shown.rows))
    yield _Printed("n", tuple(Text(row.episodes) for row in shown.rows))
    for i, title in enumerate(shown.titles):
        yield _Printed(title, tuple(_text(row.cells[i]) for row in shown.rows))


def _rivals(table: Comparison) -> Iterator[_Printed]:
    methods = [row.method for row in table.rows]
    yield _Printed("method", tuple(Text(printable(method)) for method in methods))
    for other in methods:
        cells = [shown_between(table, method, other) for method in methods]
        yield _Printed(printable(other), tuple(Text(str(cell), "bold" if cell.marked else "") for cell in cells))


def _text(cell: ShownCell) -> Text:
    """A method's own figure, and below it the difference."""
    text = Text(str(cell.own))
    if cell.below is not None:
        text.append(f"\n{cell.below}", "bold" if cell.below.marked else "dim")
    return text


def _label_width(label: _Printed, width: int) -> int:
    return min(label.width, max(int(MAX_LABEL * width), len(label.title)))


def _bands(label: _Printed, others: Sequence[_Printed], width: int) -> Iterator[list[_Printed]]:
    """As many columns as fit beside the label, then the next."""
    band: list[_Printed] = []
    left = free = width - _label_width(label, width)
    for column in others:
        if band and left < GAP + column.width:
            yield band
            band, left = [], free
        band.append(column)
        left -= GAP + column.width
    yield band


def _table(label: _Printed, band: list[_Printed], width: int) -> Table:
    table = Table(box=None, padding=(0, GAP, 0, 0), pad_edge=False, header_style="underline")
    table.add_column(label.title, overflow="fold", max_width=_label_width(label, width))
    for column in band:
        table.add_column(column.title, no_wrap=True, overflow="ignore", min_width=column.width)
    for cells in zip(label.cells, *(column.cells for column in band), strict=True):
        table.add_row(*cells)
    return table
