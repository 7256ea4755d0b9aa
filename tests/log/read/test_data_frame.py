"""A log's tables as data frames and Parquet files: the values, types and units that the CSV files have."""

import json
import math
import subprocess
import sys

import duckdb
import numpy as np
import pandas as pd
import pyarrow.parquet
import pytest

from mjnav.errors import InputError
from mjnav.log import open_log
from mjnav.log.export.export import export
from mjnav.log.read.tables import TABLES

NAMES = [table.name for tables in TABLES.values() for table in tables]


@pytest.fixture(scope="module")
def log(recorded):
    return open_log(recorded)


@pytest.fixture(scope="module")
def folders(log, tmp_path_factory):
    """The CSV files and the Parquet files of one log."""
    path = tmp_path_factory.mktemp("tables")
    for form in ("csv", "parquet"):
        export(log, form, path / form)
    return path


def values(frame: pd.DataFrame) -> list[list]:
    """Rows of plain values, None for what is missing."""
    missing = frame.isna().to_numpy()
    cells = [column.tolist() for _, column in frame.astype(object).items()]
    return [
        [None if missing[i, j] else row[j] for j in range(len(row))] for i, row in enumerate(zip(*cells, strict=True))
    ]


@pytest.mark.parametrize("name", NAMES)
def test_a_table_is_the_same_from_python_csv_parquet_and_duckdb(log, folders, name):
    frame = log.table(name)
    typed = {"boolean": "boolean", "float32": "float32"}
    kinds = {column: typed[str(kind)] for column, kind in frame.dtypes.items() if str(kind) in typed}
    csv = pd.read_csv(folders / "csv" / f"{name}.csv", dtype=kinds)
    assert list(frame.columns) == list(csv.columns)
    texts = [column for column, kind in frame.dtypes.items() if str(kind) == "str"]
    csv[texts] = csv[texts].astype("str").fillna("")  # an empty text and a missing one are the same in CSV
    assert values(frame) == values(csv)
    path = folders / "parquet" / f"{name}.parquet"
    parquet = pd.read_parquet(path)
    assert values(parquet) == values(frame)
    rows = duckdb.sql(f"from '{path}'").fetchall()
    found = [[None if isinstance(v, float) and math.isnan(v) else v for v in row] for row in rows]
    assert found == values(frame)


def test_units_are_in_the_frame_in_each_field_and_in_the_file(log, folders):
    frame, path = log.table("/command"), folders / "parquet" / "command.parquet"
    assert frame.attrs["units"] == {"tick": "", "time": "s", "v": "m/s", "omega": "rad/s"}
    schema = pyarrow.parquet.read_schema(path)
    assert {field.name: field.metadata[b"unit"].decode() for field in schema} == frame.attrs["units"]
    assert [str(field.type) for field in schema] == ["int64", "double", "double", "double"]
    query = f"select decode(value) from parquet_kv_metadata('{path}') where decode(key) = 'units'"
    assert json.loads(duckdb.sql(query).fetchall()[0][0]) == frame.attrs["units"]
    assert str(pyarrow.parquet.read_schema(folders / "parquet" / "belief_robot.parquet").field("x").type) == "float"


def test_a_topic_without_messages_is_an_empty_typed_table(driven):
    frame = driven.table("/candidates/arcs")
    assert len(frame) == 0
    assert frame["from_x"].dtype == np.float64


def test_an_unknown_name_gives_the_nearest(log):
    with pytest.raises(InputError, match=r"did you mean '/people/estimate'\?"):
        log.table("/people/estimates")


def test_without_pandas_the_extra_is_named(recorded):
    code = (
        "import sys; sys.modules['pandas'] = None; import mjnav; from mjnav.errors import InputError\n"
        "try: mjnav.open_log(sys.argv[1]).table('/command')\nexcept InputError as error: print(error)"
    )
    said = subprocess.run([sys.executable, "-c", code, recorded], capture_output=True, text=True, check=True).stdout
    assert said.startswith("pandas is not installed")
    assert "install" in said or "--extra pandas" in said  # a command of this environment: tests/test_installation.py
