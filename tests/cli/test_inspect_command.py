"""`mjnav inspect` on what `mjnav run` wrote, whole and damaged."""

import json
import subprocess

import pytest

SHORT = ("--set", "time_limit=0.3")


@pytest.fixture
def log(mjnav, tmp_path):
    assert mjnav("run", "crossing1", "--log", "a.mcap", *SHORT).code == 0
    return tmp_path / "a.mcap"


def test_it_says_how_the_run_went(mjnav, log):
    said = mjnav("inspect", log)
    assert (said.code, said.err) == (0, "")
    assert said.out.startswith("timeout: 0.3 s of simulated time\n")
    assert not any(line.endswith(" ") for line in said.out.splitlines() if line.startswith("  "))


def test_json_holds_what_the_run_printed(mjnav, log):
    printed = json.loads(mjnav("inspect", log, "--json").out, parse_constant=pytest.fail)
    assert (printed["outcome"], printed["complete"], printed["truncated"]) == ("timeout", True, False)
    assert printed["duration_s"] == pytest.approx(0.3)
    assert printed["topics"]["/scan"]["messages"] == 3
    assert printed["run"]["scene"] == "crossing1"
    assert printed["result"]["ticks"] == 3


@pytest.mark.parametrize("share", [0.3, 0.6, 0.95])
def test_any_readable_beginning_is_enough(mjnav, log, share):
    content = log.read_bytes()
    log.write_bytes(content[: int(share * len(content))])
    said = mjnav("inspect", log, "--json")
    assert said.code == 0
    assert json.loads(said.out)["truncated"]


@pytest.mark.parametrize(
    ("content", "code"),
    [
        (b"", 2),
        (b"garbage, and more than eight bytes of it", 2),
        (b"\x89MCAP0\r\n", 3),  # nothing in it can be read
    ],
)
def test_what_is_no_log_is_told_in_one_line(mjnav, tmp_path, content, code):
    path = tmp_path / "bad.mcap"
    path.write_bytes(content)
    said = mjnav("inspect", path)
    assert (said.code, said.out) == (code, "")
    assert said.err.startswith(f"mjnav: {path}: ")
    assert len(said.err.splitlines()) == 1


def test_a_log_with_a_changed_byte_is_damaged(mjnav, log):
    content = bytearray(log.read_bytes())
    content[content.index(b"lz4") + 200] ^= 0xFF
    log.write_bytes(content)
    said = mjnav("inspect", log)
    assert (said.code, said.out) == (3, "")
    assert "damaged" in said.err


def test_missing_files_and_folders_are_bad_input(mjnav, tmp_path):
    assert mjnav("inspect", "nowhere.mcap").code == 2
    assert mjnav("inspect", tmp_path).code == 2


def test_a_pipe_that_takes_only_the_first_line_is_no_error(start, log):
    inspect = start("inspect", log)
    head = subprocess.run(["head", "-n", "1"], stdin=inspect.stdout, capture_output=True, text=True, check=True)
    inspect.stdout.close()
    assert head.stdout == "timeout: 0.3 s of simulated time\n"
    assert inspect.stderr.read() == ""
    assert inspect.wait() == 0
