"""Tidy tables as Parquet: a file for each table that `csv_tables` writes, with the same columns and rows, typed.

Numbers are double precision, but for particles, samples of the cone and candidates' costs, which are single precision
in the log. A value that is missing is null. The metadata of each field has its `unit`; the file's key-value metadata
have the `units` of all columns as JSON, which DuckDB's parquet_kv_metadata shows. Columns are compressed with
Zstandard.
"""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

from pyarrow.parquet import ParquetWriter

from mjnav.log.read.data_frame import arrow_batch, arrow_schema
from mjnav.log.read.log import Log, LogMessage
from mjnav.log.read.tables import TABLES as TOPICS
from mjnav.log.read.tables import blocks


def write(log: Log, topics: Sequence[str], messages: Iterator[LogMessage], folder: Path) -> dict[str, int]:
    """The tables of these topics, an empty one where there were no messages; gives the number of rows in each."""
    folder.mkdir()
    tables = [table for topic in topics for table in TOPICS[topic]]
    counts = {f"{table.name}.parquet": 0 for table in tables}
    with ExitStack() as files:
        writers = {
            table.name: files.enter_context(
                ParquetWriter(folder / f"{table.name}.parquet", arrow_schema(table), compression="zstd")
            )
            for table in tables
        }
        for block in blocks(log.path, tables, messages):
            batch = arrow_batch(block)
            writers[block.table.name].write_batch(batch)
            counts[f"{block.table.name}.parquet"] += batch.num_rows
    return counts
