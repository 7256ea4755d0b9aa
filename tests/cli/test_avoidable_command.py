"""`mjnav avoidable`: what it says of real short logs, one and many, and what it refuses."""

import json

import pytest

KINEMATIC = ("--set", "physics.engine=kinematic")
DEAD_END = """
schema = 1
name = "dead end"
time_limit = 4.0
[robot]
start = [0.0, 0.0, 0.0]
goal = [6.0, 0.0]
[[walls]]
from = [-0.6, 0.4]
to = [6.0, 0.4]
[[walls]]
from = [-0.6, -0.4]
to = [6.0, -0.4]
[[walls]]
from = [-0.5, -0.4]
to = [-0.5, 0.4]
[[people]]
start = [3.0, 0.0]
behaviour = "constant_velocity"
velocity = [-1.5, 0.0]
[physics]
engine = "kinematic"
"""


@pytest.fixture
def logs(mjnav, tmp_path):
    """A robot that is run over in a dead end, and one that has 1 s for a way of 15 s."""
    (tmp_path / "end.toml").write_text(DEAD_END)
    folder = tmp_path / "logs"
    folder.mkdir()
    assert mjnav("run", "end.toml", "--log", folder / "a.mcap", "--set", "control.method=mean").code == 0
    assert mjnav("run", "crossing1", *KINEMATIC, "--set", "time_limit=1", "--log", folder / "b.mcap").code == 0
    return folder


def test_a_line_a_run_and_a_table_of_the_methods(mjnav, logs):
    said = mjnav("avoidable", logs)
    assert (said.code, said.err) == (0, "")
    heads, hit, late, _, _, mean, rkhs, note = said.out.splitlines()
    assert heads.split("  ")[0] == "method"
    assert hit.split()[:6] == ["mean", "dead", "end", "0", "collision", "person0"]
    assert "  the robot " in hit
    assert hit.split()[-6:-2] == ["no", "no", "-", "-"]
    assert late.split()[:4] == ["rkhs", "crossing1", "0", "timeout"]
    assert late.split()[4:10] == ["-", "-", "-", "-", "-", "no"]
    assert mean.split()[:2] == ["mean", "1"]
    assert "0 of 1, 0 % [0, 79]" in mean
    assert rkhs.split()[:3] == ["rkhs", "1", "-"]
    assert note == "shares with 95 % intervals; times are means a run"


def test_json_is_the_same_every_time_and_counts_a_log_once(mjnav, logs):
    printed = mjnav("avoidable", logs, "--json").out
    assert mjnav("avoidable", logs / "a.mcap", logs, "--json").out == printed
    found = json.loads(printed, parse_constant=pytest.fail)
    hit, late = found["logs"]
    assert hit["collision"]["name"] == "person0"
    assert hit["collision"]["who_moved"].startswith("the robot ")
    assert (hit["collision"]["avoidable_2s_before"], hit["collision"]["avoidable_1s_before"]) == (False, False)
    assert (late["collision"], late["timeout_avoidable"], hit["timeout_avoidable"]) == (None, False, None)
    inspected = json.loads(mjnav("inspect", logs / "a.mcap", "--json").out)["figures"]
    assert hit["stalled_s"] == inspected["stalled_s"]
    assert found["methods"]["mean"]["avoidable_2s_before"] == {
        "count": 0, "of": 1, "interval": [0.0, pytest.approx(0.793, abs=1e-3)],
    }  # fmt: skip


def test_what_cannot_be_read_is_told_after_the_rest(mjnav, logs, tmp_path):
    (logs / "c.mcap").write_bytes(b"garbage, and more than eight bytes of it")
    said = mjnav("avoidable", logs)
    assert said.code == 2
    assert "dead end" in said.out
    assert said.err == f"mjnav: {logs / 'c.mcap'}: not an MCAP file\n"
    (tmp_path / "empty").mkdir()
    for given, line in (
        ("gone.mcap", "gone.mcap: cannot be read: No such file or directory"),
        ("empty", "empty: a folder without logs (*.mcap) and without results of a sweep"),
        ("method", "LOG: found 'method'; allowed: a log, a folder of logs, or "),
    ):
        said = mjnav("avoidable", given)
        assert (said.code, said.out, said.err.count("\n")) == (2, "", 1)
        assert said.err.startswith(f"mjnav: {line}")
