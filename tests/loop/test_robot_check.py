"""The check of robots: every shipped one is what it says, and one that is not is told."""

import json

import pytest

from mjnav.cli.main import main
from mjnav.scene.library import data_folder
from mjnav.scene.robot import robots


@pytest.mark.parametrize("name", robots())
def test_every_shipped_robot_does_what_it_is_commanded(name, capsys):
    code = main(["robot", "check", name, "--json"])
    found = json.loads(capsys.readouterr().out)
    assert [f for f in found["figures"] if not f["low"] <= f["value"] <= f["high"]] == []
    assert (code, found["holds"]) == (0, True)
    assert {f["manoeuvre"] for f in found["figures"]} == {"straight", "stop", "spin", "eight"}


def test_a_drive_with_a_wrong_factor_is_told(tmp_path, capsys):
    """1.7 in place of the calibrated factor: the check says which it asks for, and fails."""
    for name in ("robot.toml", "robot.xml"):
        text = (data_folder("models") / "robots" / "jackal" / name).read_text()
        (tmp_path / name).write_text(text.replace("turn_factor = 2.03", "turn_factor = 1.7"))
    assert main(["robot", "check", str(tmp_path / "robot.toml")]) == 1
    (row,) = [line for line in capsys.readouterr().out.splitlines() if "turn_factor that" in line]
    assert row.endswith("out")
    assert float(row.split("asks for")[1].split()[0]) == pytest.approx(2.03, rel=0.06)


def test_a_robot_that_is_none_is_bad_input(capsys):
    assert main(["robot", "check", "burgr"]) == 2
    assert "did you mean 'burger'" in capsys.readouterr().err
