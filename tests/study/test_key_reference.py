"""The reference of keys and the JSON Schemas of run files and study files.

A validator that is not ours refuses by the schema what our reader refuses, and takes what our reader takes.
"""

import tomllib
from contextlib import suppress
from copy import deepcopy
from math import isnan

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from mjnav.errors import InvalidValue
from mjnav.loop.prepare import load_scenario
from mjnav.noise import CHANNELS
from mjnav.scene import data_folder
from mjnav.scene.toml import toml_text
from mjnav.settings import settled
from mjnav.study.key_reference import keys_below, run_keys, run_schema, study_keys, study_schema
from tests.attacks.run_files import ANY_LEAF, BASE, ODD, at_a_bound, is_number, modest

RUNS = data_folder("runs")
RUN, STUDY = Draft202012Validator(run_schema()), Draft202012Validator(study_schema())
RUN_KEYS, STUDY_KEYS = run_keys(), study_keys()
unhurried = settings(deadline=None, suppress_health_check=list(HealthCheck))

# ---------------------------------------------------------------------------------------- JSON Schemas


@pytest.mark.parametrize(("validator", "folder"), [(RUN, RUNS), (STUDY, RUNS / "studies")], ids=["run", "study"])
def test_the_shipped_files_obey_their_schema(validator, folder):
    validator.check_schema(validator.schema)
    for path in folder.glob("*.toml"):
        validator.validate(tomllib.loads(path.read_text(encoding="utf-8")))


MISTAKES = {
    "a wrong key": ("robot.radios", 0.3),
    "a truth value for a number": ("robot.radius", True),
    "another behaviour's key": ("people", [{"start": [3, 3], "behaviour": "waypoints", "velocity": [0, 0]}]),
    "a distribution without its argument": ("noise.gyro", {"distribution": "gaussian"}),
    "another method's parameter": ("control", {"method": "mean", "degree": 2}),
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
    assert RUN.is_valid(BASE)
    assert not RUN.is_valid(document)
    (tmp_path / "file.toml").write_text(toml_text(document))
    with pytest.raises(InvalidValue):
        load_scenario(tmp_path / "file.toml")


@unhurried
@given(st.data())
def test_the_schema_accepts_of_one_key_what_the_reader_takes(data):
    """What holds between several keys is the reader's alone; so is what JSON Schema cannot say, which is left out."""
    leaf = data.draw(ANY_LEAF)
    value = data.draw(at_a_bound(leaf) if is_number(leaf) and data.draw(st.booleans()) else modest(leaf) | ODD)
    assume(leaf.path[-1] not in ("method", "trace") or value in ("rkhs", []))  # control.method is looked up later
    assume({"base", "kidnap", "map", "published"}.isdisjoint(leaf.path))  # keys that come together; a draw
    assume(not isinstance(value, dict))  # in a file with [layout] a table draws the value
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
    assert RUN.is_valid(document) == taken


# ------------------------------------------------------------------------------------------------ keys


def test_every_key_has_a_sentence_and_says_what_is_allowed():
    for row in (*RUN_KEYS, *STUDY_KEYS):
        assert len(row.description.split()) > 1, row
        assert not (row.required and row.default is not None), row
        assert row.allowed or row.type not in ("number", "integer"), row


def test_a_controller_whose_parameters_are_no_dataclass_has_no_rows_of_them(tmp_path):
    (tmp_path / "mine.py").write_text(
        "from types import SimpleNamespace\n"
        "class Mine:\n"
        "    parameters = SimpleNamespace(samples=3)\n"
        "    def __init__(self, limits, period, parameters): pass\n"
        "    def decide(self, observation): pass\n"
    )
    found = {row.key for row in run_keys(f"{tmp_path}/mine.py:Mine")}
    assert "control.rate" in found
    assert "control.samples" not in found


def test_a_methods_parameters_come_with_its_own_defaults():
    by_method = {name: {row.key: row for row in run_keys(name)} for name in ("rkhs", "rkhs-paper", "orca")}
    assert by_method["rkhs"]["control.degree"].default == 1
    assert by_method["rkhs-paper"]["control.degree"].default == 3
    assert "control.degree" not in by_method["orca"]
    degrees = [(row.default, row.where) for row in RUN_KEYS if row.key == "control.degree"]
    assert degrees[:2] == [(1, "method = rkhs"), (3, "method = rkhs-paper")]
    assert degrees[2:] == [(2, "method = rkhs-plan"), (2, "method = rkhs-reading")]  # two meanings of one word
    together = [(row.default, row.where) for row in RUN_KEYS if row.key == "control.desired_min"]
    assert together == [(25, "method = kld, rkhs, rkhs-reading"), (0, "method = rkhs-paper")]
    samples = [(row.default, row.where) for row in RUN_KEYS if row.key == "control.samples"]
    assert samples == [(25, "method other than rkhs-plan"), (48, "method = rkhs-plan")]
    with pytest.raises(InvalidValue, match="did you mean 'rkhs'"):
        run_keys("rkhz")


@pytest.mark.parametrize(
    ("prefix", "key"),
    [
        ("robot.max_speed", "robot.max_speed"),
        ("people.3.radius", "people.N.radius"),
        ("noise.odometry.v.std", "noise.CHANNEL.std"),
        *((f"noise.{channel}", "noise.CHANNEL") for channel in CHANNELS),
        ("noise.odometry", "noise.CHANNEL"),
        ("leg", "tables.N.leg_radius"),
    ],
)
def test_a_key_is_found_as_it_is_written_on_the_command_line(prefix, key):
    assert key in {row.key for row in keys_below(RUN_KEYS, prefix)}
