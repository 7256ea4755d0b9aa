"""`mjnav` itself: help, unknown words, and output that nobody takes."""

import os
import subprocess
import sys
import sysconfig
from importlib.metadata import version
from pathlib import Path

import pytest

from mjnav.cli.main import COMMANDS, main


def test_alone_it_prints_its_help(mjnav):
    said = mjnav()
    assert (said.code, said.err) == (0, "")
    words = " ".join(said.out.split())  # how lines are broken is the terminal's and argparse's matter
    for name, (_, text) in COMMANDS.items():
        assert f"{name} {text}" in words


@pytest.mark.parametrize("words", [["--help"], *([name, "--help"] for name in COMMANDS)])
def test_every_command_has_help(capsys, words):
    with pytest.raises(SystemExit) as ended:
        main(words)
    assert ended.value.code == 0
    assert capsys.readouterr().out.startswith(f"usage: mjnav {words[0]}" if len(words) > 1 else "usage: mjnav ")


def test_the_version_is_the_packages(mjnav):
    assert mjnav("--version").out == f"{version('mjnav')}\n"


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["rum", "hall"], "mjnav: command: found 'rum'; allowed: "),
        (["--jsn"], "mjnav: unrecognized arguments: --jsn"),
        (["run"], "mjnav: the following arguments are required: SCENE"),
        (["run", "hall", "table"], "mjnav: unrecognized arguments: table"),
        (["run", "hall", "--seed", "two"], "mjnav: argument --seed: invalid int value: 'two'"),
        (["run", "hall", "--log", "a", "--no-log"], "mjnav: argument --no-log: not allowed with argument --log"),
        (["inspect"], "mjnav: the following arguments are required: LOG"),
    ],
)
def test_words_that_make_no_sense_are_bad_input(mjnav, words, line):
    said = mjnav(*words)
    assert (said.code, said.out) == (2, "")
    assert said.err.startswith(line)
    assert len(said.err.splitlines()) <= 9  # the message, and the usage of a command with many options
    assert "Traceback" not in said.err


def test_an_unknown_option_is_answered_with_its_commands_usage(mjnav):
    said = mjnav("run", "hall", "--sed", "3")
    assert said.err.startswith("mjnav: unrecognized arguments: --sed 3\nusage: mjnav run ")


def test_the_nearest_command_is_named(mjnav):
    assert mjnav("rum").err.endswith("did you mean 'run'?\n")
    assert mjnav("insepct").err.endswith("did you mean 'inspect'?\n")


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


QUICK = ("--set", "physics.engine=kinematic", "--set", "time_limit=0.5", "--no-log")


def test_quiet_leaves_errors_and_the_exit_code(mjnav):
    mjnav("run", "crossing1", *QUICK)  # compiles, where it is the first, and says so
    assert mjnav("run", "crossing1", "-q", *QUICK) == (said := mjnav("run", "crossing1", "--quiet", *QUICK))
    assert (said.code, said.out, said.err) == (0, "", "")
    said = mjnav("run", "crossing1", "-q", "--set", "robot.radius=9")
    assert (said.code, said.out) == (2, "")
    assert said.err == "mjnav: --set: robot.radius: found 9.0; allowed: a number from 0.2 to 0.5 m\n"


def test_a_traceback_comes_on_request_alone(mjnav):
    words = ("run", "crossing1", "--set", "robot.radius=9")
    assert "Traceback" not in mjnav(*words).err
    said = mjnav(*words, "--traceback")
    assert (said.code, said.err.splitlines()[0]) == (2, "Traceback (most recent call last):")
    assert said.err.endswith("allowed: a number from 0.2 to 0.5 m\n")
