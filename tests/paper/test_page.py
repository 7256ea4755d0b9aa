"""What an item leaves behind, and the page that is made of it."""

import csv
from html.parser import HTMLParser

import pytest
from matplotlib.figure import Figure

from mjnav.errors import InputError
from mjnav.paper import ITEMS, load
from mjnav.paper.claims import Finding, Verdict
from mjnav.paper.episodes import Basis
from mjnav.paper.page import DATA, FINDINGS, PICTURE, PRINT, page, publish, read

HOSTILE = '</td><script>alert("1")</script>'
FINDING = Finding("It is <so>", "figure 1", Verdict.HOLDS, "first: 1 < 2\nsecond: 2 > 1")
ROWS = [{"method": HOSTILE, "mean": 0.1 + 0.2}, {"method": "b, c", "mean": None}, {"method": "=1+1", "mean": -1.0}]


@pytest.fixture
def folder(tmp_path):
    figure = Figure()
    figure.subplots().plot([1, 2])
    publish(tmp_path / "lane", figure, ROWS, [FINDING], Basis(HOSTILE, {"study": "a = 1 < 2"}))
    return tmp_path


def test_an_item_leaves_its_figure_its_data_and_its_findings(folder):
    lane = folder / "lane"
    assert {path.name for path in lane.iterdir()} == {FINDINGS, DATA, PICTURE, PRINT}
    assert (lane / PICTURE).read_bytes()[:4] == b"\x89PNG"
    assert (lane / PRINT).read_bytes()[:5] == b"%PDF-"
    with open(lane / DATA, newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["method"] for row in rows] == [HOSTILE, "b, c", "'=1+1"]
    assert [row["mean"] for row in rows] == [str(0.1 + 0.2), "", "-1.0"]
    found = read(lane)
    assert (found.findings, found.basis.command) == ((FINDING,), HOSTILE)


def test_a_damaged_folder_is_refused(tmp_path):
    assert read(tmp_path) is None
    for damaged in ("{", "[]", "{}", '{"findings": [{}]}', '{"findings": [], "unknown": 1}'):
        (tmp_path / FINDINGS).write_text(damaged)
        with pytest.raises(InputError, match=r"findings\.json: no findings of an item"):
            read(tmp_path)


class _Tags(HTMLParser):
    def __init__(self):
        super().__init__()
        self.names: list[str] = []
        self.links: list[str] = []
        self.text = self.code = ""

    def handle_starttag(self, tag, attrs):
        self.names.append(tag)
        self.links += [value for key, value in attrs if key in ("href", "src")]

    def handle_data(self, data):
        if self.names[-1:] == ["script"]:
            self.code += data
        else:
            self.text += data


def test_the_page_shows_every_claim_and_escapes_what_it_is_told(folder):
    tags = _Tags()
    tags.feed(page(folder, HOSTILE))
    assert "alert" not in tags.code
    assert tags.text.count(HOSTILE) == 2
    assert tags.text.count("It is <so>") == 1
    assert "✓ holds It is <so>" in tags.text
    assert "first: 1 < 2" in tags.text
    assert "a = 1 < 2" in tags.text
    missing = ", ".join(name for name in ITEMS if name != "lane")
    assert f"Not run: {missing}." in tags.text


def test_every_link_of_the_page_leads_somewhere(folder):
    tags = _Tags()
    tags.feed(page(folder, ""))
    for link in tags.links:
        if link.startswith("#"):
            assert f'id="{link[1:]}"' in page(folder, "")
        elif not link.startswith(("https://arxiv.org/", "data:")):
            assert (folder / link).is_file()


def test_what_too_few_runs_cannot_decide_is_said_once(tmp_path):
    line = "here: 0.1 m [0, 0.2] (n = 1); too few to judge by"
    few = [
        Finding(f"claim {i}", "figure 1", Verdict.OPEN, f"settings: 0 for it, 0 against, 1 open\n{line}")
        for i in range(5)
    ]
    for findings, said in (
        (few, "None of the claims can be judged"),
        ([*few, FINDING], "5 of 6 claims cannot be judged"),
    ):
        publish(tmp_path / "lane", Figure(), ROWS, findings, Basis("mjnav paper --quick --only lane"))
        tags = _Tags()
        tags.feed(page(tmp_path, ""))
        assert tags.text.count(said) == 1
        assert "too few to judge by" not in tags.text
        assert tags.text.count("not decided") == 0
        assert tags.text.count("here: 0.1 m [0, 0.2] (n = 1)") == 5


def test_what_a_comparison_cannot_say_stands_with_its_figure(tmp_path):
    publish(tmp_path / "pareto", Figure(), ROWS, [FINDING], Basis("mjnav paper --only pareto"))
    assert load("pareto").limits
    tags = _Tags()
    tags.feed(page(tmp_path, ""))
    assert tags.text.count(load("pareto").limits) == 1
