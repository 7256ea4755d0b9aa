"""`--set`, `--controller` and `--seed`."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjnav.errors import InvalidValue
from mjnav.scene import dumps, loads
from mjnav.scene.overrides import override_text, overrides_of
from mjnav.scene.spec import StopAndGo, Waypoints

TEXT = """
schema = 1
name = "base"
seed = 7
[robot]
start = [0, 0, 0]
goal = [9, 0]
[[people]]
start = [5, -3]
behaviour = "constant_velocity"
velocity = [0, 0.5]
[control]
method = "rkhs"
rate = 20.0
delay = 2
degree = 3
"""


def test_a_value_is_toml():
    scenario = loads(TEXT, ["people.0.radius=0.4", "stop_on_collision=false", "control.delay = 0", "control.clip=-3"])
    assert scenario.people[0].radius == 0.4
    assert scenario.stop_on_collision is False
    assert scenario.control.delay == 0
    assert scenario.control.parameters == {"degree": 3, "clip": -3}


TOML_TEXTS = st.text(st.characters(exclude_categories=["Cs"])) | st.sampled_from(
    ["true", "1", "inf", "'a'", "[]", " 1"]
)
TOML_VALUES = st.recursive(
    st.booleans() | st.integers() | st.floats(allow_nan=False) | TOML_TEXTS,
    lambda values: st.lists(values) | st.dictionaries(TOML_TEXTS, values),
)


@given(TOML_VALUES)
def test_the_text_of_an_override_is_read_back_as_its_value(value):
    (override,) = overrides_of([override_text("people.0.radius", value)])
    assert (override.key, override.value, type(override.value)) == ("people.0.radius", value, type(value))


def test_one_key_says_for_all_people_whether_they_see_the_robot():
    with_own = TEXT.replace("velocity = [0, 0.5]", "velocity = [0, 0.5]\nsees_robot = true")
    for text, seen in (TEXT, False), (with_own, True):
        assert [person.sees for person in loads(text).people] == [seen]
        for sees in (True, False):
            scenario = loads(text, {"people_see_robot": sees})
            assert [person.sees for person in scenario.people] == [sees]
            assert loads(dumps(scenario)).people == scenario.people
    assert "people_see_robot" not in dumps(loads(TEXT))


@pytest.mark.parametrize(
    ("text", "value"), [("other", "other"), ('"other"', "other"), ("a=b", "a=b"), ("", ""), ("1\nname = 2",) * 2]
)
def test_a_value_that_is_no_toml_is_a_string(text, value):
    assert loads(TEXT, [f"description={text}"]).description == value


def test_waypoints_and_goal_replace_one_another():
    scenario = loads(TEXT, ["robot.waypoints=[[1, 1], [2, 2]]"])
    assert (scenario.robot.goal, scenario.robot.waypoints) == (None, ((1.0, 1.0), (2.0, 2.0)))
    assert loads(TEXT, ["robot.waypoints=[[1, 1]]", "robot.goal=[3, 0]"]).robot.route == ((3.0, 0.0),)


def test_another_behaviour_drops_the_keys_that_it_does_not_have():
    overrides = ["people.0.behaviour=waypoints", "people.0.waypoints=[[1, 1]]"]
    assert loads(TEXT, overrides).people[0].behaviour == Waypoints(((1.0, 1.0),))
    assert loads(TEXT, ["people.0.behaviour=stop_and_go"]).people[0].behaviour == StopAndGo((0.0, 0.5))


@pytest.mark.parametrize("model", ["constant_velocity", "other.py:Mine"])
def test_another_model_drops_the_keys_of_one_s_own(model):
    own = "[prediction]\nmodel = 'mine.py:Mine'\nhorizon = 2.0\ngain = 3.0\n"
    prediction = loads(TEXT + own, [f"prediction.model={model}"]).prediction
    assert prediction is not None
    assert (prediction.name, prediction.horizon) == (model, 2.0)
    assert "gain" not in str(prediction.model)
    with pytest.raises(InvalidValue, match="gian"):  # a mistake stays one
        loads(TEXT + "[prediction]\ngian = 3.0\n", ["prediction.model=constant_velocity"])


def test_overrides_come_after_the_controller_and_the_seed():
    scenario = loads(TEXT, ["control.degree=1", "control.rate=10", "seed=4"], controller="mean", seed=3)
    assert scenario.control.parameters == {"degree": 1}
    assert scenario.control.rate == 10.0
    assert scenario.seed == 4
    assert loads(TEXT, controller="mean", seed=3).seed == 3


REFUSED = {
    "people.0.radius=9": "overrides: people.0.radius: found 9.0; allowed: a number from 0.1 to 1 m",
    "people.1.radius=0.4": "overrides: people.1: found '1'; allowed: an index from 0 to 0",
    "walls.0.height=2": "overrides: walls.0: found '0'; allowed: nothing below it: the array is empty",
    "seed.low=2": "overrides: seed.low: found 7; allowed: a table or an array in front of .low",
    "control.rate": "overrides: found 'control.rate'; allowed: KEY=VALUE, as in people.0.radius=0.4",
    "description=\udc80": "overrides: found 'description=\\udc80'; allowed: text in UTF-8",
}


@pytest.mark.parametrize("override", REFUSED)
def test_a_bad_override_is_refused_with_its_key(override):
    with pytest.raises(InvalidValue) as error:
        loads(TEXT, [override], file="base.toml")
    assert str(error.value).startswith(REFUSED[override])
