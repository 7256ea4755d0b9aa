"""`mjnav show`, `mjnav keys` and `mjnav schema`."""

import json
import resource

import pytest

from mjnav.errors import MjnavError
from mjnav.output_files import written
from mjnav.scene import data_folder, load
from mjnav.study.key_reference import run_keys, run_schema, study_keys, study_schema


def test_a_shipped_file_is_printed_as_it_is(mjnav, tmp_path):
    text = (data_folder("runs") / "hall.toml").read_text(encoding="utf-8")
    said = mjnav("show", "hall")
    assert (said.code, said.out, said.err) == (0, text, "")
    assert mjnav("show", "hall", "-o", "mine.toml").out == ""
    assert load("./mine.toml") == load("hall")
    assert 'controller = "' in mjnav("show", "social").out


def test_with_a_seed_a_scene_is_printed_as_that_run_has_it(mjnav, tmp_path):
    (tmp_path / "drawn.toml").write_text(mjnav("show", "rooms", "--seed", "5").out)
    assert load("./drawn.toml") == load("rooms", seed=5)


def test_values_that_replace_the_files_show_the_layout_that_they_draw(mjnav, tmp_path):
    (tmp_path / "held.toml").write_text(mjnav("show", "rooms", "--set", "layout.purpose=training").out)
    held, drawn = load("./held.toml"), load("rooms", ["layout.purpose=training"])
    assert held == drawn
    assert held.people != load("rooms").people


def test_a_key_is_one_line_in_a_pipe(mjnav):
    said = mjnav("keys")
    assert (said.code, said.err) == (0, "")
    lines = said.out.splitlines()
    assert [line.split()[0] for line in lines[1:]] == [row.key for row in run_keys()]
    (line,) = (line for line in lines if line.startswith("robot.max_speed "))
    assert line.split(maxsplit=6)[1:6] == ["number", "m/s", "from", "0.01", "to"]


def test_json_has_every_row(mjnav):
    rows = json.loads(mjnav("keys", "control.sensing_range", "--json").out)["keys"]
    assert {row["default"] for row in rows} == {None, "inf", 7.0}
    study = json.loads(mjnav("keys", "--study", "--json").out)["keys"]
    assert [row["key"] for row in study] == [row.key for row in study_keys()]


def test_a_schema_is_printed(mjnav):
    assert json.loads(mjnav("schema", "study").out) == study_schema()
    assert json.loads(mjnav("schema", "run").out) == run_schema()


def test_a_disk_that_refuses_leaves_the_file_that_was_there_and_none_where_none_was(tmp_path):
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    (tmp_path / "a.txt").write_text("before")
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
    try:
        for name in ("a.txt", "b.txt"):
            with pytest.raises(MjnavError, match=name) as told, written(tmp_path / name) as file:
                file.write(bytes(5000))
            assert told.value.exit_code == 1
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a.txt": "before"}
