"""A log's tables as CSV files, data frames and Parquet files: every figure of every message, with types and units."""

import json
import math
from itertools import chain

import duckdb
import pandas as pd
import pyarrow.parquet
import pytest

from mjnav.log.encode.topics import topics
from mjnav.log.export.export import export
from mjnav.log.read.tables import TABLES


@pytest.fixture(scope="module")
def folders(log, tmp_path_factory):
    """The CSV files and the Parquet files of one log."""
    path = tmp_path_factory.mktemp("tables")
    for form in ("csv", "parquet"):
        export(log, form, path / form)
    return path


@pytest.fixture(scope="module")
def folder(folders):
    return folders / "csv"


def read(folder, name: str) -> pd.DataFrame:
    return pd.read_csv(folder / f"{name}.csv")


def stamped(log, topic):
    """Tick, time and value of each message."""
    return [(message.sequence, message.time_ns / 1e9, message.value) for message in log.messages(topic)]


def test_every_topic_of_a_log_but_drawings_has_its_tables(scenario):
    assert set(TABLES) == {topic.name for topic in topics(scenario)} - {"/scene", "/candidates/arcs"}
    names = [table.name for tables in TABLES.values() for table in tables]
    assert len(names) == len(set(names))


def state(value):
    believed = value["estimate"]
    figures = ("ess", "recovered")
    estimate = believed and [*believed["mean"], *chain(*believed["covariance"]), *(believed[key] for key in figures)]
    return [[*value["pose"], *value["twist"], *(estimate or [None] * 14)]]


def decision(value):
    nominal, cost = value["nominal"] or {}, value["cost"] or {"lane": [None, None]}
    chosen = [value["v"], value["omega"], value["status"], value["advice"] or None]
    return [[*chosen, nominal.get("v"), nominal.get("omega"), cost.get("goal"), *cost["lane"], cost.get("total")]]


def tracks(value):
    return [
        [*person["position"], *person["velocity"], *chain(*person["covariance"]), person["radius"], person["ess"]]
        for person in value["people"]
    ]


def covariance(*names):
    return [f"covariance_{a}_{b}" for a in names for b in names]


POSE_COVARIANCE = " ".join(f"estimate_{name}" for name in covariance("x", "y", "theta"))
STATE = f"x y theta v omega estimate_x estimate_y estimate_theta {POSE_COVARIANCE} estimate_ess estimate_recovered"
STATES = ("x", "y", "vx", "vy")
COSTS = "nominal_v nominal_omega cost_goal cost_lane_left cost_lane_right cost_total"
PHASES = "sense_ns estimate_ns control_ns record_ns advance_ns"
# table, its topic, its columns, and the rows of a message
FLAT = [
    ("robot_state", "/robot/state", STATE, state),
    ("people_estimate", "/people/estimate", f"x y vx vy {' '.join(covariance(*STATES))} radius ess", tracks),
    ("people_detections", "/people/estimate", "detection x y", lambda v: _numbered(v.get("detections", ()))),
    ("command", "/command", "v omega", lambda v: [[v["v"], v["omega"]]]),
    ("tick", "/tick", f"{PHASES} lateness_ns deadline_missed", lambda v: [list(v.values())[1:]]),
    ("decision", "/decision", f"v omega status advice {COSTS}", decision),
    ("decision_cone", "/decision", "constraint cost", lambda v: enumerate((v["cost"] or {}).get("cone", ()))),
]


def _numbered(rows):
    return [[number, *row] for number, row in enumerate(rows)]


@pytest.mark.parametrize(("name", "topic", "columns", "rows"), FLAT, ids=[name for name, *_ in FLAT])
def test_every_figure_of_a_document_is_in_its_row_to_the_last_bit(log, folder, name, topic, columns, rows):
    table, names = read(folder, name), ["tick", "time", *columns.split()]
    expected = [[tick, time, *row] for tick, time, value in stamped(log, topic) for row in rows(value)]
    assert len(table) == len(expected) > 0
    for column, values in zip(names, zip(*expected, strict=True), strict=True):
        assert [None if value != value else value for value in table[column].tolist()] == list(values), column


def test_columns_csv_names_every_column_of_every_table_in_order(folder):
    units = pd.read_csv(folder / "columns.csv", keep_default_na=False)
    tables = sorted(path.stem for path in folder.iterdir() if path.stem != "columns")
    assert sorted(set(units["table"])) == tables
    for name in tables:
        assert units.loc[units["table"] == name, "column"].tolist() == list(read(folder, name).columns)
    unit = units.set_index(["table", "column"])["unit"].to_dict()
    assert unit["command", "omega"] == "rad/s"
    assert unit["people_estimate", "covariance_x_vy"] == "m*m/s"
    assert unit["decision", "status"] == ""


def test_only_the_topics_asked_for_are_written(log, tmp_path):
    counts = export(log, "csv", tmp_path / "out", topics=["/command", "/people/estimate", "/command"])
    assert counts == {"command.csv": 6, "people_estimate.csv": 17, "people_detections.csv": 15}
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["columns.csv", "command.csv", "people_detections.csv", "people_estimate.csv"]


# ------------------------------------------------------------------------ data frames and Parquet

NAMES = [table.name for tables in TABLES.values() for table in tables]


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
