"""The rows of a log's tables, some thousand at a time: what CSV files, Parquet files and data frames are made of."""

import struct
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from mjnav.errors import DamagedLogError, unknown_name
from mjnav.recording.read.budget import EXPORT, FREE_EXPORT, Budget
from mjnav.recording.read.log_topic import LogMessage
from mjnav.recording.read.tables import TABLES, Table
from mjnav.recording.read.ticks import NOT_OURS

BLOCK = 16_384  # rows
_TEXT = 1 << 20  # characters, beyond which a block is smaller: every row may hold a long text of its own
_NUMBER_SIZE = 20  # [bytes] of a number


class Block(NamedTuple):
    """Rows of one table as columns, each a list with a value a row; a value that is missing is None."""

    table: Table
    columns: Sequence[Sequence[Any]]


class _Rows:
    """Rows of one table that wait to become a block."""

    def __init__(self, table: Table):
        self._table = table
        self._texts = [i for i, column in enumerate(table.columns.values()) if column.type == "string"]
        self._rows: list[tuple] = []
        self._characters = 0

    def __len__(self) -> int:
        return len(self._rows)

    @property
    def full(self) -> bool:
        return len(self._rows) >= BLOCK or self._characters > _TEXT

    def add(self, row: tuple) -> None:
        """Raises ValueError for a row that has not a value for each column."""
        if len(row) != len(self._table.columns):
            raise ValueError(f"{self._table.name}: {len(row)} values for {len(self._table.columns)} columns")
        self._rows.append(row)
        self._characters += sum(len(row[i]) for i in self._texts if isinstance(row[i], str))

    def block(self, budget: Budget, path: Path) -> Block:
        """All rows, which are gone afterwards."""
        columns = list(zip(*self._rows, strict=True))
        numbers = len(self._rows) * (len(columns) - len(self._texts))
        if not budget.allows_export(self._characters + _NUMBER_SIZE * numbers):
            what = f"{FREE_EXPORT} bytes and {EXPORT} for each of the log's"
            raise DamagedLogError(f"{path}: damaged: its tables would take more than {what}")
        self._rows, self._characters = [], 0
        return Block(self._table, columns)


def blocks(path: Path, tables: Iterable[Table], messages: Iterable[LogMessage]) -> Iterator[Block]:
    """The rows that these messages of the log at `path` give in these tables, in their order.

    Raises DamagedLogError where they would take more room than a log of its size can fill, and what `not_ours` turns
    into a DamagedLogError where a message is not one of mjnav's.
    """
    budget = Budget(path.stat().st_size)
    waiting = {table.name: _Rows(table) for table in tables}
    chosen = {
        topic: [(table, waiting[table.name]) for table in found if table.name in waiting]
        for topic, found in TABLES.items()
    }
    for message in messages:
        first = (message.sequence, message.time_ns / 1e9)
        for table, rows in chosen[message.topic]:
            for row in table.rows(message.value):
                rows.add((*first, *row))
                if rows.full:
                    yield rows.block(budget, path)
    for rows in waiting.values():
        if rows:
            yield rows.block(budget, path)


@contextmanager
def not_ours(path: Path) -> Iterator[None]:
    """Turns what a message that mjnav did not write raises into a DamagedLogError of one line."""
    try:
        yield
    except DamagedLogError:
        raise
    except (*NOT_OURS, struct.error) as error:
        raise DamagedLogError(f"{path}: holds a message that is not one of mjnav's ({error!r})") from error


def find_table(name: str) -> tuple[str, Table]:
    """The topic and the table of this name; of a topic's name its first table. Raises InvalidValue with the nearest."""
    found = {table.name: (topic, table) for topic, tables in TABLES.items() for table in tables}
    found |= {topic: (topic, tables[0]) for topic, tables in TABLES.items()}
    if name not in found:
        raise unknown_name("table", name, found)
    return found[name]
