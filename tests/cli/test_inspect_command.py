"""`mjnav inspect` on what `mjnav run` wrote, whole and damaged."""

import json
import subprocess

import pytest
from mcap.writer import Writer

SHORT = ("--set", "time_limit=0.3")


@pytest.fixture
def log(mjnav, tmp_path):
    assert mjnav("run", "crossing1", "--log", "a.mcap", *SHORT).code == 0
    return tmp_path / "a.mcap"


def test_it_says_how_the_run_went(mjnav, log):
    said = mjnav("inspect", log)
    assert (said.code, said.err) == (0, "")
    lines = said.out.splitlines()
    assert lines[0] == "timeout: 0.3 s of simulated time"
    assert lines[2] == "  scene crossing1, controller rkhs, seed 0, engine mujoco"
    assert not any(line.endswith(" ") for line in lines if line.startswith("  "))
    headings = [line for line in lines if line and not line.startswith((" ", "/"))]
    sections = ["worst moments", "figures", "timing", "result", "beliefs", "of", "robot", "person0", "topic"]
    assert [line.split("  ")[0].split(" by")[0] for line in headings[1:]] == sections
    assert any(line.split() == ["success", "no"] for line in lines)
    assert "  people 0: constant_velocity, takes no account of the robot" in lines
    figures = lines[lines.index("figures") : lines.index("timing")]
    assert [line for line in figures if line.startswith("  ") and line[2] != " "] == [
        f"  {group}" for group in ("ending", "path", "motion", "social", "decisions", "knowledge", "consistency")
    ]
    (scan,) = (line.split() for line in lines if line.startswith("/scan"))
    assert scan[1:7] == ["foxglove.LaserScan", "3", "-", "10.00", "0.100", "0.00"]
    assert "\x1b" not in said.out


@pytest.mark.parametrize("share", [0.3, 0.6, 0.95])
def test_any_readable_beginning_is_enough(mjnav, log, share):
    content = log.read_bytes()
    log.write_bytes(content[: int(share * len(content))])
    said = mjnav("inspect", log, "--json")
    assert (said.code, said.err) == (0, "")
    printed = json.loads(said.out)
    assert (printed["truncated"], printed["damage"]) == (True, None)
    text = mjnav("inspect", log)
    assert text.code == 0
    assert text.out.splitlines()[0].endswith("; the file is truncated")
    assert "no footer: the writer was killed, or the file was not copied whole" in text.out


@pytest.mark.parametrize(
    ("content", "code"),
    [
        (b"", 2),
        (b"garbage, and more than eight bytes of it", 2),
        (b"\x89MCAP0\r\n", 3),  # nothing in it can be read
        (b"\x89MCAP0\r\n\x06\xff\xff\xff\xff\xff\xff\xff\x0f", 3),  # a chunk of 2^60 bytes
    ],
)
def test_what_is_no_log_is_told_in_one_line(mjnav, tmp_path, content, code):
    path = tmp_path / "bad.mcap"
    path.write_bytes(content)
    said = mjnav("inspect", path)
    assert (said.code, said.out) == (code, "")
    assert said.err.startswith(f"mjnav: {path}: ")
    assert len(said.err.splitlines()) == 1


def test_what_can_be_read_of_a_damaged_log_is_printed_and_the_damage_told(mjnav, log):
    content = bytearray(log.read_bytes())
    content[content.index(b"lz4") + 200] ^= 0xFF
    log.write_bytes(content)
    said = mjnav("inspect", log)
    assert said.code == 3
    assert said.out.splitlines()[0] == "timeout: 0.3 s of simulated time; the file is damaged"
    assert said.err.startswith(f"mjnav: {log}: damaged: bytes ")
    assert len(said.err.splitlines()) == 1
    assert "a chunk that does not match its checksum" in said.out
    printed = mjnav("inspect", log, "--json")
    assert (printed.code, printed.err) == (3, said.err)
    found = json.loads(printed.out)
    assert (found["outcome"], len(found["damage"]["lost"])) == ("timeout", 1)


def test_nothing_in_a_foreign_log_moves_the_cursor(mjnav, tmp_path):
    path = tmp_path / "foreign.mcap"
    with open(path, "wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/clear\x1b[2J[bold]\n", "text", 0)
        writer.add_message(channel, 5, b"hello", 5)
        writer.add_metadata("mjnav/run", {"scene": "\x1b]0;title\x07", "version.\r": "\u202e"})
        writer.finish()
    said = mjnav("inspect", path)
    assert said.code == 0
    assert all(c.isprintable() or c == "\n" for c in said.out)
    assert "[bold]" in said.out


def test_a_pipe_that_takes_only_the_first_line_is_no_error(start, log):
    inspect = start("inspect", log)
    head = subprocess.run(["head", "-n", "1"], stdin=inspect.stdout, capture_output=True, text=True, check=True)
    inspect.stdout.close()
    assert head.stdout == "timeout: 0.3 s of simulated time\n"
    assert inspect.stderr.read() == ""
    assert inspect.wait() == 0
