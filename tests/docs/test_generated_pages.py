"""Pages that are written from the code: each figure has a whole row, and code in docstrings is shown as code."""

import ast
import re
from pathlib import Path

import pytest

from mjnav.metrics.summary import DERIVED, FIGURES

ROOT = Path(__file__).parents[2]


def test_every_figure_has_a_row_of_the_page(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(ROOT / "docs" / "_ext")
    from reference.figures import markdown  # type: ignore[import-not-found]

    rows = [line for line in markdown().splitlines() if line.startswith("| `")]
    assert [re.findall(r"`(\w+)`", row)[0] for row in rows] == [*FIGURES, *DERIVED]
    assert {len(re.findall(r"(?<!\\)\|", row)) for row in rows} == {5}
    assert "```{generated} figures" in (ROOT / "docs" / "method" / "figures.md").read_text(encoding="utf-8")


def test_code_in_the_docstrings_of_the_python_page_is_indented_as_code(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(ROOT / "docs" / "_ext")
    from reference.python import markdown  # type: ignore[import-not-found]

    paragraphs = re.sub(r"\\(\W)", r"\1", markdown()).split("\n\n")
    prose = [text for text in paragraphs if not text.startswith("    ")]
    assert [text for text in prose if _has_statements(text)] == []


def _has_statements(text: str) -> bool:
    """Whether a text is Python that does something, rather than a word or an arrow of shapes."""
    try:
        return any(not isinstance(node, ast.Expr) for node in ast.parse(text).body)
    except SyntaxError:
        return False
