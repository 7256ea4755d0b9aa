"""`mjnav avoidable`: what it says of real short logs, one and many, and what it refuses."""

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
