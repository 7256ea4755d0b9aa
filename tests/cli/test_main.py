"""`mjnav` itself: help, unknown words, and output that nobody takes."""

import os
import subprocess
import sys
import sysconfig
from importlib.metadata import version
from pathlib import Path

import pytest

from mjnav.cli.main import COMMANDS, main
from tests.cli.conftest import Said


def test_alone_it_prints_its_help(mjnav):
    said = mjnav()
    assert (said.code, said.err) == (0, "")
    words = " ".join(said.out.split())  # how lines are broken is the terminal's and argparse's matter
    for name, (_, text) in COMMANDS.items():
        assert f"{name} {text}" in words
    headings = [line for line in said.out.splitlines() if line.endswith(":")]
    assert headings == ["run:", "look at a run:", "study:", "advanced:"]


@pytest.mark.parametrize("words", [[], ["list"]])
def test_help_is_a_word_too(mjnav, capsys, words):
    shown = []
    for asked in (["help", *words], [*words, "--help"]):
        with pytest.raises(SystemExit) as ended:
            main(asked)
        assert ended.value.code == 0
        shown.append(capsys.readouterr())
    assert shown[0] == shown[1]
    assert shown[0].out.startswith(" ".join(["usage: mjnav", *words]))
    assert mjnav("help", "rnu").err.endswith("did you mean 'run'?\n")


def test_the_help_of_list_names_what_it_lists(capsys):
    with pytest.raises(SystemExit):
        main(["list", "--help"])
    words = capsys.readouterr().out.replace("-\n", "-").split()
    assert {"scenes,", "controllers,", "filters,", "metrics"} <= {*words}


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
        (["--jsn"], "mjnav: mjnav has no option --jsn; `mjnav --help` shows "),
        (["run"], "mjnav: the following arguments are required: SCENE"),
        (["run", "hall", "table"], "mjnav: mjnav run does not take 'table'; `mjnav run --help` shows "),
        (
            ["run", "hall", "--set", "seed", "3"],
            "mjnav: argument --set: found 'seed'; allowed: KEY=VALUE in one word, ",
        ),
        (
            ["run", "--set", "seed", "3", "hall"],
            "mjnav: argument --set: found 'seed'; allowed: KEY=VALUE in one word, ",
        ),
        (["run", "hall", "--seed", "two"], "mjnav: argument --seed: invalid int value: 'two'"),
        (["run", "hall", "--log", "a", "--no-log"], "mjnav: argument --no-log: not allowed with argument --log"),
        (["inspect"], "mjnav: the following arguments are required: LOG"),
    ],
)
def test_words_that_make_no_sense_are_bad_input(mjnav, words, line):
    said = mjnav(*words)
    assert (said.code, said.out) == (2, "")
    assert said.err.startswith(line)
    assert len(said.err.splitlines()) == 1
    assert "Traceback" not in said.err


@pytest.mark.parametrize(
    ("words", "answer"),
    [
        ("run hall --sed 3", "mjnav run has no option --sed; did you mean --seed?"),
        ("compare hall --jsn", "mjnav compare has no option --jsn; did you mean --json?"),
        ("run hall --SEED=3", "mjnav run has no option --SEED; did you mean --seed?"),
        (
            "run hall --seeds 3",
            "mjnav run has no option --seeds; `mjnav run` takes one --seed, `mjnav sweep` runs many",
        ),
        (
            "run --seeds 3 hall",
            "mjnav run has no option --seeds; `mjnav run` takes one --seed, `mjnav sweep` runs many",
        ),
        ("export a --format tum -o b", "mjnav export has no option -o; OUT stands after LOG: `mjnav export LOG OUT`"),
        ("sweep methods -x", "mjnav sweep has no option -x; `mjnav sweep --help` shows what it takes"),
    ],
)
def test_an_unknown_option_is_answered_with_the_one_that_was_meant(mjnav, words, answer):
    assert mjnav(*words.split()) == Said(2, "", f"mjnav: {answer}\n")


def test_verbose_is_answered_with_what_shows_more(mjnav):
    for words in (["-v"], ["run", "hall", "-v"], ["run", "--verbose", "hall"]):
        said = mjnav(*words)
        assert (said.code, said.err.count("\n")) == (2, 1)
        assert "`mjnav inspect LOG`" in said.err


def test_the_nearest_name_is_named_whatever_its_case(mjnav):
    assert mjnav("rum").err.endswith("did you mean 'run'?\n")
    assert mjnav("insepct").err.endswith("did you mean 'inspect'?\n")
    assert mjnav("RUN", "hall").err.endswith("did you mean 'run'?\n")
    assert mjnav("run", "hall", "--controller", "MPPI").err.endswith("did you mean 'mppi'?\n")
    assert mjnav("show", "HALL").err.endswith("did you mean 'hall'?\n")


def test_a_log_goes_where_o_says(mjnav, tmp_path):
    for option in ("-o", "--output", "--log"):
        assert mjnav("run", "crossing1", *QUICK[:-1], option, f"a{option}.mcap").code == 0
        assert (tmp_path / f"a{option}.mcap").exists()


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
