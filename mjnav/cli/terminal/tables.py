"""Tables on standard output: as wide as the terminal, and in a pipe one line a row."""

from collections.abc import Collection, Sequence

from mjnav.cli.terminal import streams

PIPE_WIDTH = 10_000  # [characters] where there is no terminal: no line is broken
MIN_COLUMN = 8  # [characters] that a column keeps in a narrow terminal


def print_table(rows: Sequence[Sequence[str]], heads: Sequence[str] = (), *, whole: Collection[int] = (0,)) -> None:
    """Prints a table. The columns in `whole` are never broken; the others wrap where the terminal is narrow."""
    from rich.table import Table

    table = Table(box=None, pad_edge=False, show_edge=False, show_header=bool(heads), header_style="bold")
    for column in range(len(rows[0]) if rows else 0):
        least = None if column in whole else MIN_COLUMN
        head = heads[column] if heads else ""
        table.add_column(head, overflow="fold", no_wrap=column in whole, min_width=least)
    for row in rows:
        table.add_row(*row)
    print_renderable(table)


def print_renderable(renderable: object) -> None:
    """Prints what rich can draw, without blanks at the ends of lines."""
    console = streams.console(width=PIPE_WIDTH)
    with console.capture() as captured:  # rich itself would end the process where the reader has gone
        console.print(renderable)
    streams.show("".join(f"{line.rstrip()}\n" for line in captured.get().splitlines()))
