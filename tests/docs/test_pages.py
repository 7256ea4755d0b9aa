"""Every code block of the documentation works as it stands: written or run in an empty folder, page by page.

The page with which users begin starts `mjnav` as they do; on the others its processes are forked, which is quicker.
"""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from tests.docs.blocks import blocks_of
from tests.docs.notebook import Notebook

pytestmark = pytest.mark.xdist_group("each alone")

ROOT = Path(__file__).parents[2]
FIRST = "docs/how-to/install.md"
PAGES = [page for page in sorted((ROOT / "docs").rglob("*.md")) if "_build" not in page.parts]


@pytest.mark.parametrize("page", [pytest.param(page, id=str(page.relative_to(ROOT))) for page in PAGES])
def test_blocks_work(page, tmp_path, request):
    folder = tmp_path / "folder"
    folder.mkdir()
    blocks = blocks_of(page)
    forked = str(page.relative_to(ROOT)) != FIRST and any(block.runs for block in blocks)
    with Notebook(folder, request.getfixturevalue("fork_server") if forked else None) as notebook:
        for block in blocks:
            notebook.play(block)


def test_the_completion_scripts_are_written_where_none_of_their_folders_exists(tmp_path, monkeypatch):
    home = tmp_path / "home"
    home.mkdir()
    monkeypatch.setenv("HOME", str(home))
    (block,) = [block for block in blocks_of(ROOT / "docs/how-to/shell.md") if "mjnav completion" in block.code]
    with Notebook(home) as notebook:
        notebook.play(replace(block, language="bash", classes=""))
    assert len([file for file in home.rglob("*mjnav*") if file.stat().st_size]) == 3


def test_the_site_has_every_tutorial_in_the_order_of_the_readme():
    readme = (ROOT / "README.md").read_text().partition("First steps:")[2]
    site = (ROOT / "docs" / "index.md").read_text().partition(":caption: Tutorials")[2]
    taught, listed = ([*dict.fromkeys(re.findall(r"tutorials/([\w-]+)", text))] for text in (readme, site))
    assert listed == taught
    assert sorted(listed) == sorted(page.stem for page in PAGES if page.parent.name == "tutorials")
