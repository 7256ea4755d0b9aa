"""Every command that reads a log ends with an exit code, however the log was changed: done, bad input or damaged.

A command added to COMMANDS is tried with all changes. MJNAV_FUZZ=N tries N random logs in place of a few fixed ones.
"""

import io
import json
import os
import resource
import shutil
import signal
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer

from mjnav.cli.main import main
from mjnav.errors import DamagedLogError, InputError
from mjnav.log import open_log
from tests.log.conftest import made_up_log
from tests.log.mutated_logs import mutated_logs

COMMANDS = {
    "inspect": ("inspect", "{log}"),
    "inspect --json": ("inspect", "{log}", "--json"),
    "recover": ("recover", "{log}", "{out}.mcap"),
    "report": ("report", "{log}", "-o", "{out}.html"),
    "export csv": ("export", "{log}", "{out}-csv", "--format", "csv"),
    "export rosbag2": ("export", "{log}", "{out}-bag", "--format", "rosbag2"),
    "replay": ("replay", "{log}"),
}
MEMORY = 1 << 30  # [bytes] that a reader may map beyond what was there
DIFFERS = 1  # what replay ends with where the run is another, as that of a made-up log is
PATIENCE = 60  # [s] after which a reader of some kB hangs

EXAMPLES = int(os.environ.get("MJNAV_FUZZ", "20"))
fuzzed = settings(
    max_examples=EXAMPLES,
    derandomize="MJNAV_FUZZ" not in os.environ,
    database=None,
    suppress_health_check=list(HealthCheck),
)


class Hangs(BaseException):
    """No reader may catch it."""


@contextmanager
def bounded():
    """An end to memory and time: MemoryError and Hangs where a reader takes more than it may."""

    def too_long(number, frame):
        raise Hangs(f"still at work after {PATIENCE} s")

    with open("/proc/self/statm") as file:
        mapped = int(file.read().split()[0]) * resource.getpagesize()
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    before = signal.signal(signal.SIGALRM, too_long)
    resource.setrlimit(resource.RLIMIT_AS, (mapped + MEMORY, hard))
    signal.alarm(PATIENCE)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def call(words, folder):
    """The command's exit code, and what it said on standard output and error."""
    out, err = io.StringIO(), io.StringIO()
    for left in folder.glob("out*"):
        shutil.rmtree(left) if left.is_dir() else left.unlink()
    words = [word.format(log=folder / "log.mcap", out=folder / "out") for word in words]
    with redirect_stdout(out), redirect_stderr(err), bounded():
        code = main(words)
    return code, out.getvalue(), err.getvalue()


class Unprinted(bytes):
    """Hypothesis cannot tell what failed where an argument's text is long; a log that fails is left in its folder."""

    def __repr__(self):
        return f"<{len(self)} bytes>"


@st.composite
def changed(draw, sound):
    return Unprinted(draw(st.sampled_from(sound).flatmap(mutated_logs)))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fuzz")


@pytest.fixture(scope="module")
def sound(folder):
    """The bytes of small sound logs: a run's, and another program's."""
    foreign = io.BytesIO()
    writer = Writer(foreign, chunk_size=200, compression=CompressionType.ZSTD)
    writer.start("ros2", "rosbag2")
    for topic in ("/chatter", "/command"):
        schema = writer.register_schema(topic, "ros2msg", b"string data")
        channel = writer.register_channel(topic, "json" if topic == "/command" else "cdr", schema)
        for i in range(9):
            writer.add_message(channel, i * 10**8, b'{"tick": 1}', 0, i)
    writer.finish()
    return tuple(map(Unprinted, (made_up_log(folder / "run.mcap", 6).read_bytes(), foreign.getvalue())))


@pytest.mark.parametrize("words", COMMANDS.values(), ids=COMMANDS)
@fuzzed
@given(st.data())
def test_a_command_ends_with_an_exit_code_for_any_log(words, sound, folder, data):
    content = data.draw(changed(sound))
    (folder / "log.mcap").write_bytes(content)
    code, out, err = call(words, folder)
    assert code in (0, 2, 3) or (words[0], code) == ("replay", DIFFERS)
    assert (err == "") == (code in (0, DIFFERS))
    assert len(err.splitlines()) <= 2
    assert "Traceback" not in err
    if "--json" in words:
        assert (out == "") == (code == 2)
        if out:
            json.loads(out, parse_constant=pytest.fail)


@fuzzed
@given(st.data())
def test_the_library_raises_only_its_own_errors_for_any_log(sound, folder, data):
    path = folder / "log.mcap"
    path.write_bytes(data.draw(changed(sound)))
    with bounded(), suppress(InputError, DamagedLogError):
        log = open_log(path)
        for ask in (log.trajectory, log.scenario, lambda: list(log.messages())):
            with suppress(InputError, DamagedLogError):
                ask()
