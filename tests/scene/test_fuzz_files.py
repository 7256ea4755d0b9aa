"""A damaged run file, study file or trace is read or refused; nothing else happens.

Here files are damaged; `tests/attacks/test_fuzz_run_files.py` makes run files from the definitions of their keys.

MJNAV_FUZZ=N tries N random ones in place of a few fixed ones.
"""

import os
from contextlib import suppress

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mjnav.errors import InputError
from mjnav.loop.prepare import load_scenario
from mjnav.scene import dumps, library, loads

RUN_FILES = tuple(sorted(library.data_folder("runs").glob("*.toml")))

fuzzed = settings(
    max_examples=int(os.environ.get("MJNAV_FUZZ", "30")),
    derandomize="MJNAV_FUZZ" not in os.environ,
    database=None,
    suppress_health_check=list(HealthCheck),
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
    b"\0",
    b"\xff",
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
def test_a_trace_of_changed_bytes_is_read_or_refused(tmp_path, data):
    trace = b"# compute times [s]\n0.010\n0.012, 0.011\n0.013\n\n0.2; 0.05\n"
    (tmp_path / "trace.txt").write_bytes(data.draw(changed_text(trace) | st.binary(max_size=50)))
    override = "control.latency={trace='trace.txt'}"
    path = tmp_path / "scene.toml"
    path.write_bytes((library.data_folder("runs") / "crossing1.toml").read_bytes())
    with suppress(InputError):
        assert load_scenario(str(path), [override]).control.latency
