"""Tables on standard output: as wide as the terminal, and in a pipe one line a row."""

import textwrap
from collections.abc import Iterator, Sequence

from mjnav.cli.terminal import streams

PIPE_WIDTH = 10_000  # [characters] where there is no terminal: no line is broken
LEAST = 14  # [characters] that a column beside the first wants; a terminal too narrow for that gets no columns
GAP = 2


def print_table(rows: Sequence[Sequence[str]], heads: Sequence[str] = ()) -> None:
    """Prints a table whose first column is never broken; the others wrap where the terminal is narrow.

    Where it is too narrow for all columns, each row becomes a paragraph: its first cell, and a line for each other one.
    """
    from rich.table import Table

    if not rows:
        return
    console = streams.console(width=PIPE_WIDTH)
    columns = [[head, *(row[i] for row in rows)] for i, head in enumerate(heads or [""] * len(rows[0]))]
    widths = [max(map(len, column)) for column in columns]
    if widths[0] + sum(min(width, LEAST) + GAP for width in widths[1:]) > console.width:
        for row in rows:
            print("\n".join(_paragraph(row, heads, console.width)))
        return
    table = Table(box=None, pad_edge=False, show_edge=False, show_header=bool(heads), header_style="bold")
    for i, head in enumerate(heads or [""] * len(widths)):
        table.add_column(head, overflow="fold", no_wrap=i == 0, min_width=min(widths[i], LEAST))
    for row in rows:
        table.add_row(*row)
    print_renderable(table)


def _paragraph(row: Sequence[str], heads: Sequence[str], width: int) -> Iterator[str]:
    yield row[0]
    for i, cell in enumerate(row[1:], start=1):
        if cell:
            text = f"{heads[i]}: {cell}" if heads else cell
            yield from textwrap.wrap(text, width, initial_indent="    ", subsequent_indent="      ")


def print_renderable(renderable: object) -> None:
    """Prints what rich can draw, without blanks at the ends of lines."""
    console = streams.console(width=PIPE_WIDTH)
    with console.capture() as captured:  # rich itself would end the process where the reader has gone
        console.print(renderable)
    streams.show("".join(f"{line.rstrip()}\n" for line in captured.get().splitlines()))
