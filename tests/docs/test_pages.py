"""Every code block of the documentation works as it stands: written or run in an empty folder, page by page."""

from pathlib import Path

import pytest

from tests.docs.blocks import blocks_of
from tests.docs.notebook import Notebook

pytestmark = pytest.mark.xdist_group("each alone")

ROOT = Path(__file__).parents[2]
PAGES = [page for page in sorted((ROOT / "docs").rglob("*.md")) if "_build" not in page.parts]


@pytest.mark.parametrize("page", [pytest.param(page, id=str(page.relative_to(ROOT))) for page in PAGES])
def test_blocks_work(page, tmp_path):
    folder = tmp_path / "folder"
    folder.mkdir()
    with Notebook(folder) as notebook:
        for block in blocks_of(page):
            notebook.play(block)
