"""Pages that are written from the code, the headline tables, CITATION.cff and the workflow agree with their sources."""

import ast
import re
import tomllib
from pathlib import Path

import pytest
import yaml

from mjnav.control import names
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


RESULTS = ROOT / "docs" / "results.md"


def rows_of(text: str) -> list[list[str]]:
    """The cells of every row of the tables, heads and rules left out."""
    lines = [line for line in text.splitlines() if line.startswith("|")]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    return [row for row in rows if re.search(r"\d", "".join(row[1:]))]


def has_in_order(row: list[str], cells: list[str]) -> bool:
    left = iter(row)
    return all(cell in left for cell in cells)


def test_every_headline_row_is_a_row_of_its_study():
    sections = RESULTS.read_text(encoding="utf-8").partition("\n## All studies")[0].split("\n## ")[1:]
    headlined = set()
    for section in sections:
        (study,) = re.findall(r"\[The study\]\((.+?)\)", section)
        rows = rows_of((RESULTS.parent / study).read_text(encoding="utf-8"))
        for headline in rows_of(section):
            assert any(has_in_order(row, headline) for row in rows), headline
            headlined.add(headline[0].strip("`"))
    assert set(names()) <= headlined


PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def test_the_citation_is_of_this_version():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert (citation["title"], citation["license"]) == (PROJECT["name"], PROJECT["license"])
    assert citation["version"] == PROJECT["version"]
    assert all(author["family-names"] for author in citation["references"][0]["authors"])


def test_the_workflow_runs_every_supported_python():
    job = yaml.safe_load((ROOT / ".github/workflows/ci.yml").read_text())["jobs"]["everything"]
    prefix = "Programming Language :: Python :: "
    supported = [name.removeprefix(prefix) for name in PROJECT["classifiers"] if name.startswith(prefix)]
    assert job["strategy"]["matrix"]["python"] == supported
    assert {"run": ".ci/run"} in job["steps"]
