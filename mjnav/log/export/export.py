"""A log as a folder that other programs read, in one of FORMATS: all of the folder or nothing of it.

Tidy tables have a file for each kind of row, a row for each observation, a column for each figure.

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
import os
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from mjnav.errors import InputError, of_extra, unknown_name
from mjnav.log.log_format import appearing, check_folder
from mjnav.log.read.log import Log
from mjnav.log.read.tables import TABLES, Block, LogMessage, Table, arrow_batch, arrow_schema, blocks, not_ours

# --------------------------------------------------------------------------------------------- tables


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


# -------------------------------------------------------------------------------------------- formats


@dataclass(frozen=True, slots=True)
class Format:
    """How a log is written in a format.

    `write` fills a folder from the messages of some `topics`, all unless the user chooses `by_topic`, and gives the
    number of what it `counts` in each file or topic. `needs` names a package, and the extra that brings it.
    """

    write: Callable[[Log, Sequence[str], Iterator[LogMessage], Path], dict[str, int]]
    topics: Collection[str]
    counts: str
    by_topic: bool = False
    needs: tuple[str, str] | None = None


def _write_bag(log: Log, topics: Sequence[str], messages: Iterator[LogMessage], folder: Path) -> dict[str, int]:
    from mjnav.log.export.rosbag2 import write

    return write(log, messages, folder)


FORMATS: Mapping[str, Format] = MappingProxyType(
    {
        "csv": Format(write_csv, TOPICS, "rows", by_topic=True),
        "parquet": Format(write_parquet, TOPICS, "rows", by_topic=True, needs=("pyarrow", "pandas")),
        "rosbag2": Format(_write_bag, (*TOPICS, "/scene"), "messages", needs=("rosbags", "ros2")),
    }
)


def check_format(name: str, topics: Iterable[str] = ()) -> None:
    """Raises InputError where there is no such format, what it needs is not installed, or it knows none of a topic."""
    if name not in FORMATS:
        raise unknown_name("--format", name, FORMATS)
    if (needs := FORMATS[name].needs) is not None:
        with of_extra(*needs):
            __import__(needs[0])
    for topic in topics:
        if topic not in FORMATS[name].topics:
            raise unknown_name("--topic", topic, FORMATS[name].topics)


def export(
    log: Log,
    form: str,
    path: Path,
    *,
    topics: Iterable[str] = (),
    progress: Callable[[float], None] = lambda time: None,
) -> dict[str, int]:
    """Writes a log, or some of its topics, as the new folder `path`.

    Gives the number of rows or messages by file or topic. `progress` is told the simulated time so far [s]; what
    it raises ends the export. After any exception nothing of the folder is left. Raises InputError where mjnav did not
    write the log or it holds no messages, and as `check_format` and `check_new_folder` do; DamagedLogError where a
    message is not one of mjnav's; MjnavError where the folder cannot be written.
    """
    chosen = tuple(dict.fromkeys(topics))
    check_format(form, chosen)
    target = check_new_folder(path)
    log.check_ours()
    if log.duration is None:
        raise InputError(f"{log.path}: holds no messages to export")
    chosen = chosen or tuple(FORMATS[form].topics)
    with appearing(target) as folder, not_ours(log.path):
        return FORMATS[form].write(log, chosen, _reported(log.messages(*chosen), progress), folder)


def _reported(messages: Iterator[LogMessage], progress: Callable[[float], None]) -> Iterator[LogMessage]:
    first = None
    for message in messages:
        first = message.time_ns if first is None else first
        progress(1e-9 * (message.time_ns - first))
        yield message


def check_new_folder(path: str | os.PathLike[str]) -> Path:
    """The path of a folder that could be made, or that is there and empty; creates nothing.

    Raises InputError where there is anything else, or the folder around it is missing or not writable.
    """
    given, path = path, Path(os.path.abspath(path))
    if path.is_symlink() or (path.exists() and not (path.is_dir() and not any(path.iterdir()))):
        raise InputError(f"{given}: exists already, and an export never replaces anything; choose another name")
    check_folder(given, path.parent)
    return path
