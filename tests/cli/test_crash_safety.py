"""However a run ends, what it wrote can be read, and one line says how it ended and where the log is."""

import json
import os
import re
import shutil
import signal
import struct
import subprocess
import time
from pathlib import Path

import pytest

from mjnav.cli.terminal import AT_ONCE
from mjnav.log import open_log
from tests.forking.command import Command
from tests.hanging_controllers import HANGING

pytestmark = pytest.mark.xdist_group("real time")

PATIENCE = 60.0  # [s] for a process to do on a busy machine what it does at once on an idle one
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
NEVER = ("--set", "time_limit=1e6", "--set", "robot.goal=[9000.0, 0.0]", "--set", "stop_on_collision=false")  # to end
MINE = (
    HANGING
    + '''
import ctypes, mmap, sys, time

class Noting(Mean):
    """Notes the time of its tick where it outlives the process."""

    def __init__(self, *arguments):
        super().__init__(*arguments)
        with open("noted", "r+b") as file:
            self.noted = memoryview(mmap.mmap(file.fileno(), 8)).cast("d")

    def decide(self, observation):
        self.noted[0] = observation.time
        return super().decide(observation)

class Breaking(Mean):
    def decide(self, observation):
        return super().decide(observation if observation.time < 0.75 else None)  # a bug

class Broken(Mean):
    def decide(self, observation):
        raise KeyError("never")

class Leaving(Mean):
    def decide(self, observation):
        sys.exit(7)

class Crashing(Mean):
    def decide(self, observation):
        ctypes.string_at(0) if observation.time > 0.45 else None
        return super().decide(observation)

class Slow(Mean):
    def decide(self, observation):
        time.sleep(0.2)
        return super().decide(observation)

class Stuck(Noting):
    def decide(self, observation):
        decision = super().decide(observation)
        time.sleep(60.0 * (observation.time > 0.35))
        return decision
'''
)


class Started:
    """A run as a process of its own."""

    def __init__(self, server: str, folder: Path, words: list[str]):
        self.folder = folder
        folder.mkdir()
        (folder / "mine.py").write_text(MINE)
        (folder / "noted").write_bytes(struct.pack("d", -1.0))
        self.log = folder / "logs" / "a.mcap"
        self.log.parent.mkdir()
        argv = ["run", "crossing1", "--log", "logs/a.mcap", *words]
        self._printed = [folder / name for name in ("out", "err")]
        with open(os.devnull) as nothing, self._printed[0].open("w") as out, self._printed[1].open("w") as err:
            descriptors = [nothing.fileno(), out.fileno(), err.fileno()]
            self._command = Command(server, argv, str(folder), os.environ, descriptors)
        self.code: int | None = None

    @property
    def noted(self) -> float:
        """The simulated time [s] of the tick in which `Noting` is, or was; negative before the first."""
        return struct.unpack("d", (self.folder / "noted").read_bytes())[0]

    def until(self, condition) -> None:
        ends = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < ends, "the run did not get there"
            time.sleep(0.01)

    def until_logged(self, size: int = 40_000) -> None:
        """Until there is a little more than the log's beginning."""
        self.until(lambda: self.log.exists() and self.log.stat().st_size > size)

    def kill(self, number: int) -> None:
        os.kill(self._command.number, number)

    def has_ended(self) -> bool:
        if self.code is None and self._command.has_ended():
            self.code = self._command.code()
        return self.code is not None

    def ended(self) -> tuple[int | None, str, str]:
        """Exit code, standard output, standard error."""
        self.until(self.has_ended)
        out, err = (file.read_text() for file in self._printed)
        return self.code, out, re.sub("mjnav: real time: .*\n", "", err)  # which root's runs say


@pytest.fixture
def start(fork_server, tmp_path):
    """Starts a run in a folder of its own."""
    started = []

    def start(*words: str) -> Started:
        started.append(Started(fork_server, tmp_path / str(len(started)), [*words]))
        return started[-1]

    yield start
    for run in started:
        if not run.has_ended():
            run.kill(signal.SIGKILL)
            run.ended()


def events(log) -> dict[str, str]:
    return {message.value.name: message.value.message for message in log.messages("/events")}


# ------------------------------------------------------------------------------------------- signals


def test_a_killed_run_loses_less_than_a_third_of_a_second_of_either_time(start):
    noting = ("--controller", "mine:Noting", "--set", "control.delay=0", *NEVER)
    paced = [start("--real-time", *noting) for _ in range(3)]
    quick = [start(*noting) for _ in range(3)]
    for moment, runs in enumerate(zip(paced, quick, strict=True)):
        for run in runs:
            run.until(lambda run=run, moment=moment: run.noted > 0.5 + 0.33 * moment)
            run.kill(signal.SIGKILL)
    for run in (*paced, *quick):
        code, _, err = run.ended()
        assert (code, err) == (-signal.SIGKILL, "")
        log = open_log(run.log)
        assert (log.complete, log.truncated, log.run["scene"]) == (False, True, "crossing1")
        assert run.noted - log.duration <= 0.3
        assert len(log.trajectory().command) >= 2


def test_the_first_signal_ends_the_run_and_its_log_in_order_and_says_where_it_is_whatever_comes_with_it(start):
    bursts = [*((number,) for number in SIGNALS), (signal.SIGINT, signal.SIGTERM, signal.SIGINT, signal.SIGHUP)]
    runs = [start("--real-time", "--json", *NEVER) for _ in bursts]
    for burst, run in zip(bursts, runs, strict=True):
        run.until_logged()
        for number in burst:
            run.kill(number)
    for run in runs:
        code, out, err = run.ended()
        printed, log = json.loads(out), open_log(run.log)
        assert (code, log.complete, log.truncated) == (130, True, False)
        assert printed["outcome"] == log.result["outcome"] == "aborted"
        assert printed["ticks"] == log.result["ticks"] == len(log.trajectory().command) > 0
        time_s, ticks = printed["time_s"], printed["ticks"]
        assert err == f"mjnav: interrupted: aborted after {time_s:.1f} s, {ticks} ticks; the log is logs/a.mcap\n"


def test_the_second_signal_ends_a_run_that_is_stuck_and_what_it_wrote_is_there(start):
    run = start("--controller", "mine:Stuck", "--set", "control.delay=0", *NEVER)
    run.until(lambda: run.noted > 0.35)
    run.kill(signal.SIGTERM)
    time.sleep(AT_ONCE + 0.1)
    assert not run.has_ended()
    run.kill(signal.SIGTERM)
    assert run.ended()[0] == -signal.SIGTERM
    log = open_log(run.log)
    assert (log.complete, log.duration) == (False, pytest.approx(0.2))


# ---------------------------------------------------------------------------------- controllers' bugs


@pytest.mark.parametrize("real_time", [(), ("--real-time",)])
def test_a_controller_that_raises_aborts_the_run_with_its_own_line_and_a_whole_log(start, real_time):
    bugs = {  # what is told of it, a part of its line, and ticks before it
        "Breaking": ("AttributeError: 'NoneType' object has no attribute '.*'", "# a bug", 7),
        "Broken": ("KeyError: 'never'", "raise KeyError", 0),
        "Leaving": ("SystemExit: 7", "sys.exit(7)", 0),
    }
    runs = {name: start("--json", "--controller", f"mine:{name}", *real_time) for name in bugs}
    for name, (what, part, ticks) in bugs.items():
        run = runs[name]
        code, out, err = run.ended()
        number = line(part)
        fault = rf"{what} \({run.folder}/mine.py:{number}, in decide\)"  # its own line, not mjnav's below it
        assert code == 1
        assert re.fullmatch(rf"mjnav: aborted after 0.{ticks} s, {ticks} ticks: {fault}; the log is logs/a.mcap\n", err)
        printed, log = json.loads(out), open_log(run.log)
        assert (log.complete, log.truncated) == (True, False)
        assert printed["outcome"] == log.result["outcome"] == "aborted"
        assert printed["ticks"] == log.result["ticks"] == ticks
        assert events(log)["fault"] in err
        assert f'mine.py", line {number}, in decide' in events(log)["traceback"]


def test_a_run_that_takes_too_long_is_ended_in_order_with_the_line_it_hangs_in(start):
    runs = {name: start("--controller", f"mine:{name}", "--max-seconds", "1") for name in ("Slow", "Hung", "Native")}
    expected = {  # what is told, and whether the log has its end
        "Slow": ("still running after 1 s on the wall", True),
        "Hung": (f"a tick hangs ({runs['Hung'].folder}/mine.py:{line('while observation')}, in decide)", True),
        "Native": (f"a tick hangs ({runs['Native'].folder}/mine.py:{line('sum(iter')}, in decide)", False),
    }
    for name, (text, whole) in expected.items():
        code, _, err = runs[name].ended()
        log = open_log(runs[name].log)
        assert (code, len(err.splitlines()), text in err) == (1, 1, True), err
        assert (log.complete, log.truncated) == (whole, not whole)
        assert len(log.trajectory().command) >= 2
        if whole:
            assert log.result["outcome"] == "aborted"
            assert text in events(log)["fault"]


def test_a_process_that_ends_by_itself_is_noticed_and_is_no_success(start):
    runs = {name: start("--controller", f"mine:{name}") for name in ("Exiting", "Crashing")}
    causes = {"Exiting": "exit code 0, as os._exit does", "Crashing": "SIGSEGV ("}
    for name, cause in causes.items():
        code, out, err = runs[name].ended()
        assert (code, out) == (1, "")
        assert err.startswith(f"mjnav: the process ended in the middle of its work: {cause}")
        assert open_log(runs[name].log).truncated
    assert f"{runs['Crashing'].folder}/mine.py:{line('ctypes.string_at')}, in decide" in err


def line(part: str) -> int:
    """The number of the line in mine.py."""
    return next(number for number, line in enumerate(MINE.splitlines(), 1) if part in line)


# ------------------------------------------------------------------------- what plug-ins of every kind raise

QUICK = ("--set", "physics.engine=kinematic", "--set", "time_limit=0.3")
FAULTY = '''
from dataclasses import dataclass
from mjnav.metrics import Figure

class Own(BaseException):
    """Neither an error nor an exit."""

class Mute(Exception):
    def __str__(self):
        raise ValueError("no text")
    __repr__ = __str__

def fail(here):
    if here == {moment!r}:
        raise {raised}

fail("import")

@dataclass(init=False)
class Faulty:
    """Of every kind."""

    mean, std, support = 0.0, 0.01, (-0.02, 0.02)
    figures = {{"figure": Figure("", "A figure.")}}

    def __init__(self, *arguments):
        fail("construction")

    def act(self, *arguments):
        fail("call")

    decide = update = predict = velocity = sample = logpdf = measure = act

'''
NAMED = {
    "controller": ("--controller", "{}"),
    "localizer": ("--set", "estimation.robot.localizer={}"),
    "tracker": ("--set", "estimation.obstacles.tracker={}"),
    "predictor": ("--set", "prediction.model={}"),
    "behaviour": ("--set", "people.0.behaviour={}"),
    "distribution": ("--set", "noise.gyro={{distribution={!r}}}"),
    "metric": ("--set", "metrics=[{!r}]"),
}
RAISED = {"SystemExit": "SystemExit(0)", "GeneratorExit": "GeneratorExit", "Own": "Own", "Mute": "Mute"}


@pytest.mark.parametrize("raised", RAISED)
@pytest.mark.parametrize("moment", ["import", "construction", "call"])
@pytest.mark.parametrize("kind", NAMED)
def test_whatever_a_plugin_raises_is_its_fault_and_said_in_a_line(mjnav, tmp_path, kind, moment, raised):
    (tmp_path / "faulty.py").write_text(FAULTY.format(moment=moment, raised=RAISED[raised]))
    own = "faulty.py:Faulty"
    option, value = NAMED[kind]
    said = mjnav("run", "crossing1", "--json", "--log", "a.mcap", *QUICK, option, value.format(own))
    line, log = said.err.strip(), tmp_path / "a.mcap"
    assert (raised in line, "faulty.py" in line, "\n" in line) == (True, True, False)
    if moment != "call" or kind in ("behaviour", "distribution"):  # which are asked before the first tick
        assert (said.code, own in line, log.exists()) == (1 if moment == "call" else 2, True, False)
        return
    code, outcome = (0, "timeout") if kind == "metric" else (1, "aborted")
    assert said.code == code
    result = open_log(log).result
    assert result["outcome"] == json.loads(said.out)["outcome"] == outcome
    (event,) = (e.value.message for e in open_log(log).messages("/events") if e.value.name in ("fault", "metric"))
    assert event in line


# ------------------------------------------------------------------------------------------- the disk


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 400 kB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=400k", "tmpfs", folder], capture_output=True)
    if mounted.returncode != 0:
        pytest.skip(f"no small file system can be mounted: {mounted.stderr.decode().strip()}")
    yield folder
    subprocess.run(["umount", "--lazy", folder], check=True)


@pytest.mark.skipif(shutil.which("mount") is None, reason="there is no mount")
def test_a_full_disk_aborts_the_run_and_what_is_on_it_can_be_read(start, small_disk):
    run = start("--json", "--log", str(small_disk / "a.mcap"), *NEVER)
    code, out, err = run.ended()
    assert (code, json.loads(out)["outcome"]) == (1, "aborted")
    told = re.fullmatch(
        rf"mjnav: aborted after [0-9.]+ s, \d+ ticks: {small_disk}/a.mcap: writing failed: "
        r"No space left on device; it can be read at least up to ([0-9.]+) s\n",
        err,
    )
    log = open_log(small_disk / "a.mcap")
    assert 0.0 <= log.duration - float(told[1]) < 0.5
    assert log.truncated
    assert log.result is None or log.result["outcome"] == "aborted"


def test_a_log_that_is_deleted_or_cut_short_is_noticed_and_ends_the_run(start):
    deleted, cut = (start("--json", *paced, *NEVER) for paced in ((), ("--real-time",)))
    for run in (deleted, cut):
        run.until_logged()
    shutil.rmtree(deleted.log.parent)
    os.truncate(cut.log, 45_000)
    assert deleted.ended()[0] == cut.ended()[0] == 1
    assert deleted.ended()[2].endswith("ticks: logs/a.mcap: writing failed: it was deleted; nothing of it is left\n")
    assert cut.ended()[2].endswith(
        "ticks: logs/a.mcap: writing failed: it was truncated; what is left of it can be read\n"
    )
    assert cut.log.stat().st_size == 45_000
    log = open_log(cut.log)
    assert (log.complete, log.truncated) == (False, True)
    assert json.loads(cut.ended()[1])["outcome"] == "aborted"
