"""A log's tables in Arrow's typed columns, from which Parquet files are made, and a table as a pandas DataFrame."""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from mjnav.errors import missing_extra
from mjnav.log.read.tables import Block, LogMessage, Table, blocks, not_ours

if TYPE_CHECKING:
    import pyarrow
    from pandas import DataFrame


def arrow_schema(table: Table) -> "pyarrow.Schema":
    """The types of a table's columns. Each field's metadata has its `unit`, and the schema's all `units` as JSON."""
    import pyarrow

    fields = [
        pyarrow.field(name, pyarrow.type_for_alias(column.type), metadata={"unit": column.unit})
        for name, column in table.columns.items()
    ]
    units = {name: column.unit for name, column in table.columns.items()}
    return pyarrow.schema(fields, metadata={"units": json.dumps(units)})


def arrow_batch(block: Block) -> "pyarrow.RecordBatch":
    """The rows of a block; null where a value is missing. Raises ValueError or TypeError for another type."""
    import pyarrow

    schema = arrow_schema(block.table)
    columns = [pyarrow.array(values, type=field.type) for values, field in zip(block.columns, schema, strict=True)]
    return pyarrow.record_batch(columns, schema=schema)


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

    with not_ours(path):
        batches = [arrow_batch(block) for block in blocks(path, [table], messages)]
    found = pyarrow.Table.from_batches(batches, schema=arrow_schema(table))
    nullable = {pyarrow.bool_(): pandas.BooleanDtype()}
    frame = found.to_pandas(types_mapper=nullable.get)
    frame.attrs["units"] = {name: column.unit for name, column in table.columns.items()}
    return frame
