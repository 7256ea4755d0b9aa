"""Every code block of the documentation works as it stands: written or run in an empty folder, page by page.

The page with which users begin starts `mjnav` as they do; on the others its processes are forked, which is quicker.
"""

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
