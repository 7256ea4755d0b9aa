import pickle
import shlex
import sys
from importlib.metadata import distribution

import pytest

from mjnav.errors import InvalidValue, missing_extra, unknown_name


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (InvalidValue("people.0.radius", -1.0, "a number > 0"), "people.0.radius: found -1.0; allowed: a number > 0"),
        (InvalidValue("", 3, "a table"), "found 3; allowed: a table"),
        (InvalidValue("noise.\x85\x1b", 3, "x"), r"noise.\x85\x1b: found 3; allowed: x"),  # one line, whatever its key
        (InvalidValue("name", None, "a string"), "name: found nothing; allowed: a string"),
        (
            InvalidValue("form", "lime", "line, ray", file="a.toml", nearest="line"),
            "a.toml: form: found 'lime'; allowed: line, ray; did you mean 'line'?",
        ),
    ],
)
def test_the_message_says_where_what_was_found_what_is_allowed_and_what_is_near(error, message):
    assert str(error) == message


def test_an_integer_too_long_to_print_is_named_by_its_type():
    assert str(InvalidValue("seed", 10**5000, "less")) == "seed: found a int; allowed: less"


def test_seen_from_outside_the_key_and_the_file_are_longer_and_the_rest_stays():
    inner = InvalidValue("radius", -1.0, "a number > 0", nearest="1.0")
    outer = inner.within("people.0").within("", file="run.toml")
    assert str(outer) == "run.toml: people.0.radius: found -1.0; allowed: a number > 0; did you mean '1.0'?"
    assert str(inner) == "radius: found -1.0; allowed: a number > 0; did you mean '1.0'?"
    assert outer.within("x").file == "run.toml"
    assert str(InvalidValue("", 1, "b").within("a")) == "a: found 1; allowed: b"


def test_an_unknown_name_lists_those_that_exist_and_the_nearest():
    error = unknown_name("method", "rkhz", {"mean": 0, "rkhs": 1})
    assert str(error) == "method: found 'rkhz'; allowed: mean, rkhs; did you mean 'rkhs'?"
    assert unknown_name("method", "zzzzzz", ["mean", "rkhs"]).nearest is None


def test_errors_survive_the_way_between_processes():
    error = InvalidValue("form", "lime", "line, ray", file="a.toml", nearest="line")
    assert str(pickle.loads(pickle.dumps(error))) == str(error)


@pytest.mark.parametrize("extra", distribution("mjnav").metadata.get_all("Provides-Extra") or ())
def test_a_missing_package_is_answered_with_a_command_for_this_environment_that_names_what_the_extra_needs(extra):
    text = str(missing_extra("a package", extra))
    head, _, command = text.partition(": ")
    words = shlex.split(command)
    assert head == "a package is not installed"
    assert sys.executable in words
    assert {"pip", "install"} < set(words)
    assert len(shlex.split(command)) > words.index("install") + 1
    assert extra != "sweep" or any(word.startswith("pyarrow") for word in words)
