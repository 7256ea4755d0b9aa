"""`mjnav export` on what `mjnav run` wrote: whole, cut off, damaged, and not a log at all."""

import csv
import json
import re
import signal
import subprocess
import sys
import time

import pytest
from mcap.writer import Writer

PATIENCE = 60.0  # [s] for a process on a busy machine
WITHOUT_ROSBAGS = "import sys; sys.modules['rosbags'] = None; from mjnav.cli.main import main; sys.exit(main())"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    from mjnav.cli.main import main

    path = tmp_path_factory.mktemp("log") / "a.mcap"
    kinematic = ("--set", "time_limit=1.5", "--set", "physics.engine=kinematic", "--json")
    assert main(["run", "crossing1", "--log", str(path), *kinematic]) == 0
    return path


@pytest.mark.parametrize(
    ("form", "name", "count", "unit"),
    [
        ("tum", "robot_truth.tum", 16, "poses"),
        ("csv", "command.csv", 15, "rows"),
        ("parquet", "command.parquet", 15, "rows"),
        ("rosbag2", "/scan", 15, "messages"),
    ],
)
def test_it_says_what_it_wrote(mjnav, whole, tmp_path, form, name, count, unit):
    said = mjnav("export", whole, "out", "--format", form)
    assert (said.code, said.err) == (0, "")
    first, *lines = said.out.splitlines()
    assert first == "out: 1.5 s of simulated time"
    assert [name, str(count), unit] in [line.split() for line in lines]
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    again = mjnav("export", whole, "out", "--format", form)
    assert (again.code, again.out) == (2, "")
    assert again.err == "mjnav: out: exists already, and an export never replaces anything; choose another name\n"


def test_json_says_the_same(mjnav, whole):
    printed = json.loads(mjnav("export", whole, "out", "--format", "csv", "--topic", "/command", "--json").out)
    assert printed == {
        "schema": 1,
        "format": "csv",
        "output": "out",
        "complete": True,
        "truncated": False,
        "duration_s": pytest.approx(1.5),
        "written": {"command.csv": 15},
    }


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (
            ("--format", "rosbag"),
            "--format: found 'rosbag'; allowed: csv, parquet, rosbag2, tum; did you mean 'rosbag2'?",
        ),
        (("--format", "csv", "--topic", "/scann"), "did you mean '/scan'?"),
        (("--format", "tum", "--topic", "/scan"), "--topic needs --format csv or parquet"),
        (("--format", "csv", "--topic", ""), "--topic: found ''; allowed: /belief/obstacles, "),
        ((), "the following arguments are required: --format"),
    ],
)
def test_words_that_make_no_sense_are_refused_before_anything_is_read(mjnav, tmp_path, words, line):
    said = mjnav("export", "missing.mcap", "out", *words)
    assert (said.code, said.out) == (2, "")
    assert line in said.err.splitlines()[0]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("form", ["tum", "csv", "parquet", "rosbag2"])
def test_a_log_that_was_cut_off_gives_what_is_there_and_says_so(mjnav, whole, tmp_path, form):
    content = whole.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(content[: int(0.6 * len(content))])
    said = mjnav("export", "cut.mcap", "out", "--format", form)
    assert (said.code, said.err) == (0, "")
    assert "the log has no end, its writer was killed" in said.out.splitlines()[1]
    if form == "csv":
        with open(tmp_path / "out" / "command.csv", newline="") as file:
            ticks = [int(row["tick"]) for row in csv.DictReader(file)]
        assert ticks == list(range(len(ticks)))
        assert 0 < len(ticks) < 15


def test_a_damaged_log_is_sent_to_recover(mjnav, whole, tmp_path):
    content = bytearray(whole.read_bytes())
    content[content.index(b"lz4") + 200] ^= 0xFF
    (tmp_path / "bad.mcap").write_bytes(content)
    said = mjnav("export", "bad.mcap", "out", "--format", "csv")
    assert (said.code, said.out) == (3, "")
    assert said.err.splitlines()[0].startswith("mjnav: bad.mcap: damaged")
    assert said.err.splitlines()[1:] == ["`mjnav recover bad.mcap OUT.mcap` saves what can be read"]
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("messages", [0, 3])
def test_another_programs_log_is_bad_input(mjnav, tmp_path, messages):
    with open(tmp_path / "foreign.mcap", "wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/command", "json", 0)
        for i in range(messages):
            writer.add_message(channel, i, b'{"v": 1, "omega": 2}', 0)
        writer.finish()
    said = mjnav("export", "foreign.mcap", "out", "--format", "csv")
    assert (said.code, said.out) == (2, "")
    assert said.err == "mjnav: foreign.mcap: not a run of mjnav, and no other log can be exported\n"


def test_a_log_that_was_killed_before_its_first_message_is_bad_input(mjnav, whole, tmp_path):
    content = whole.read_bytes()
    (tmp_path / "a.mcap").write_bytes(content[: content.index(b"foxglove-layout.json")])
    said = mjnav("export", "a.mcap", "out", "--format", "tum")
    assert (said.code, said.err) == (2, "mjnav: a.mcap: holds no messages to export\n")


def test_a_bag_without_rosbags_names_what_to_install_and_the_rest_needs_it_not(whole, tmp_path):
    def export(form):
        command = [sys.executable, "-c", WITHOUT_ROSBAGS, "export", whole, f"out-{form}", "--format", form]
        return subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)

    done = export("rosbag2")
    assert (done.returncode, done.stdout) == (2, "")
    assert re.fullmatch(r"mjnav: rosbags is not installed: (uv|pip|\S+python) .*(ros2|rosbags.*)\n", done.stderr)
    assert export("tum").returncode == 0
    assert [path.name for path in tmp_path.iterdir()] == ["out-tum"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_export_leaves_nothing(mjnav, start, tmp_path, number):
    endless = ("--set", "time_limit=20", "--set", "stop_on_collision=false", "--set", "robot.goal_tolerance=0.001")
    assert mjnav("run", "crossing1", "--log", "a.mcap", "--set", "physics.engine=kinematic", *endless).code == 0
    process = start("export", "a.mcap", "out", "--format", "csv")
    ends = time.monotonic() + PATIENCE
    while not any(path.name.startswith(".out-") for path in tmp_path.iterdir()):
        assert time.monotonic() < ends, "the export did not begin"
        time.sleep(0.005)
    process.send_signal(number)
    out, err = process.communicate(timeout=PATIENCE)
    assert (process.returncode, out, err) == (130, "", "mjnav: interrupted\n")
    assert [path.name for path in tmp_path.iterdir()] == ["a.mcap"]
