"""The log of a run in real time, whose thread's disk fills up or whose descriptor is closed: the run ends in a line."""

import json
import re
import subprocess
from pathlib import Path

import pytest

from mjnav.log import open_log

pytestmark = pytest.mark.xdist_group("real time")

PATIENCE = 120.0  # [s] on a busy machine
NEVER = ("--set", "time_limit=1e4", "--set", "robot.goal=[9000.0, 0.0]", "--set", "stop_on_collision=false")  # to end
CLOSING = '''
import os
from mjnav.control.methods.mean import Mean

class Closing(Mean):
    """Closes the log's descriptor, as a library that tidies up would, and opens a file of its own in its place."""

    def decide(self, observation):
        for number in map(int, os.listdir("/proc/self/fd")):
            try:
                if observation.time > 0.5 and os.readlink(f"/proc/self/fd/{number}").endswith("a.mcap"):
                    os.close(number)
                    self.other = os.open("other", os.O_WRONLY | os.O_CREAT)
            except FileNotFoundError:
                pass
        return super().decide(observation)
'''


@pytest.fixture
def run(forked):
    """Starts a run as a process of its own."""

    def start(folder: Path, *words: str) -> subprocess.Popen:
        command = [*forked, "run", "crossing1", "--json", *words]
        return subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    return start


@pytest.mark.parametrize("pace", ["--real-time", "--no-real-time"])
def test_a_closed_descriptor_ends_the_run_in_a_line_and_no_other_file_gets_the_log(run, tmp_path, pace):
    (tmp_path / "closing.py").write_text(CLOSING)
    with run(tmp_path, pace, "--controller", "closing:Closing", "--log", "a.mcap", *NEVER) as process:
        out, err = process.communicate(timeout=PATIENCE)
    assert (process.returncode, json.loads(out)["outcome"]) == (1, "aborted")
    assert re.fullmatch(
        r"(mjnav: real time: .*\n)?"  # where the run has privileges
        r"mjnav: aborted after [0-9.]+ s, \d+ ticks: a\.mcap: writing failed: its descriptor was closed; "
        r"what is left of it can be read\n",
        err,
    )
    assert (tmp_path / "other").read_bytes() == b""
    assert open_log(tmp_path / "a.mcap").truncated


def test_a_disk_that_fills_up_under_the_logs_thread_ends_the_run_in_a_line(run, tmp_path):
    mount = ["mount", "-t", "tmpfs", "-o", "size=400k", "tmpfs", str(tmp_path)]
    mounted = subprocess.run(mount, capture_output=True, text=True, check=False)
    if mounted.returncode != 0:
        pytest.skip(f"no small file system can be mounted: {mounted.stderr.strip()}")
    try:
        log = tmp_path / "a.mcap"
        with run(tmp_path.parent, "--real-time", "--set", "control.rate=50", "--log", str(log), *NEVER) as process:
            out, err = process.communicate(timeout=PATIENCE)
        assert process.returncode == 1, err
        assert json.loads(out)["outcome"] == "aborted", err
        told = re.fullmatch(
            r"(?:mjnav: real time: .*\n)?"  # where the run has privileges
            rf"mjnav: aborted after ([0-9.]+) s, \d+ ticks: {log}: writing failed: No space left on device; "
            r"it can be read at least up to ([0-9.]+) s\n",
            err,
        )
        assert told, err
        assert 0.0 <= open_log(log).duration - float(told[2]) < 0.5
        assert float(told[1]) - float(told[2]) < 1.0  # simulated seconds between the fault and the run's end
    finally:
        subprocess.run(["umount", "--lazy", str(tmp_path)], check=True)
