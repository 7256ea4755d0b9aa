"""Tidy tables: a CSV file for each kind of row, a row for each thing observed, a column for each of its figures.

Every table begins with the number of the tick and the simulated time, by which tables join. columns.csv has the unit of
each column of each table. Numbers are the shortest decimals that read back as the same number: pandas 3 reads them
exactly, earlier versions with `read_csv(..., float_precision="round_trip")`. Particles and the cone's samples are
float32 in the log and here. A value that is missing or not finite in a JSON message is an empty field. A text that a
spreadsheet would take for a formula has an apostrophe before it.
"""

import csv
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import IO, Any

from mjnav.errors import DamagedLogError
from mjnav.recording.export.csv_cells import neutral
from mjnav.recording.export.tables import TABLES as TOPICS
from mjnav.recording.read.budget import EXPORT, FREE_EXPORT, Budget
from mjnav.recording.read.log import Log, LogMessage

_FIRST = {"tick": "", "time": "s"}


class _Metered:
    """A text file that takes no more than the budget allows. Raises DamagedLogError."""

    def __init__(self, file: IO[str], budget: Budget, log: Path):
        self._file, self._budget, self._log = file, budget, log

    def write(self, text: str) -> int:
        """Writes the text."""
        if not self._budget.allows_export(len(text)):
            what = f"{FREE_EXPORT} bytes and {EXPORT} for each of the log's"
            raise DamagedLogError(f"{self._log}: damaged: its tables would take more than {what}")
        return self._file.write(text)


def write(log: Log, topics: Sequence[str], messages: Iterator[LogMessage], folder: Path) -> dict[str, int]:
    """The tables of these topics, an empty one where there were no messages; gives the number of rows in each."""
    folder.mkdir()
    tables = [table for topic in topics for table in TOPICS[topic]]
    counts = {f"{table.name}.csv": 0 for table in tables}
    budget = Budget(log.path.stat().st_size)
    with ExitStack() as files:

        def begin(name: str, *columns: str) -> Any:
            file = files.enter_context(open(folder / f"{name}.csv", "x", encoding="utf-8", newline=""))
            writer = csv.writer(_Metered(file, budget, log.path), lineterminator="\n")
            writer.writerow(columns)
            return writer

        units = begin("columns", "table", "column", "unit")
        for table in tables:
            units.writerows((table.name, *column) for column in (*_FIRST.items(), *table.columns.items()))
        writers = {table.name: begin(table.name, *_FIRST, *table.columns) for table in tables}
        for message in messages:
            first = (message.sequence, message.time_ns / 1e9)
            for table in TOPICS[message.topic]:
                for row in table.rows(message.value):
                    writers[table.name].writerow((*first, *map(neutral, row)))
                    counts[f"{table.name}.csv"] += 1
    return counts
