"""A damaged run file, study file or trace is read or refused; nothing else happens.

Here files are damaged; `tests/attacks/test_fuzz_run_files.py` makes run files from the definitions of their keys.

MJNAV_FUZZ=N tries N random ones in place of a few fixed ones.
"""

import os
import tomllib
from contextlib import suppress
from copy import deepcopy
from datetime import date

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mjnav.errors import InputError
from mjnav.loop.prepare import load_scenario
from mjnav.scene import dumps, library, loads
from mjnav.scene.toml import toml_text
from mjnav.study.study_file import load_study, study_text

RUN_FILES = tuple(sorted(library.data_folder("runs").glob("*.toml")))
STUDY_FILES = tuple(sorted((library.data_folder("runs") / "studies").glob("*.toml")))

fuzzed = settings(
    max_examples=int(os.environ.get("MJNAV_FUZZ", "30")),
    derandomize="MJNAV_FUZZ" not in os.environ,
    database=None,
    suppress_health_check=list(HealthCheck),
)

NUMBERS = st.integers(-3, 30) | st.floats() | st.sampled_from([2**63, -(2**64), 10**400, 1e308, 5e-324, 0.1, 1e6, -0.0])
FACTORS = (-1.0, 0.0, 0.01, 0.5, 0.9, 1.1, 2.0, 10.0)
VALUES = st.recursive(
    NUMBERS | st.booleans() | st.text(max_size=8) | st.just(date(2020, 2, 2)),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=2),
    max_leaves=6,
)
PIECES = (
    b"[",
    b"]]",
    b"[[people]]\n",
    b'"',
    b"'''",
    b"=",
    b".",
    b"\n",
    b"\x00",
    b"\xff",
    b"\xef\xbb\xbf",
    b"9" * 5000,
    b"e999",
    b"[" * 3000,
)


@st.composite
def changed_text(draw, content: bytes) -> bytes:
    """Bytes and lines that are missing, come twice, stand elsewhere or are others."""
    for _ in range(draw(st.integers(1, 4))):
        lines = content.splitlines(keepends=True) or [b""]
        place, line = draw(st.integers(0, len(content))), draw(st.integers(0, len(lines) - 1))
        match draw(st.sampled_from(("byte", "piece", "cut", "drop", "repeat", "move"))):
            case "byte":
                content = content[:place] + draw(st.binary(max_size=3)) + content[place + 1 :]
            case "piece":
                content = content[:place] + draw(st.sampled_from(PIECES)) + content[place:]
            case "cut":
                content = content[:place]
            case "drop":
                content = b"".join(lines[:line] + lines[line + 1 :])
            case "repeat":
                content = b"".join([*lines, lines[line]])
            case "move":
                content = b"".join([lines[line], *lines[:line], *lines[line + 1 :]])
    return content


@st.composite
def changed_document(draw, document: dict) -> dict:
    """Tables of which some values are others, of another type, missing or new."""
    document = deepcopy(document)
    for _ in range(draw(st.integers(1, 3))):
        inner = document
        while isinstance(inner, dict | list) and inner:
            key = draw(st.sampled_from(list(inner) if isinstance(inner, dict) else list(range(len(inner)))))
            if isinstance(inner[key], dict | list) and inner[key] and draw(st.integers(0, 4)):
                inner = inner[key]
                continue
            match draw(st.sampled_from(("value", "number", *["scaled"] * 6, "drop", "repeat", "new"))):
                case "scaled" if type(inner[key]) in (int, float):
                    inner[key] = type(inner[key])(inner[key] * draw(st.sampled_from(FACTORS)))
                case "value":
                    inner[key] = draw(VALUES)
                case "number":
                    inner[key] = draw(NUMBERS)
                case "drop":
                    del inner[key]
                case "repeat" if isinstance(inner, list):
                    inner.append(deepcopy(inner[key]))
                case "new" if isinstance(inner, dict):
                    inner[draw(st.text(max_size=5))] = draw(VALUES)
            break
    return document


def refused_in_order(error: InputError, path) -> None:
    assert str(path) in str(error)
    assert len(str(error).splitlines()) <= 1
    assert len(str(error)) < 2000


@fuzzed
@given(st.data())
def test_a_run_file_of_changed_bytes_is_read_or_refused(tmp_path, data):
    path = tmp_path / "changed.toml"
    path.write_bytes(data.draw(changed_text(data.draw(st.sampled_from(RUN_FILES)).read_bytes())))
    try:
        scenario = load_scenario(str(path))
    except InputError as error:
        refused_in_order(error, path)
    else:
        assert loads(dumps(scenario)) == scenario


@fuzzed
@given(st.data())
def test_a_study_file_of_changed_bytes_or_values_is_read_or_refused(tmp_path, data):
    path = tmp_path / "changed.toml"
    content = data.draw(st.sampled_from(STUDY_FILES)).read_bytes()
    if data.draw(st.booleans()):
        path.write_bytes(data.draw(changed_text(content)))
    else:
        path.write_text(toml_text(data.draw(changed_document(tomllib.loads(content.decode())))))
    try:
        study = load_study(str(path))
    except InputError as error:
        refused_in_order(error, path)
    else:
        tomllib.loads(study_text(study))


@fuzzed
@given(st.data())
def test_a_trace_of_changed_bytes_is_read_or_refused(tmp_path, data):
    trace = b"# compute times [s]\n0.010\n0.012, 0.011\n0.013\n\n0.2; 0.05\n"
    (tmp_path / "trace.txt").write_bytes(data.draw(changed_text(trace) | st.binary(max_size=50)))
    override = "control.latency={trace='trace.txt'}"
    path = tmp_path / "scene.toml"
    path.write_bytes((library.data_folder("runs") / "crossing1.toml").read_bytes())
    with suppress(InputError):
        assert load_scenario(str(path), [override]).control.latency
