"""What pictures and films show of a method that plans ahead, and its page in a browser."""

import numpy as np

from mjnav.cli.main import main
from mjnav.log import open_log
from mjnav.report.lidar_view import LoggedViews
from tests.report.planning import written
from tests.report.test_page_in_browser import DESK, pixels


def test_a_moment_has_the_latest_plan_for_a_period(tmp_path):
    plans = written(tmp_path / "a.mcap")
    views = LoggedViews(open_log(tmp_path / "a.mcap"))
    for time, tick in ((0.0, 0), (0.05, 0), (0.1, 0), (0.2, 2), (0.35, 3), (0.4, 3)):
        shown = views.at(time)
        np.testing.assert_array_equal(shown["plan"], plans[tick].path.astype("f4"))
        np.testing.assert_array_equal(shown["fan"], plans[tick].fan.astype("f4"))
        assert shown["feasible"] == (tick != 3)
    assert views.at(0.15) == {}  # the second tick had none


def test_a_browser_shows_the_plan_its_fan_and_the_violation(browser, tmp_path):
    written(tmp_path / "a.mcap")
    assert main(["report", str(tmp_path / "a.mcap")]) == 0
    view, said = browser.new_page(viewport=DESK), []
    view.on("console", lambda message: said.append(message.text))
    view.on("pageerror", lambda error: said.append(str(error)))
    view.goto((tmp_path / "a.html").as_uri() + "#t=0.2")
    view.wait_for_selector("html[data-ready]")
    seen = {pixels(view)}
    for layer in ("fan", "plan"):
        view.locator(f"[data-layer={layer}]").click()
        seen.add(pixels(view))
    assert len(seen) == 3
    shares = [view.inner_text(f".violation .{name}") for name in ("share-text", "touching")]
    assert [text.replace("\u202f", " ") for text in shares] == ["50 %", "25 %"]
    assert view.get_attribute(".violation .current.colliding", "d").count("Z") == 2
    assert not view.is_visible(".cone")
    view.close()
    assert said == []
