"""`mjnav` itself: help, unknown words, and output that nobody takes."""

import os
import subprocess
import sys
import sysconfig
from importlib.metadata import version
from pathlib import Path

import pytest

from mjnav.cli.main import COMMANDS


def test_alone_it_prints_its_help(mjnav):
    said = mjnav()
    assert (said.code, said.err) == (0, "")
    words = " ".join(said.out.split())  # how lines are broken is the terminal's and argparse's matter
    for name, (_, text) in COMMANDS.items():
        assert f"{name} {text}" in words
    headings = [line for line in said.out.splitlines() if line.endswith(":")]
    assert headings == ["run:", "look at a run:", "study:", "advanced:"]


def test_the_version_is_the_packages(mjnav):
    assert mjnav("--version").out == f"{version('mjnav')}\n"


def test_a_reader_that_leaves_early_is_no_error():
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run(
        [sys.executable, "-m", "mjnav.cli.main", "list"], stdout=write, stderr=subprocess.PIPE, check=False
    )
    os.close(write)
    assert (done.returncode, done.stderr) == (0, b"")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_output_that_cannot_be_written_is_told_in_one_line():
    with open("/dev/full", "wb") as full:
        done = subprocess.run(
            [sys.executable, "-m", "mjnav.cli.main", "list"], stdout=full, stderr=subprocess.PIPE, check=False
        )
    assert (done.returncode, done.stderr) == (1, b"mjnav: [Errno 28] No space left on device\n")


def test_the_installed_program_is_this_one(tmp_path):
    program = Path(sysconfig.get_path("scripts")) / "mjnav"
    done = subprocess.run([program, "--version"], capture_output=True, text=True, cwd=tmp_path, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, f"{version('mjnav')}\n", "")
