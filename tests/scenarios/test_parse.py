"""TOML as its tables, or in one line what is wrong with it."""

import pytest

from mjnav.errors import InvalidValue
from mjnav.scenarios.parse import MAX_PARTS, parse


@pytest.mark.parametrize(
    "text",
    [
        "{} = 1",
        "[{}]",
        "[[{}]]",
        "[a]\n{} = 1",
        "x = {{ {} = 1 }}",
        "x = [ 1, {{ {} = 1 }}]",
    ],
)
@pytest.mark.parametrize(("part", "dot"), [("a", "."), ("'a b'", "."), ('"a.\\"b"', "."), ("a", " \t. ")])
def test_a_key_of_very_many_parts_is_refused_at_once(text, part, dot):
    with pytest.raises(
        InvalidValue, match=rf"a\.toml: found 'a key of more parts'; allowed: keys of at most {MAX_PARTS}"
    ):
        parse(text.format(dot.join([part] * 100_000)), "a.toml")


def test_many_dots_that_are_no_long_key_are_read():
    numbers = [0.25] * 5000
    text = f'a.b.c = {numbers}\nd = "{"x." * 5000}"\n[[e]]\nf = [[1.5, 2.5], [3.5, 4.5]]\n'
    assert parse(text, "a.toml") == {
        "a": {"b": {"c": numbers}},
        "d": "x." * 5000,
        "e": [{"f": [[1.5, 2.5], [3.5, 4.5]]}],
    }
