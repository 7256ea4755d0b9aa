"""What README.md shows is what happens."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

README = Path(__file__).parents[1] / "README.md"


def blocks(heading: str, language: str) -> list[str]:
    """The code blocks of a language from a heading on."""
    section = README.read_text().partition(f"# {heading}\n")[2]
    found = re.findall(r"^```(\w*)\n(.*?)^```$", section, flags=re.MULTILINE | re.DOTALL)
    return [code for name, code in found if name == language]


@pytest.fixture
def own_controller(tmp_path):
    code = blocks("A controller of your own", "python")[0]
    (tmp_path / "my_controllers.py").write_text(code)
    return code


def test_the_controller_of_ones_own_takes_forty_lines_at_most(own_controller):
    assert len(own_controller.splitlines()) <= 40


def test_the_controller_of_ones_own_runs_as_shown(own_controller, tmp_path):
    words = blocks("A controller of your own", "")[0].split()
    assert words[:2] == ["mjnav", "run"]
    done = subprocess.run(
        [sys.executable, "-m", "mjnav.cli.main", *words[1:]], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert done.stdout.startswith("crossing1, my_controllers:WorstCase, seed 0: goal after")
    assert list((tmp_path / "runs" / "out").glob("crossing1-my_controllers_WorstCase-0-*.mcap"))


def test_the_scene_of_ones_own_is_one(tmp_path):
    from mjnav.loop.prepare import load_scenario

    code = blocks("A scene of your own", "toml")[0]
    path = tmp_path / "corner.toml"
    path.write_text(code)
    assert load_scenario(path).name == "corner"


def test_the_table_of_controllers_is_the_registrys():
    from mjnav.control.registry import METHODS

    rows = re.findall(
        r"^\| `([a-z-]+)` \| [^|]+ \| ([^|]+) \| `(control/methods/\w+\.py)` \|$", README.read_text(), re.MULTILINE
    )
    assert rows == [(method.name, method.source, method.file) for method in METHODS.values()]


def test_every_command_has_a_row():
    from mjnav.cli.main import COMMANDS

    assert set(re.findall(r"^\| `mjnav ([a-z-]+) ", README.read_text(), flags=re.MULTILINE)) == set(COMMANDS)
