"""Exports a log as tidy tables: a file for each kind of row, a row for each observation, a column for each figure.

Every table begins with the number of the tick and the simulated time, by which tables join. Particles, the cone's
samples and candidates' costs are float32 in the log and here.

CSV: columns.csv has the unit of each column of each table. Numbers are the shortest decimals that read back as the same
number: pandas 3 reads them exactly, earlier versions with `read_csv(..., float_precision="round_trip")`. A value that
is missing or not finite in a JSON message is an empty field. A text that a spreadsheet would take for a formula has an
apostrophe before it (`neutral`).

Parquet: the same columns and rows, typed. A value that is missing is null. The metadata of each field has its `unit`;
the file's key-value metadata have the `units` of all columns as JSON, which DuckDB's parquet_kv_metadata shows. Columns
are compressed with Zstandard.
"""

import csv
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from mjnav.log.read.log import Log
from mjnav.log.read.tables import TABLES, Block, LogMessage, Table, arrow_batch, arrow_schema, blocks

STARTS = ("=", "+", "-", "@", "\t", "\r", "\n", "＝", "＋", "－", "＠")  # of a formula (OWASP, CSV injection)
TOPICS = tuple(TABLES)


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


def write_csv(log: Log, topics: Sequence[str], messages: Iterator[LogMessage], folder: Path) -> dict[str, int]:
    """The tables of these topics, an empty one where there were no messages; gives the number of rows in each."""

    def opened(files: ExitStack, path: Path, table: Table) -> Callable[[Block], None]:
        writer = _csv_writer(files, path, table.columns)
        return lambda block: writer.writerows(zip(*_cells(block), strict=True))

    counts = _write(log, topics, messages, folder, ".csv", opened)
    with ExitStack() as files:
        units = _csv_writer(files, folder / "columns.csv", ("table", "column", "unit"))
        for table in _tables(topics):
            units.writerows((table.name, name, column.unit) for name, column in table.columns.items())
    return counts


def _csv_writer(files: ExitStack, path: Path, header: Iterable[str]) -> Any:
    writer = csv.writer(files.enter_context(path.open("x", encoding="utf-8", newline="")), lineterminator="\n")
    writer.writerow(header)
    return writer


def write_parquet(log: Log, topics: Sequence[str], messages: Iterator[LogMessage], folder: Path) -> dict[str, int]:
    """As `write_csv`."""
    from pyarrow.parquet import ParquetWriter

    def opened(files: ExitStack, path: Path, table: Table) -> Callable[[Block], None]:
        writer = files.enter_context(ParquetWriter(path, arrow_schema(table), compression="zstd"))
        return lambda block: writer.write_batch(arrow_batch(block))

    return _write(log, topics, messages, folder, ".parquet", opened)


def _tables(topics: Sequence[str]) -> list[Table]:
    return [table for topic in topics for table in TABLES[topic]]


def _write(
    log: Log,
    topics: Sequence[str],
    messages: Iterator[LogMessage],
    folder: Path,
    suffix: str,
    opened: Callable[[ExitStack, Path, Table], Callable[[Block], None]],
) -> dict[str, int]:
    """Fills a folder with files that `opened` makes, each with what writes a block of its rows."""
    folder.mkdir()
    tables = _tables(topics)
    counts = {f"{table.name}{suffix}": 0 for table in tables}
    with ExitStack() as files:
        writers = {table.name: opened(files, folder / f"{table.name}{suffix}", table) for table in tables}
        for block in blocks(log.path, tables, messages):
            writers[block.table.name](block)
            counts[f"{block.table.name}{suffix}"] += len(block.columns[0])
    return counts


def _cells(block: Block) -> Iterator[Iterable[Any]]:
    """The columns as they are written; a number in single precision as the shortest text that reads back as it."""
    for column, values in zip(block.table.columns.values(), block.columns, strict=True):
        if column.type == "float32":
            yield np.array(values, "<f4").astype("U").tolist()
        else:
            yield map(neutral, values)
