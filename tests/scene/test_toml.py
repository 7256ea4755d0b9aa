"""TOML to tables and back; what is wrong with a text in one line."""

import datetime
import tomllib

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mjnav.errors import InvalidValue
from mjnav.scene.toml import MAX_PARTS, parse, toml_text

unhurried = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])  # the machine may be busy
LEAF = st.one_of(
    st.integers(-(2**63), 2**63 - 1),
    st.floats(allow_nan=False),
    st.booleans(),
    st.text(),
    st.datetimes(timezones=st.sampled_from([None, datetime.UTC])),
    st.dates(),
    st.times(),
)
TABLES = st.recursive(
    LEAF, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3), max_leaves=6
)


@pytest.mark.parametrize("text", ["{} = 1", "[{}]", "[[{}]]", "[a]\n{} = 1", "x = [ 1, {{ {} = 1 }}]"])
@pytest.mark.parametrize(("part", "dot"), [("a", "."), ("'a b'", " \t. ")])
def test_a_key_of_very_many_parts_is_refused_at_once(text, part, dot):
    with pytest.raises(
        InvalidValue, match=rf"a\.toml: found 'a key of more parts'; allowed: keys of at most {MAX_PARTS}"
    ):
        parse(text.format(dot.join([part] * 100_000)), "a.toml")


@unhurried
@given(st.dictionaries(st.text(), TABLES, max_size=5))
def test_any_table_survives_the_round_trip(table):
    assert tomllib.loads(toml_text(table)) == table
