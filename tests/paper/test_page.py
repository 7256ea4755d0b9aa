"""What an item leaves behind, and the page that is made of it."""

import csv

import pytest
from matplotlib.figure import Figure

from mjnav.errors import InputError
from mjnav.paper import ITEMS, load
from mjnav.paper.claims import Finding, Verdict
from mjnav.paper.episodes import Basis
from mjnav.paper.page import DATA, FINDINGS, PICTURE, PRINT, page, publish, read
from tests.report.parsed_page import ParsedPage

HOSTILE = '</td><script>alert("1")</script>'
FINDING = Finding("It is <so>", "figure 1", Verdict.HOLDS, "first: 1 < 2\nsecond: 2 > 1")
ROWS = [{"method": HOSTILE, "mean": 0.1 + 0.2}, {"method": "b, c", "mean": None}, {"method": "=1+1", "mean": -1.0}]


@pytest.fixture
def folder(tmp_path):
    figure = Figure()
    figure.subplots().plot([1, 2])
    publish(tmp_path / "pareto", figure, ROWS, [FINDING], Basis(HOSTILE, {"study": "a = 1 < 2"}))
    return tmp_path


def test_an_item_leaves_its_figure_its_data_and_its_findings(folder):
    item = folder / "pareto"
    assert {path.name for path in item.iterdir()} == {FINDINGS, DATA, PICTURE, PRINT}
    assert (item / PICTURE).read_bytes()[:4] == b"\x89PNG"
    assert (item / PRINT).read_bytes()[:5] == b"%PDF-"
    with open(item / DATA, newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["method"] for row in rows] == [HOSTILE, "b, c", "'=1+1"]
    assert [row["mean"] for row in rows] == [str(0.1 + 0.2), "", "-1.0"]
    kept = read(item)
    assert kept is not None
    findings, basis = kept
    assert (findings, basis.command) == ([FINDING], HOSTILE)


def test_a_damaged_folder_is_refused(tmp_path):
    assert read(tmp_path) is None
    for damaged in ("{", "[]", "{}", '{"findings": [{}]}', '{"findings": [], "unknown": 1}'):
        (tmp_path / FINDINGS).write_text(damaged)
        with pytest.raises(InputError, match=r"findings\.json: no findings of an item"):
            read(tmp_path)


def test_the_page_shows_every_claim_escapes_what_it_is_told_and_its_links_lead_somewhere(folder):
    made = page(folder, HOSTILE)
    parsed = ParsedPage(made)
    text_of_all = "".join(part.text for tag in ("title", "body") for part in parsed.all(tag))
    assert not any("alert" in code for code in parsed.code)
    assert text_of_all.count(HOSTILE) == 2
    assert text_of_all.count("✓ holds It is <so>") == 1
    for text in ("first: 1 < 2", "a = 1 < 2", load("pareto").limits):
        assert text_of_all.count(text) == 1
    assert f"Not run: {', '.join(name for name in ITEMS if name != 'pareto')}." in text_of_all
    links = [e.attributes[key] for e in parsed.elements for key in ("href", "src") if key in e.attributes]
    for link in links:
        if link.startswith("#"):
            assert f'id="{link[1:]}"' in made
        elif not link.startswith(("https://arxiv.org/", "data:")):
            assert (folder / link).is_file()
