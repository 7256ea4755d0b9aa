"""Exports a log as tidy CSV tables: a file for each kind of row, a row for each observation, a column for each figure.

Every table begins with the number of the tick and the simulated time, by which tables join. columns.csv has the unit of
each column of each table. Numbers are the shortest decimals that read back as the same number: pandas 3 reads them
exactly, earlier versions with `read_csv(..., float_precision="round_trip")`. Particles and the cone's samples are
float32 in the log and here. A value that is missing or not finite in a JSON message is an empty field. A text that a
spreadsheet would take for a formula has an apostrophe before it (`neutral`).
"""

import csv
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from mjnav.log.read.log import Log, LogMessage
from mjnav.log.read.tables import TABLES as TOPICS
from mjnav.log.read.tables import Block, blocks

STARTS = ("=", "+", "-", "@", "\t", "\r", "\n", "＝", "＋", "－", "＠")  # of a formula (OWASP, CSV injection)


def neutral(value: object) -> object:
    """The cell; a text that a spreadsheet would run as a formula gets an apostrophe before it, a number does not.

    No name of mjnav's begins like a formula, so this needs no option.
    """
    if not isinstance(value, str) or not value.startswith(STARTS):
        return value
    try:
        float(value)
    except ValueError:
        return f"'{value}"
    return value


def write(log: Log, topics: Sequence[str], messages: Iterator[LogMessage], folder: Path) -> dict[str, int]:
    """The tables of these topics, an empty one where there were no messages; gives the number of rows in each."""
    folder.mkdir()
    tables = [table for topic in topics for table in TOPICS[topic]]
    counts = {f"{table.name}.csv": 0 for table in tables}
    with ExitStack() as files:

        def begin(name: str, *columns: str) -> Any:
            file = files.enter_context(open(folder / f"{name}.csv", "x", encoding="utf-8", newline=""))
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(columns)
            return writer

        units = begin("columns", "table", "column", "unit")
        for table in tables:
            units.writerows((table.name, name, column.unit) for name, column in table.columns.items())
        writers = {table.name: begin(table.name, *table.columns) for table in tables}
        for block in blocks(log.path, tables, messages):
            writers[block.table.name].writerows(zip(*_cells(block), strict=True))
            counts[f"{block.table.name}.csv"] += len(block.columns[0])
    return counts


def _cells(block: Block) -> Iterator[Iterable[Any]]:
    """The columns as they are written; a number in single precision as the shortest text that reads back as it."""
    for column, values in zip(block.table.columns.values(), block.columns, strict=True):
        if column.type == "float32":
            yield np.array(values, "<f4").astype("U").tolist()
        else:
            yield map(neutral, values)
