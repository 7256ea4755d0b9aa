"""`mjnav keys` and `mjnav schema`."""

import json

from mjnav.study.key_reference import run_keys, run_schema, study_keys, study_schema


def test_a_key_is_one_line_in_a_pipe(mjnav):
    said = mjnav("keys")
    assert (said.code, said.err) == (0, "")
    lines = said.out.splitlines()
    assert [line.split()[0] for line in lines[1:]] == [row.key for row in run_keys()]
    (line,) = (line for line in lines if line.startswith("robot.max_speed "))
    assert line.split(maxsplit=6)[1:6] == ["number", "m/s", "from", "0.01", "to"]


def test_json_has_every_row(mjnav):
    rows = json.loads(mjnav("keys", "control.sensing_range", "--json").out)["keys"]
    assert {row["default"] for row in rows} == {None, "inf"}
    study = json.loads(mjnav("keys", "--study", "--json").out)["keys"]
    assert [row["key"] for row in study] == [row.key for row in study_keys()]


def test_a_schema_is_printed(mjnav):
    assert json.loads(mjnav("schema", "study").out) == study_schema()
    assert json.loads(mjnav("schema", "run").out) == run_schema()
