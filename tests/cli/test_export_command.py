"""`mjnav export` on what `mjnav run` wrote: whole, cut off, damaged, and not a log at all."""

import signal
import time

import pytest

PATIENCE = 60.0  # [s] for a process on a busy machine


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
