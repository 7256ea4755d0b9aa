"""Text and tables on standard output: as wide as the terminal, and in a pipe one line a row."""

import textwrap
from collections.abc import Callable, Collection, Iterator, Sequence
from typing import TYPE_CHECKING

from mjnav.cli.terminal import streams

if TYPE_CHECKING:
    from rich.console import Console

PIPE_WIDTH = 10_000  # [characters] where there is no terminal: no line is broken
LEAST = 14  # [characters] that a column beside the first wants; a terminal too narrow for that gets no columns
GAP = 2


def width() -> int:
    """Of the terminal [characters], or PIPE_WIDTH."""
    return streams.console().width if streams.on_terminal() else PIPE_WIDTH


def print_table(rows: Sequence[Sequence[str]], heads: Sequence[str] = (), *, numbers: Collection[int] = ()) -> None:
    """Prints a table; where the terminal is narrow, columns wrap, but not the first nor those of `numbers`.

    Where it is too narrow for all columns, each row becomes a paragraph: its first cell, a line for each other one, and
    one for all numbers.
    """
    from rich.cells import cell_len, set_cell_size

    if not rows:
        return
    rows = [[streams.as_held(cell) for cell in row] for row in rows]
    heads = heads or [""] * len(rows[0])
    widths = [max(map(cell_len, column)) for column in zip(heads, *rows, strict=True)]
    least = [size if i == 0 or i in numbers else min(size, LEAST) for i, size in enumerate(widths)]
    room = width()
    if room == PIPE_WIDTH:  # without rich, whose tables of hundreds of rows take longer than all else
        for row in [heads] * any(heads) + rows:
            cells = [
                " " * (widths[i] - cell_len(cell)) + cell if i in numbers else set_cell_size(cell, widths[i])
                for i, cell in enumerate(row)
            ]
            print((" " * GAP).join(cells).rstrip())
        return
    if sum(least) + GAP * (len(least) - 1) > room:
        for row in rows:
            print("\n".join(_paragraph(row, heads, numbers, room)))
        return
    from rich.table import Table

    table = Table(box=None, padding=(0, GAP, 0, 0), pad_edge=False, show_header=any(heads), header_style="bold")
    for i, head in enumerate(heads):
        whole = least[i] == widths[i]
        table.add_column(
            head,
            justify="right" if i in numbers else "left",
            overflow="fold",
            no_wrap=whole and (i == 0 or i in numbers),
            min_width=least[i],
        )
    for row in rows:
        table.add_row(*row)
    print_drawn(lambda console: console.print(table))


def _paragraph(row: Sequence[str], heads: Sequence[str], numbers: Collection[int], room: int) -> Iterator[str]:
    yield row[0]
    lines = [
        f"{heads[i]}: {cell}" if heads[i] else cell for i, cell in enumerate(row) if cell and i not in {0, *numbers}
    ]
    lines.append(", ".join(f"{heads[i]} {row[i]}" for i in sorted(numbers)))
    for line in lines:
        yield from textwrap.wrap(line, room, initial_indent="    ", subsequent_indent="      ")


def print_lines(lines: Sequence[str]) -> None:
    """Prints lines; on a terminal, one that is too long goes on below its second column."""
    room = width()
    for line in lines:
        print("\n".join(_wrapped(line, room)))


def _wrapped(line: str, room: int) -> Sequence[str]:
    if len(line) <= room:
        return [line]
    start = len(line) - len(line.lstrip())
    _, _, second = line[start:].partition("  ")
    second = second.lstrip()
    indent = min(len(line) - len(second) if second else start + 2, room // 2)
    return textwrap.wrap(line, room, subsequent_indent=" " * indent, break_long_words=False, break_on_hyphens=False)


def print_drawn(draw: Callable[["Console"], None]) -> None:
    """Prints what is drawn on a rich console, without blanks at the ends of lines."""
    console = streams.console(width=PIPE_WIDTH)
    with console.capture() as captured:  # rich itself would end the process where the reader has gone
        draw(console)
    streams.show("".join(f"{line.rstrip()}\n" for line in captured.get().splitlines()))
