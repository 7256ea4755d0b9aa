"""Any run file runs five ticks or is refused, and nothing else happens: no traceback, no warning, no hang.

Run files are made from the definitions of their keys (`run_files`), and of shipped ones whose bytes are changed.

MJNAV_FUZZ=N tries N random files in place of 300 fixed ones; 10 000 are a night's work:

    MJNAV_FUZZ=10000 nice -n 19 uv run pytest tests/attacks/test_fuzz_run_files.py --hypothesis-show-statistics
"""

import os
import signal
import tomllib
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import HealthCheck, event, given, settings
from hypothesis import strategies as st

import mjnav
from mjnav.errors import InputError
from mjnav.loop.episode import Episode
from mjnav.loop.prepare import load_scenario
from mjnav.loop.supervision import RunFault
from mjnav.scene import drafts, dumps, library, loads
from mjnav.scene.spec import Scenario
from mjnav.scene.toml import toml_text
from mjnav.world.engine import DivergedError
from tests.attacks.run_files import ANY_LEAF, ODD, RECORDING, modest, run_files

TICKS = 5
MOST_WORK = 1e9  # see `work`
TOO_LONG = 120  # [s] that five ticks of a small scene never take
TRIES = 2  # layouts of a random scene that has no room, each of which takes as long as a whole run


def document_of(name: str) -> dict:
    """The tables of a scene."""
    document = tomllib.loads((library.data_folder("runs") / f"{name}.toml").read_text())
    return document | {"layout": {"tries": TRIES}} if drafts.is_random(name) else document


SCENES = tuple(document_of(name) for name in library.names())
FILES = int(os.environ.get("MJNAV_FUZZ", "300"))

fuzzed = settings(
    max_examples=FILES,
    derandomize="MJNAV_FUZZ" not in os.environ,
    database=None,
    deadline=None,
    suppress_health_check=list(HealthCheck),
)


@contextmanager
def no_hang():
    """Ends what takes too long with a TimeoutError at the place where it hangs."""

    def ring(*_):
        raise TimeoutError(f"more than {TOO_LONG} s")

    before = signal.signal(signal.SIGALRM, ring)
    signal.alarm(TOO_LONG)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def work(scenario: Scenario) -> float:
    """About how many samples, pairs of samples, beams and steps five ticks go through."""
    control, people = scenario.control, 1 + len(scenario.people)
    p = {"samples": 25, "num_v": 20, "num_omega": 20, "rollouts": 400, "steps": 20, "num_iterations": 10} | {
        key: value for key, value in control.parameters.items() if isinstance(value, int)
    }
    bodies = people + len(scenario.walls) + len(scenario.pillars) + 4 * len(scenario.tables)
    pairs = p["num_v"] * p["num_omega"] * p["samples"] ** 2 * p["num_iterations"]
    readings = 1.0 + scenario.sensors.rate * control.period
    particles = scenario.estimation.robot.particles + people * scenario.estimation.obstacles.particles
    latency = control.latency
    late = control.delay * control.period if latency is None else max((latency.planned or 0.0, *latency.trace))
    return TICKS * (
        bodies * (pairs + p["rollouts"] * p["steps"] * p["samples"])
        + readings * (100.0 * particles + 30.0 * bodies * len(scenario.sensors.scanner.angles))
        + 1e3 * people * control.period / scenario.physics.timestep
        + 1e3 * p["samples"] * (late + control.period) / 0.1
    )


def five_ticks(scenario: Scenario, log=None) -> None:
    """Runs them; the physics may be lost, which is told as such."""
    asked = count()
    try:
        Episode(scenario, log=log, stop=lambda: next(asked) >= TICKS, cones=True).run()
    except RunFault as fault:
        if not isinstance(fault.__cause__, DivergedError):
            raise
        return


def read_again(path, scenario: Scenario) -> None:
    log = mjnav.open_log(path)
    assert log.complete
    assert log.scenario() == scenario
    assert np.isfinite(log.trajectory().command).all()
    for message in log.messages():
        assert message.value is not None


def check_refusal(told: str, start: str) -> None:
    assert told.startswith(start)
    assert len(told.splitlines()) == 1
    assert len(told) < 2000


def survive(document: dict, log: bool) -> str:
    """What became of a run file: refused, ran, or too large to run here; whatever else happens is raised."""
    with TemporaryDirectory() as folder, no_hang():
        path = Path(folder) / "fuzz.toml"
        (path.parent / "recording.txt").write_text(RECORDING)
        path.write_text(toml_text(document), encoding="utf-8", errors="surrogatepass")
        try:
            scenario = load_scenario(str(path))
        except InputError as error:
            check_refusal(str(error), f"{path}: ")
            return "refused"
        assert loads(dumps(scenario)) == scenario
        if work(scenario) > MOST_WORK:
            return "too large to run here"
        place = Path(folder) / "fuzz.mcap" if log else None
        five_ticks(scenario, place)
        if place is not None:
            read_again(place, scenario)
        return "ran"


@pytest.mark.nightly
@fuzzed
@given(run_files(SCENES), st.integers(0, 4))
def test_any_run_file_runs_five_ticks_or_is_refused(document, logged):
    event(survive(document, log=logged == 0))


@settings(fuzzed, max_examples=FILES // 3)
@given(run_files(SCENES), st.data())
def test_any_settings_on_the_command_line_run_or_are_refused(document, data):
    """KEY=VALUE of real keys, of keys that are none and of text that is neither."""
    leaf = data.draw(ANY_LEAF)
    value = data.draw(modest(leaf) | ODD)
    key = ".".join(map(str, leaf.path))
    text = toml_text({"_": value}).removeprefix("_ = ").strip() if not isinstance(value, dict) else str(value)
    override = data.draw(
        st.sampled_from((f"{key}={text}", f" {key} = {text}", f"{key}{text}", key, f".{key}=1")) | st.text()
    )
    with TemporaryDirectory() as folder:
        path = Path(folder) / "fuzz.toml"
        path.write_text(toml_text(document), encoding="utf-8", errors="surrogatepass")
        try:
            scenario = load_scenario(str(path), [override])
        except InputError as error:
            check_refusal(str(error), "")
        else:
            assert loads(dumps(scenario)) == scenario


PIECES = (b"[", b"]]", b"[[people]]\n", b'"', b"'''", b"=", b".", b"\0", b"\xff", b"9" * 5000, b"e999", b"[" * 3000)
RUN_FILES = tuple(path.read_bytes() for path in sorted(library.data_folder("runs").glob("*.toml")))


@st.composite
def changed_text(draw, content: bytes) -> bytes:
    """Bytes and pieces that are missing, come twice or are others."""
    for _ in range(draw(st.integers(1, 4))):
        place, other = draw(st.integers(0, len(content))), draw(st.integers(0, len(content)))
        between = draw(st.binary(max_size=3) | st.sampled_from(PIECES))
        content = content[:place] + between + content[draw(st.sampled_from((place, place + 1, other))) :]
    return content


@settings(fuzzed, max_examples=FILES // 10)
@given(st.sampled_from(RUN_FILES).flatmap(changed_text))
def test_a_run_file_of_changed_bytes_is_read_or_refused(content):
    with TemporaryDirectory() as folder:
        path = Path(folder) / "changed.toml"
        path.write_bytes(content)
        try:
            scenario = load_scenario(str(path))
        except InputError as error:
            check_refusal(str(error), f"{path}: ")
        else:
            assert loads(dumps(scenario)) == scenario
