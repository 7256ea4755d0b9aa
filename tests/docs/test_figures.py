"""The page of definitions is written from the table of figures; its rows are whole, and each figure has one."""

import re
from pathlib import Path

import pytest

from mjnav.metrics.definitions import DERIVED, FIGURES

ROOT = Path(__file__).parents[2]


def test_every_figure_has_a_row_of_the_page(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(ROOT / "docs" / "_ext")
    from reference.figures import markdown  # type: ignore[import-not-found]

    rows = [line for line in markdown().splitlines() if line.startswith("| `")]
    assert [re.findall(r"`(\w+)`", row)[0] for row in rows] == [*FIGURES, *DERIVED]
    assert {len(re.findall(r"(?<!\\)\|", row)) for row in rows} == {5}
    assert "```{generated} figures" in (ROOT / "docs" / "method" / "figures.md").read_text(encoding="utf-8")
