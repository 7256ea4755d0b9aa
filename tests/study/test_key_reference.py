"""The reference of keys names every key that the schema has, with a sentence, and answers misspelt ones."""

import re

import pytest

from mjnav import control
from mjnav.errors import InvalidValue
from mjnav.noise import CHANNELS
from mjnav.study.key_reference import keys_below, run_keys, run_schema, study_keys, study_schema

# Tables that may stand in place of a value: any of a random scene, a metric's name.
IN_PLACE = ("Draw", "DrawOrShares", "MetricPlugin")
RUN, STUDY = run_keys(), study_keys()


def schema_keys(schema: dict, table: dict, prefix: str = "") -> set[str]:
    """The keys of a table in a JSON Schema, those of tables in it and in arrays too."""
    found = set()
    for key, value in table.get("properties", {}).items():
        found.add(f"{prefix}{key}")
        for one in value.get("anyOf", [value]):
            items, below = one.get("items", one), f"{prefix}{key}.{'N.' * ('items' in one)}"
            for inner in items.get("anyOf", [items]) if isinstance(items, dict) else ():
                name = inner.get("$ref", "").rpartition("/")[2]
                if name not in IN_PLACE:
                    found |= schema_keys(schema, schema["$defs"].get(name, inner), below)
    return found


def without_channels(keys: set[str]) -> set[str]:
    """The keys with one word in place of every channel, and without the tables that lead to one."""
    places = [f"noise.{channel}" for channel in CHANNELS]
    named = {re.sub(f"^({'|'.join(map(re.escape, places))})(?=\\.|$)", "noise.CHANNEL", key) for key in keys}
    return {key for key in named if not any(place.startswith(f"{key}.") for place in places) or key == "noise"}


def test_a_run_files_keys_are_those_of_its_schema():
    schema = run_schema()
    keys = without_channels(schema_keys(schema, schema)) - {"control.preferred_speed"}  # which stands under [robot]
    law = schema["$defs"]["Distribution"]["properties"]
    assert {row.key for row in RUN} == keys | {f"noise.CHANNEL.{key}" for key in law}


def test_a_study_files_keys_are_those_of_its_schema():
    schema = study_schema()
    keys = schema_keys(schema, schema)
    free = re.compile(r"(^|\.)((set|grid)\.|search\.(?!count|seed))")  # keys of a run file, in tables in one another
    assert {row.key for row in STUDY} == {key for key in keys if not free.search(key)}


@pytest.mark.parametrize("row", [*RUN, *STUDY], ids=lambda row: f"{row.key} {row.where}".strip())
def test_every_key_has_a_sentence_and_says_what_is_allowed(row):
    assert len(row.description.split()) > 1
    assert not (row.required and row.default is not None)
    if row.type in ("number", "integer"):
        assert row.allowed


def test_a_methods_parameters_come_with_its_own_defaults():
    by_method = {name: {row.key: row for row in run_keys(name)} for name in ("rkhs", "rkhs-paper", "orca")}
    assert by_method["rkhs"]["control.degree"].default == 1
    assert by_method["rkhs-paper"]["control.degree"].default == 3
    assert "control.degree" not in by_method["orca"]
    together = [(row.default, row.where) for row in RUN if row.key == "control.degree"]
    assert together == [(1, "method = rkhs"), (3, "method = rkhs-paper"), (2, "method = rkhs-plan")]
    samples = [(row.default, row.where) for row in RUN if row.key == "control.samples"]
    assert samples == [(25, "method other than rkhs-plan"), (48, "method = rkhs-plan")]
    assert {row.where for row in RUN if row.key == "control.approach_time"} == {""}
    with pytest.raises(InvalidValue, match="did you mean 'rkhs'"):
        run_keys("rkhz")
    assert set(control.names()) >= set(by_method)


@pytest.mark.parametrize(
    ("prefix", "key"),
    [
        ("robot.max_speed", "robot.max_speed"),
        ("people.3.radius", "people.N.radius"),
        ("noise.odometry.v.std", "noise.CHANNEL.std"),
        ("noise.odometry", "noise.CHANNEL"),
        ("leg", "tables.N.leg_radius"),
    ],
)
def test_a_key_is_found_as_it_is_written_on_the_command_line(prefix, key):
    assert key in {row.key for row in keys_below(RUN, prefix)}


@pytest.mark.parametrize(
    ("prefix", "nearest"),
    [("robot.raduis", "robot.radius"), ("raduis", "robot.radius"), ("control.degre_", "control.degree")],
)
def test_a_misspelt_key_is_answered_with_the_nearest(prefix, nearest):
    with pytest.raises(InvalidValue, match=f"did you mean '{re.escape(nearest)}'"):
        keys_below(RUN, prefix)
