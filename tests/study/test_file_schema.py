"""The schemas of run files and study files, by a validator that is not ours: it and our reader refuse the same."""

import tomllib
from contextlib import suppress
from copy import deepcopy
from math import isnan

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from mjnav.cli.main import main
from mjnav.config import settled
from mjnav.errors import InvalidValue
from mjnav.loop.prepare import load_scenario
from mjnav.scenarios import data_folder, loads
from mjnav.scenarios.toml import toml_text
from mjnav.study.cells import resolve
from mjnav.study.key_reference import run_schema, study_schema
from mjnav.study.study_file import load_study
from tests.attacks.run_files import ANY_LEAF, BASE, ODD, at_a_bound, is_number, modest, run_files

RUNS = data_folder("runs")
VALIDATORS = {"run": Draft202012Validator(run_schema()), "study": Draft202012Validator(study_schema())}
SHIPPED = [("run", path) for path in sorted(RUNS.glob("*.toml"))]
SHIPPED += [("study", path) for path in sorted((RUNS / "studies").glob("*.toml"))]
STUDY = {"schema": 1, "name": "s", "scenes": ["hall"], "methods": [{"controller": "rkhs"}]}
unhurried = settings(deadline=None, suppress_health_check=list(HealthCheck))


@pytest.mark.parametrize("kind", VALIDATORS)
def test_the_shipped_schema_is_what_the_command_prints(kind, capsys, tmp_path):
    Draft202012Validator.check_schema(VALIDATORS[kind].schema)
    assert main(["schema", kind]) == 0
    printed = capsys.readouterr().out
    assert printed == (RUNS / "schema" / f"{kind}.json").read_text(encoding="utf-8"), f"mjnav schema {kind} -o ..."
    assert main(["schema", kind, "-o", str(tmp_path / "out.json")]) == 0
    assert (tmp_path / "out.json").read_text(encoding="utf-8") == printed
    assert main(["schema", kind, "-o", str(tmp_path / "none" / "out.json")]) == 2


@pytest.mark.parametrize(("kind", "path"), SHIPPED, ids=lambda part: getattr(part, "stem", part))
def test_a_shipped_file_names_its_schema_and_obeys_it(kind, path):
    text = path.read_text(encoding="utf-8")
    named = text.partition("\n")[0].removeprefix("#:schema ")
    assert (path.parent / named).resolve() == RUNS / "schema" / f"{kind}.json"
    VALIDATORS[kind].validate(tomllib.loads(text))


MISTAKES = {
    "a wrong key": ("robot.radios", 0.3),
    "a value out of range": ("robot.radius", 0.1),
    "a wrong type": ("robot.radius", "wide"),
    "a truth value for a number": ("robot.radius", True),
    "an unknown engine": ("physics.engine", "mujocco"),
    "an array that is too short": ("robot.start", [0.0, 0.0]),
    "another version": ("schema", 2),
    "another behaviour's key": ("people", [{"start": [3, 3], "behaviour": "waypoints", "velocity": [0, 0]}]),
    "a person without a behaviour": ("people", [{"start": [3, 3]}]),
    "an unknown channel": ("noise.odometry.omga", {"distribution": "zero"}),
    "a distribution without its argument": ("noise.gyro", {"distribution": "gaussian"}),
    "an unknown method": ("control", {"method": "rkhz"}),
    "another method's parameter": ("control", {"method": "mean", "degree": 2}),
    "a parameter that the default method lacks": ("control", {"rollouts": 10}),
    "a parameter out of range": ("control", {"method": "saa", "eta": 1.5}),
}


def put(document: dict, key: str, value: object) -> dict:
    document = deepcopy(document)
    *groups, last = key.split(".")
    inner = document
    for group in groups:
        inner = inner.setdefault(group, {})
    inner[last] = value
    return document


@pytest.mark.parametrize("title", MISTAKES)
def test_a_mistake_in_a_run_file_is_refused_by_both(title, tmp_path):
    document = put(BASE, *MISTAKES[title])
    assert VALIDATORS["run"].is_valid(BASE)
    assert not VALIDATORS["run"].is_valid(document)
    (tmp_path / "file.toml").write_text(toml_text(document))
    with pytest.raises(InvalidValue):
        load_scenario(tmp_path / "file.toml")


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("scene", ["hall"]),
        ("scenes", []),
        ("seeds", {"count": 0}),
        ("seeds", [-1]),
        ("methods", [{"controler": "rkhs"}]),
        ("settings", [{"set": {}}]),
        ("set", {"physics": {"engine": "mujocco"}}),
        ("set", {"robot": {"radios": 0.3}}),
        ("grid", {"control": {"rate": 10.0}}),
        ("grid", {"control": {"rate": [10.0, 5000.0]}}),
        ("methods", [{"controller": "rkhs", "set": {"weight": "heavy"}}]),
        ("methods", [{"controller": "rkhs", "grid": {"weight": 3.0}}]),
        ("methods", [{"controller": "rkhs", "search": {"count": 0, "weight": {"low": 1.0, "high": 3.0}}}]),
        ("methods", [{"controller": "rkhs", "search": {"count": 2, "weight": {"low": 1.0}}}]),
        ("methods", [{"controller": "rkhs", "search": {"count": 2, "weight": 3.0}}]),
    ],
)
def test_a_mistake_in_a_study_file_is_refused_by_both(key, value, tmp_path):
    assert VALIDATORS["study"].is_valid(STUDY)
    assert not VALIDATORS["study"].is_valid({**STUDY, key: value})
    (tmp_path / "study.toml").write_text(toml_text({**STUDY, key: value}))
    with pytest.raises(InvalidValue):
        resolve(load_study(tmp_path / "study.toml"))


def test_a_study_sets_an_array_of_a_run_file_as_a_whole():
    wall = {"from": [0.0, 3.0], "to": [9.0, 3.0]}
    assert VALIDATORS["study"].is_valid({**STUDY, "set": {"walls": [wall]}})
    assert not VALIDATORS["study"].is_valid({**STUDY, "set": {"walls": [{**wall, "thick": 1.0}]}})


@unhurried
@given(st.data())
def test_the_schema_accepts_of_one_key_what_the_reader_takes(data):
    """What holds between several keys is the reader's alone; so is what JSON Schema cannot say, which is left out."""
    leaf = data.draw(ANY_LEAF)
    value = data.draw(at_a_bound(leaf) if is_number(leaf) and data.draw(st.booleans()) else modest(leaf) | ODD)
    assume(leaf.path[-1] not in ("method", "trace") or value in ("rkhs", []))  # control.method is looked up later
    assume("kidnap" not in leaf.path)  # its two keys come together
    for number in value if isinstance(value, list) else [value]:
        assume(not isinstance(number, int) or -(2**63) <= number < 2**63)
        assume(not isinstance(number, float) or not (isnan(number) or number.is_integer()))
        assume(not isinstance(number, str) or number.isprintable())
    document = deepcopy(BASE)
    leaf.put(document, value)
    taken = False
    with suppress(InvalidValue):
        settled(leaf.hint, value)
        taken = True
    assert VALIDATORS["run"].is_valid(document) == taken


@unhurried
@given(run_files())
def test_a_run_file_that_is_read_obeys_the_schema(document):
    try:
        loads(toml_text(document))
    except InvalidValue:
        assume(False)
    assert all(error.absolute_path[0] == "control" for error in VALIDATORS["run"].iter_errors(document))
