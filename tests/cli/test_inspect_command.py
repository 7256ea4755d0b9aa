"""`mjnav inspect` on what `mjnav run` wrote, whole and damaged."""

import json

import pytest

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


def test_json_holds_what_the_run_printed(mjnav, tmp_path):
    ran = json.loads(mjnav("run", "crossing1", "--log", "b.mcap", "--json", *SHORT).out)
    printed = json.loads(mjnav("inspect", "b.mcap", "--json").out, parse_constant=pytest.fail)
    assert (printed["outcome"], printed["complete"], printed["truncated"]) == ("timeout", True, False)
    assert printed["duration_s"] == pytest.approx(0.3)
    assert printed["topics"]["/scan"]["messages"] == 3
    assert printed["run"]["scene"] == "crossing1"
    assert printed["result"] == ran
    assert {key: printed["figures"][key] for key in ("ticks", "path_length_m")} == {
        "ticks": 3,
        "path_length_m": pytest.approx(ran["path_length_m"], abs=1e-9),
    }
