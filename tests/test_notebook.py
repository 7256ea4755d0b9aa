"""A log in a notebook is its page, in a frame that plays."""

import os
import shutil

import pytest

import mjnav

CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "a.mcap"
    mjnav.run(mjnav.load_scenario("crossing1", {"physics.engine": "kinematic", "time_limit": 2.0}), log=path)
    return mjnav.open_log(path)


@pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium")
def test_the_frame_shows_the_run_and_says_nothing(log, tmp_path):
    playwright = pytest.importorskip("playwright.sync_api")
    said = []
    (tmp_path / "output.html").write_text(f"<!doctype html><div>{log._repr_html_()}</div>", encoding="utf-8")
    with playwright.sync_playwright() as started:
        chromium = started.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        view = chromium.new_page()
        view.on("console", lambda message: said.append(message.text))
        view.on("pageerror", lambda error: said.append(str(error)))
        view.goto((tmp_path / "output.html").as_uri())
        frame = view.frame_locator("iframe")
        frame.locator("html[data-ready]").wait_for(state="attached")
        assert "crossing1" in (frame.locator("h1").text_content() or "")
        assert frame.locator("canvas").first.bounding_box()["width"] > 100
        chromium.close()
    assert said == []


def test_what_is_no_run_or_too_long_is_a_line(log, monkeypatch):
    from dataclasses import replace

    from mjnav.report.run_page import page

    assert replace(log, run=None)._repr_html_().startswith("<code>Log(")
    monkeypatch.setattr(page, "MAX_FRAME", 1000)
    assert "mjnav.report(log, 'page.html')" in log._repr_html_()
