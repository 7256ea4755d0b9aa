"""A scenario written as TOML is the same scenario when it is read again."""

import datetime
import math
import tomllib
from dataclasses import fields

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mjnav.config import read_document
from mjnav.errors import InvalidValue
from mjnav.noise import make_distribution, profile_names
from mjnav.scenarios import dumps, load, loads, names
from mjnav.scenarios.dump import tables, toml_text
from mjnav.scenarios.spec import (
    ConstantVelocity,
    Control,
    LaneSpec,
    Noise,
    Person,
    Pillar,
    Robot,
    Scenario,
    StopAndGo,
    Table,
    Wall,
    Waypoints,
)

unhurried = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])  # the machine may be busy
COORDINATE = st.floats(-1e4, 1e4)
SIZE = st.floats(0.1, 1.0)
POINT = st.tuples(COORDINATE, COORDINATE)
VELOCITY = st.tuples(st.floats(-3, 3), st.floats(-3, 3))
BEHAVIOUR = st.one_of(
    st.builds(ConstantVelocity, VELOCITY),
    st.builds(StopAndGo, VELOCITY, SIZE, SIZE),
    st.builds(Waypoints, st.lists(POINT, min_size=1, max_size=3).map(tuple), SIZE, st.booleans()),
)
LINE = st.tuples(st.floats(1, 2), COORDINATE, COORDINATE)
LEAF = st.one_of(
    st.integers(-(2**63), 2**63 - 1),
    st.floats(allow_nan=False),
    st.booleans(),
    st.text(),
    st.datetimes(timezones=st.sampled_from([None, datetime.UTC])),
    st.dates(),
    st.times(),
)
PARAMETER = st.recursive(
    LEAF, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3), max_leaves=6
)
CHANNELS = {"gyro": make_distribution("gaussian", std=0.1), "pose.x": make_distribution("gaussian", mean=1, std=2)}
FEW = {"max_size": 2}
CONTROL_KEYS = {field.name for field in fields(Control)}
SCENARIO = st.builds(
    Scenario,
    name=st.text(min_size=1, max_size=20).filter(lambda name: name.isprintable() and "/" not in name),
    description=st.text(),
    seed=st.integers(0, 2**63 - 1),
    stop_on_collision=st.booleans(),
    robot=st.one_of(
        st.builds(Robot, st.tuples(COORDINATE, COORDINATE, COORDINATE), goal=POINT, goal_tolerance=SIZE),
        st.builds(Robot, st.tuples(COORDINATE, COORDINATE, COORDINATE), waypoints=st.tuples(POINT, POINT)),
    ),
    walls=st.lists(st.builds(Wall, st.just((0.0, 0.0)), st.tuples(SIZE, SIZE), SIZE), **FEW).map(tuple),
    tables=st.lists(st.builds(Table, POINT, COORDINATE, st.tuples(SIZE, SIZE)), **FEW).map(tuple),
    pillars=st.lists(st.builds(Pillar, POINT, SIZE), **FEW).map(tuple),
    lanes=st.none() | st.builds(LaneSpec, LINE, LINE),
    people=st.lists(st.builds(Person, POINT, BEHAVIOUR, SIZE), **FEW).map(tuple),
    noise=st.builds(Noise, st.sampled_from(profile_names()), st.sampled_from([{}, CHANNELS])),
    control=st.builds(
        Control,
        method=st.text(),
        delay=st.integers(0, 100),
        prediction=st.booleans(),
        parameters=st.dictionaries(st.text().filter(lambda key: key not in CONTROL_KEYS), PARAMETER, max_size=3),
    ),
)


@pytest.mark.parametrize("name", names())
def test_every_shipped_scene_survives_the_round_trip(name):
    scenario = load(name)
    text = dumps(scenario)
    assert loads(text) == scenario
    assert dumps(loads(text)) == text


@unhurried
@given(SCENARIO)
def test_any_scenario_survives_the_round_trip(scenario):
    assert read_document(Scenario, tomllib.loads(dumps(scenario))) == scenario


@unhurried
@given(st.dictionaries(st.text(), PARAMETER, max_size=5))
def test_any_table_survives_the_round_trip(table):
    assert tomllib.loads(toml_text(table)) == table


@pytest.mark.parametrize(
    "hostile", ['"', "\\", '"""', "'", "a\nb", "\r\n", "\t", "\0", "\x1b[31m", "\x7f", "# no comment", "[table]", "é☃𝄞"]
)
def test_hostile_text_is_escaped(hostile):
    table = {hostile: hostile, "inner": {hostile: [hostile, {hostile: hostile}]}}
    assert tomllib.loads(toml_text(table)) == table


@pytest.mark.parametrize("number", [math.inf, -math.inf, -0.0, 1e-7, 1e300, 0.1 + 0.2, 5e-324])
def test_floats_keep_their_last_bit(number):
    (back,) = tomllib.loads(toml_text({"x": number})).values()
    assert (back, math.copysign(1.0, back)) == (number, math.copysign(1.0, number))
    assert math.isnan(tomllib.loads(toml_text({"x": math.nan}))["x"])


def test_what_toml_does_not_have_is_refused():
    with pytest.raises(TypeError, match="TOML has no NoneType"):
        toml_text({"x": None})


def test_every_default_is_explicit():
    text = dumps(loads('schema = 1\nname = "least"\n[robot]\nstart = [0, 0, 0]\ngoal = [1, 0]'))
    assert text.startswith('schema = 1\nname = "least"\n')
    for line in (
        "seed = 0",
        "time_limit = 60.0",
        "goal_tolerance = 0.3",
        'profile = "pearson"',
        "delay = 1",
        "people = []",
    ):
        assert f"\n{line}\n" in text


def test_tables_is_the_inverse_of_build():
    document = tables(load("hall"))
    assert tables(read_document(Scenario, document)) == document


def test_a_dumped_scenario_of_another_version_is_refused():
    with pytest.raises(InvalidValue, match="schema: found 2; allowed: 1"):
        loads(dumps(load("hall")).replace("schema = 1", "schema = 2"))
