"""What README.md shows is what happens."""

import re
import subprocess
import sys
from pathlib import Path

README = (Path(__file__).parents[1] / "README.md").read_text()


def block(heading: str, language: str) -> str:
    """The first code block of a language below a heading."""
    section = README.partition(f"# {heading}\n")[2]
    found = re.findall(r"^```(\w*)\n(.*?)^```$", section, flags=re.MULTILINE | re.DOTALL)
    return next(code for name, code in found if name == language)


def test_the_readmes_own_controller_runs_as_shown(tmp_path):
    (tmp_path / "my_controllers.py").write_text(block("A controller of your own", "python"))
    words = block("A controller of your own", "").split()
    assert words[:2] == ["mjnav", "run"]
    done = subprocess.run(
        [sys.executable, "-m", "mjnav.cli.main", *words[1:]], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert done.stdout.startswith("crossing1, my_controllers:WorstCase, seed 0: goal after")
    assert list((tmp_path / "runs" / "out").glob("crossing1-my_controllers_WorstCase-0-*.mcap"))


def test_the_readmes_own_scene_is_one(tmp_path):
    from mjnav.loop.prepare import load_scenario

    path = tmp_path / "corner.toml"
    path.write_text(block("A scene of your own", "toml"))
    assert load_scenario(path).name == "corner"


def test_the_table_of_controllers_is_the_registrys():
    from mjnav.control.registry import METHODS

    rows = re.findall(
        r"^\| `([a-z-]+)` \| ([^|]+) \| ([^|]+) \| `(control/methods/\w+\.py)` \|$", README, flags=re.MULTILINE
    )
    assert rows == [(method.name, method.idea, method.source, method.file) for method in METHODS.values()]


def test_every_command_has_a_row():
    from mjnav.cli.main import COMMANDS

    assert set(re.findall(r"^\| `mjnav ([a-z-]+) ", README, flags=re.MULTILINE)) == set(COMMANDS)
