"""The look that all kinds of pages share, in a browser: colours that can be read, nothing wider than a phone."""

import pytest
from matplotlib.figure import Figure

from mjnav.log import Recorder, open_log
from mjnav.paper.claims import Finding, Verdict
from mjnav.paper.episodes import Basis
from mjnav.paper.page import page, publish
from mjnav.report.comparison.html import html
from mjnav.report.inspection import inspect
from mjnav.report.run_page.page import page as run_page
from mjnav.report.run_page.playback import playback
from mjnav.study.compare.study_comparison import compare_study
from mjnav.study.store import Store
from mjnav.study.study_file import load_study
from tests.log.conftest import MadeUpRun, make_scenario
from tests.study.made_up import row

pytestmark = pytest.mark.nightly

pytest.importorskip("pyarrow", reason="the sweep extra is not installed")

METHODS = ("a method with a name that no phone has the room for in one line", "saa", "mean")
LEAST_CONTRAST = 4.5  # of text to what is behind it: WCAG 2.2, level AA
CONTRAST = """() => {
    const canvas = new OffscreenCanvas(1, 1).getContext('2d', {willReadFrequently: true});
    const rgba = (text) => {
        canvas.clearRect(0, 0, 1, 1);
        canvas.fillStyle = text;
        canvas.fillRect(0, 0, 1, 1);
        return [...canvas.getImageData(0, 0, 1, 1).data];
    };
    const over = (top, below) => top.map((part, i) => i < 3 ? (part * top[3] + below[i] * (255 - top[3])) / 255 : 255);
    const behind = (element) => {
        const own = rgba(getComputedStyle(element).backgroundColor);
        if (own[3] === 255) return own;
        return over(own, element.parentElement ? behind(element.parentElement) : [255, 255, 255, 255]);
    };
    const light = (colour) => colour.slice(0, 3).map((part) => part / 255)
        .map((part) => part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4)
        .reduce((sum, part, i) => sum + [0.2126, 0.7152, 0.0722][i] * part, 0);
    const found = [];
    for (const element of document.body.querySelectorAll('*')) {
        const own = [...element.childNodes].filter((node) => node.nodeType === 3);
        const text = own.map((node) => node.data).join('').trim();
        if (!text || element.closest('script, option') || !element.checkVisibility()) continue;
        const style = getComputedStyle(element), back = behind(element);
        const colour = over(rgba(element.namespaceURI.endsWith('svg') ? style.fill : style.color), back);
        const [a, b] = [light(colour), light(back)].sort((x, y) => y - x);
        found.push([(a + 0.05) / (b + 0.05), text.slice(0, 40), element.className.baseVal ?? element.className]);
    }
    return found;
}"""


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """One page of each kind, as it is by its file's name."""
    folder = tmp_path_factory.mktemp("pages")
    made_up = MadeUpRun(num_people=1, num_candidates=20)
    with Recorder(folder / "run.mcap", make_scenario(1), {"scene": "s", "seed": "3"}, "<mujoco/>") as recorder:
        for tick in range(3):
            recorder.write(made_up.record(tick))
        recorder.finish(made_up.truth(3), {"outcome": "collision"})
    log = open_log(folder / "run.mcap")
    (folder / "run.html").write_text(run_page([(inspect(log), playback(log))]))

    store = Store(folder / "rows")
    rows = [
        row(method, seed, cost, hit=(seed + i) % 5 == 0, scene="crossing1", setting="pearson", study="crossings",
            control='{"weight": 2.0, "eta": 0.95}')
        for i, method in enumerate(METHODS)
        for seed in range(20)
        for cost in [3.0 - i + 0.1 * (seed % 7)]
    ]  # fmt: skip
    with store.writing("# mjnav sweep crossings\n"):
        store.append(rows)
    study = load_study("crossings")
    results = compare_study(store, study, figures=("control_cost", "min_clearance_m", "max_deviation_m"))
    (folder / "compare.html").write_text(html(results, study, page=folder / "compare.html"))

    figure = Figure()
    figure.subplots().plot([1, 2])
    findings = [
        Finding(f"It is {verdict.value}", "figure 1", verdict, "1 of 2 settings for it\nhere: 1") for verdict in Verdict
    ]
    publish(folder / "lane", figure, [{"a": 1}], findings, Basis("mjnav paper --only lane", {"study": "a = 1"}))
    publish(folder / "table", figure, [{"a": 1}], findings[:1], Basis("mjnav paper --only table"))
    (folder / "paper.html").write_text(page(folder, "mjnav paper"))
    return folder


@pytest.fixture
def opened(open_page, pages):
    """Opens a page, with all of its details."""

    def opened(name, width=1400, scheme="light"):
        window = {"viewport": {"width": width, "height": 800}, "color_scheme": scheme}
        view = open_page(pages / f"{name}.html", ready=name == "run", **window)
        view.evaluate("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
        return view

    return opened


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("name", ["run", "compare", "paper"])
def test_every_text_can_be_read(opened, name, scheme):
    found = opened(name, scheme=scheme).evaluate(CONTRAST)
    assert len(found) > 20
    assert [one for one in found if one[0] < LEAST_CONTRAST] == []


@pytest.mark.parametrize("name", ["run", "compare", "paper"])
def test_a_phone_scrolls_one_way_only(opened, name):
    view = opened(name, 375)
    assert view.evaluate("document.documentElement.scrollWidth") == 375


def column(view, number):
    return view.evaluate(
        f"[...document.querySelectorAll('.sorted tbody')[0].rows].map((r) => r.cells[{number}].innerText)"
    )


def test_a_heading_sorts_the_table_by_pointer_and_by_keyboard(opened):
    view = opened("compare")
    cost, heading = "control cost [m²/s³]", view.locator("table.sorted").first.locator("th[scope=col]")
    place = [text.split("\xa0")[0].strip() for text in heading.all_inner_texts()].index(cost)
    before = column(view, 0)
    assert before == list(METHODS)
    heading.nth(place).locator("button").click()
    assert heading.nth(place).get_attribute("aria-sort") == "ascending"
    assert column(view, 0) == before[::-1]
    heading.first.locator("button").press("Space")
    assert heading.nth(place).get_attribute("aria-sort") is None
    assert column(view, 0) == sorted(before)
