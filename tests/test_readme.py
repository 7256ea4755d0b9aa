"""What README.md shows is what happens."""

import re
from pathlib import Path

README = (Path(__file__).parents[1] / "README.md").read_text()


def test_the_table_of_controllers_is_the_registrys():
    from mjnav.control.registry import METHODS

    rows = re.findall(
        r"^\| `([a-z-]+)` \| ([^|]+) \| ([^|]+) \| `(control/methods/\w+\.py)` \|$", README, flags=re.MULTILINE
    )
    assert rows == [(method.name, method.idea, method.source, method.file) for method in METHODS.values()]


def test_every_command_has_a_row():
    from mjnav.cli.main import COMMANDS

    assert set(re.findall(r"^\| `mjnav ([a-z-]+) ", README, flags=re.MULTILINE)) == set(COMMANDS)
