"""A log's tables in Arrow's typed columns, from which Parquet files and data frames are made."""

import json

import pyarrow

from mjnav.recording.read.tables import Block, Table


def arrow_schema(table: Table) -> pyarrow.Schema:
    """The types of a table's columns. Each field's metadata has its `unit`, and the schema's all `units` as JSON."""
    fields = [
        pyarrow.field(name, pyarrow.type_for_alias(column.type), metadata={"unit": column.unit})
        for name, column in table.columns.items()
    ]
    units = {name: column.unit for name, column in table.columns.items()}
    return pyarrow.schema(fields, metadata={"units": json.dumps(units)})


def arrow_batch(block: Block) -> pyarrow.RecordBatch:
    """The rows of a block; null where a value is missing. Raises ValueError or TypeError for another type."""
    schema = arrow_schema(block.table)
    columns = [pyarrow.array(values, type=field.type) for values, field in zip(block.columns, schema, strict=True)]
    return pyarrow.record_batch(columns, schema=schema)
