"""One table of a log as a pandas DataFrame."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from mjnav.errors import missing_extra
from mjnav.recording.read.tables import LogMessage, Table, blocks, not_ours

if TYPE_CHECKING:
    from pandas import DataFrame


def check_pandas() -> None:
    """Raises InputError where pandas or pyarrow is not installed."""
    for package in ("pandas", "pyarrow"):
        try:
            __import__(package)
        except ImportError:
            raise missing_extra(package, "pandas") from None


def data_frame(path: Path, table: Table, messages: Iterable[LogMessage]) -> "DataFrame":
    """The rows that these messages of the log at `path` give in the table; `attrs["units"]` has the units by column.

    Raises as `check_pandas`, and DamagedLogError where a message is not one of mjnav's.
    """
    check_pandas()
    import pandas
    import pyarrow

    from mjnav.recording.read.arrow_tables import arrow_batch, arrow_schema

    with not_ours(path):
        batches = [arrow_batch(block) for block in blocks(path, [table], messages)]
    found = pyarrow.Table.from_batches(batches, schema=arrow_schema(table))
    nullable = {pyarrow.bool_(): pandas.BooleanDtype()}
    frame = found.to_pandas(types_mapper=nullable.get)
    frame.attrs["units"] = {name: column.unit for name, column in table.columns.items()}
    return frame
