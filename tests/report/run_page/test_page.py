"""`mjnav report`: what stands in the page, without a browser."""

import json
import re
from base64 import b64encode
from hashlib import sha256

import pytest

import mjnav
from mjnav.cli.main import main
from mjnav.log import Recorder, open_log
from mjnav.loop.prepare import load_scenario
from mjnav.messages import Event
from mjnav.report.inspection import inspect
from mjnav.report.run_page.page import page
from mjnav.report.run_page.page_parts import flatten, shown
from mjnav.report.run_page.playback import playback
from tests.log.conftest import MadeUpRun, make_scenario
from tests.report.parsed_page import ParsedPage

KINEMATIC = "physics.engine=kinematic"
HOSTILE = '"></script><script>alert(1)</script><img src=x onerror=alert(2)> & \u2028 Straße 走'


def data_of(page, name):
    """A document within a page."""
    (script,) = page.all("script", id=name)
    return json.loads(script.text)


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    asked = {
        "hall": ("hall", ("time_limit=3",), "rkhs"),
        "orca": ("crossing3", ("time_limit=2",), "orca"),
        "lane": ("lane", ("time_limit=1",), "mppi"),
    }
    for name, (scene, overrides, controller) in asked.items():
        scenario = load_scenario(scene, (*overrides, KINEMATIC), controller=controller, seed=3)
        mjnav.run(scenario, log=folder / f"{name}.mcap")
    return folder


@pytest.fixture
def report(logs, capsys):
    """Calls `mjnav report` and gives (exit code, standard output, standard error)."""

    def call(*words):
        code = main(["report", *map(str, words)])
        return (code, *capsys.readouterr())

    return call


@pytest.fixture
def made(logs, report, tmp_path):
    """The page of some of the logs."""

    def make(*names):
        code, _, err = report(*(logs / f"{name}.mcap" for name in names), "-o", tmp_path / "page.html")
        assert (code, err) == (0, "")
        return ParsedPage((tmp_path / "page.html").read_text())

    return make


def inspected(path, capsys):
    main(["inspect", str(path), "--json"])
    return json.loads(capsys.readouterr().out)


def record(path, scenario, run_info, *, events=(), ticks=3):
    made_up = MadeUpRun(num_people=len(scenario.people), num_candidates=30)
    with Recorder(path, scenario, run_info, "<mujoco/>") as recorder:
        for tick in range(ticks):
            recorder.write(made_up.record(tick, events=events))
            recorder.write_timing(made_up.timing(tick))
        recorder.finish(made_up.truth(ticks), {"outcome": "goal"})


@pytest.mark.parametrize("names", [("hall",), ("hall", "orca", "lane")])
def test_every_figure_is_that_of_inspect(made, logs, capsys, names):
    found = made(*names)
    documents = [flatten(inspected(logs / f"{name}.mcap", capsys)) for name in names]
    figures = [element for element in found.elements if "data-key" in element.attributes]
    assert len(figures) > 100
    for attributes, text in ((figure.attributes, figure.text) for figure in figures):
        value = documents[int(attributes["data-run"])].get(attributes["data-key"])
        assert json.loads(attributes["data-value"]) == value, attributes
        assert text == shown(value), attributes
    keys = {(int(figure.attributes["data-run"]), figure.attributes["data-key"]) for figure in figures}
    for run, document in enumerate(documents):
        for key in ("figures.min_clearance_m", "figures.control_cost", "timing.compute_ms.tick.p99"):
            assert (run, key) in keys
        assert {key for key in document if key.startswith(("figures.", "timing.", "result."))} <= {
            key for of, key in keys if of == run
        }
    assert data_of(found, "inspections") == [inspected(logs / f"{name}.mcap", capsys) for name in names]


def test_the_page_needs_nothing_but_itself(made, tmp_path):
    found = made("hall")
    for element in found.elements:
        assert not {"src", "srcset", "action", "data", "style", "onclick"} & set(element.attributes), element
        assert element.attributes.get("href", "data:,") == "data:,"
    for text in [*found.code, *(style.text for style in found.all("style"))]:
        digest = b64encode(sha256(text.encode()).digest()).decode()
        assert f"'sha256-{digest}'" in found.policy
    assert found.policy.startswith("default-src 'none'; ")
    assert "unsafe" not in found.policy
    text = (tmp_path / "page.html").read_text()
    assert not re.search(r"https?://(?!www\.w3\.org/2000/svg)|@import|url\(", text)


def test_a_page_is_small_and_always_the_same(made, tmp_path):
    first, text = made("hall"), (tmp_path / "page.html").read_text()
    made("hall")
    assert (tmp_path / "page.html").read_text() == text
    code = sum(map(len, first.code)) + sum(len(style.text) for style in first.all("style"))
    packed = len(data_of(first, "runs")[0]["gzip"])
    assert code < 80_000
    assert packed < 31 * 600  # 600 bytes a tick: 360 kB for a minute


def test_hostile_names_are_text(report, tmp_path):
    scenario = make_scenario(2)
    info = {"scene": HOSTILE, "controller": HOSTILE, "seed": "<b>3</b>", HOSTILE: HOSTILE}
    events = (Event("warning", HOSTILE, HOSTILE),)
    record(tmp_path / "x.mcap", scenario, info, events=events)
    assert report(tmp_path / "x.mcap")[0] == 0
    found = ParsedPage((tmp_path / "x.html").read_text())
    assert [text for text in found.code if "alert" in text] == []
    assert found.all("img") == []
    assert len(found.code) == found.policy.count("sha256-") - 1
    assert data_of(found, "inspections")[0]["run"]["scene"] == HOSTILE
    assert data_of(found, "runs")[0]["events"][0]["text"] == HOSTILE


def test_the_page_says_how_the_run_was_made(logs, report, tmp_path):
    overrides = (KINEMATIC, "time_limit=1", "control.weight=7.5", "noise.profile=bimodal")
    mjnav.run(load_scenario("crossing1", overrides, seed=4), log=tmp_path / "set.mcap")
    assert report(tmp_path / "set.mcap", logs / "orca.mcap", "-o", tmp_path / "x.html")[0] == 0
    rows = re.findall(
        r'<tr><th scope="row">([^<]*)</th><td>(<strong>)?([^<]*)(?:</strong>)?</td><td>(?:<strong>)?([^<]*)<',
        (tmp_path / "x.html").read_text().partition('class="parameters"')[2].partition("</table>")[0],
    )
    found = {name: (first, second) for name, _, first, second in rows}
    assert found["controller"] == ("rkhs", "orca")
    assert found["seed"] == ("4", "3")
    assert found["noise"] == ("bimodal", "pearson")
    assert found["control.weight"] == ("7.5", "")
    assert found["version.mjnav"][0] == found["version.mjnav"][1] != ""
    differs = [bool(mark) for _, mark, *_ in rows]
    assert differs == sorted(differs, reverse=True)


def test_a_long_run_is_thinned_and_says_so(logs):
    log = open_log(logs / "hall.mcap")
    data = playback(log, max_frames=11)
    assert (data["stride"], data["ticks"]) == (3, 30)
    assert data["fields"]["time"]["shape"] == [12]  # the last tick, whose beliefs the end shows, is one of them
    assert playback(log, keep=(3, 4, 28), max_frames=11)["fields"]["time"]["shape"] == [14]
    assert "one tick in 3 of 30" in page([(inspect(log), data)])


def test_a_damaged_log_makes_a_page_of_what_is_intact_and_exit_code_3(report, logs, tmp_path):
    content = bytearray((logs / "hall.mcap").read_bytes())
    content[len(content) // 2] ^= 0xFF
    (tmp_path / "bad.mcap").write_bytes(content)
    code, out, err = report(tmp_path / "bad.mcap")
    assert (code, out[:4], err.count("\n")) == (3, str(tmp_path)[:4], 1)
    assert "the page shows what is intact" in err
    found = ParsedPage((tmp_path / "bad.html").read_text())
    assert "The log is damaged" in (tmp_path / "bad.html").read_text()
    assert 10 < data_of(found, "runs")[0]["fields"]["time"]["shape"][0] < 31


def test_what_is_no_page_is_not_replaced_unless_it_is_named(report, logs, tmp_path):
    (tmp_path / "lane.mcap").write_bytes((logs / "lane.mcap").read_bytes())
    (tmp_path / "lane.html").write_text("notes")
    code, _, err = report(tmp_path / "lane.mcap")
    assert (code, (tmp_path / "lane.html").read_text()) == (2, "notes")
    assert "no page of mjnav's" in err
    assert report(tmp_path / "lane.mcap", "-o", tmp_path / "lane.html")[0] == 0
