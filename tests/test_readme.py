"""What README.md shows is what happens."""

import re
from pathlib import Path

from tests.docs.blocks import blocks_of
from tests.docs.notebook import Notebook

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()


def test_the_table_of_controllers_is_the_registrys():
    from mjnav.control.registry import METHODS

    rows = re.findall(
        r"^\| `([a-z-]+)` \| ([^|]+) \| ([^|]+) \| `(control/methods/\w+\.py)` \|$", README, flags=re.MULTILINE
    )
    assert rows == [(method.name, method.idea, method.source, method.file) for method in METHODS.values()]


def test_every_link_leads_to_a_file():
    links = re.findall(r"\]\(([^)]+)\)", README)
    files = [link for link in links if not link.startswith("https://")]
    assert len(files) > 20
    assert [file for file in files if not (ROOT / file).is_file()] == []


def test_its_python_works(tmp_path):
    blocks = [block for block in blocks_of(ROOT / "README.md") if block.language == "python"]
    with Notebook(tmp_path) as notebook:
        for block in blocks:
            notebook.play(block)
    assert blocks
