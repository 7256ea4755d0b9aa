"""Text and tables on standard output: as wide as the terminal, and in a pipe one line a row."""

from collections.abc import Callable, Collection, Sequence
from typing import TYPE_CHECKING

from mjnav.cli.terminal import streams
from mjnav.printable import printable

if TYPE_CHECKING:
    from rich.console import Console

PIPE_WIDTH = 10_000  # [characters] where there is no terminal: no line is broken
GAP = 2


def print_table(rows: Sequence[Sequence[str]], heads: Sequence[str] = (), *, numbers: Collection[int] = ()) -> None:
    """Prints a table, in which the columns `numbers` are flush right; on a terminal its cells wrap."""
    if not rows:
        return
    rows = [[printable(cell) for cell in row] for row in rows]
    heads = heads or [""] * len(rows[0])
    if not streams.on_terminal():  # without rich, whose import and tables of hundreds of rows take longer than all else
        widths = [max(map(len, column)) for column in zip(heads, *rows, strict=True)]
        for row in [heads] * any(heads) + rows:
            cells = [f"{cell:{'>' if i in numbers else '<'}{widths[i]}}" for i, cell in enumerate(row)]
            print((" " * GAP).join(cells).rstrip())
        return
    from rich.table import Table

    table = Table(box=None, padding=(0, GAP, 0, 0), pad_edge=False, show_header=any(heads), header_style="bold")
    for i, head in enumerate(heads):
        table.add_column(head, justify="right" if i in numbers else "left", overflow="fold", no_wrap=i in (0, *numbers))
    for row in rows:
        table.add_row(*row)
    print_drawn(lambda console: console.print(table))


def print_lines(lines: Sequence[str]) -> None:
    """Prints lines."""
    for line in lines:
        print(line)


def print_drawn(draw: Callable[["Console"], None]) -> None:
    """Prints what is drawn on a rich console, without blanks at the ends of lines."""
    console = streams.console(width=PIPE_WIDTH)
    with console.capture() as captured:  # rich itself would end the process where the reader has gone
        draw(console)
    streams.show("".join(f"{line.rstrip()}\n" for line in captured.get().splitlines()))
