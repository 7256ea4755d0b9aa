"""The headline tables of `docs/results.md` are rows of their studies' tables."""

import re

from tests.docs.test_pages import ROOT

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
    compared = 0
    for section in sections:
        (study,) = re.findall(r"\[The study\]\((.+?)\)", section)
        rows = rows_of((RESULTS.parent / study).read_text(encoding="utf-8"))
        for headline in rows_of(section):
            assert any(has_in_order(row, headline) for row in rows), headline
            compared += 1
    assert compared > 20
