"""`mjnav report`'s page in a browser: it plays back, it listens to the keyboard, and it stays by itself."""

from pathlib import Path

import numpy as np
import pytest

import mjnav
from mjnav.cli.main import main
from mjnav.loop.prepare import load_scenario
from mjnav.report.inspection import inspect
from tests.log.conftest import MadeUpRun, make_scenario

pytestmark = pytest.mark.nightly

HOSTILE = '"></script><script>window.hacked=1</script><img src=x onerror="window.hacked=2">'
PHONE = {"width": 375, "height": 740}


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """The folder with logs and their pages: hall, mppi, both, hostile."""
    folder = tmp_path_factory.mktemp("pages")
    for name, controller, limit in (("hall", "rkhs", 4), ("mppi", "mppi", 3)):
        overrides = (f"time_limit={limit}", "physics.engine=kinematic")
        mjnav.run(load_scenario("hall", overrides, controller=controller, seed=3), log=folder / f"{name}.mcap")
    scenario, made_up = make_scenario(1), MadeUpRun(num_people=1, num_candidates=20)
    info = {"scene": HOSTILE, "controller": HOSTILE, "seed": "3"}
    with mjnav.log.Recorder(folder / "hostile.mcap", scenario, info, "<mujoco/>") as recorder:
        for tick in range(2):
            recorder.write(made_up.record(tick))
        recorder.finish(made_up.truth(2), {"outcome": HOSTILE})
    for names in (("hall",), ("hostile",), ("hall", "mppi")):
        logs = [str(folder / f"{name}.mcap") for name in names]
        assert main(["report", *logs, "-o", str(folder / f"{'-'.join(names)}.html")]) == 0
    return folder


@pytest.fixture
def opened(open_page, pages):
    return lambda name, at="#t=0", **options: open_page(pages / f"{name}.html", at, **options)


def clock(view):
    return view.inner_text("#clock").replace("\u202f", " ")


def pixels(view, i=0):
    """A number that differs where what a map shows does."""
    return view.evaluate(
        """i => {
            const canvas = document.querySelectorAll('canvas')[i], {width, height} = canvas;
            const copy = new OffscreenCanvas(width, height).getContext('2d', {willReadFrequently: true});
            copy.drawImage(canvas, 0, 0);
            const {data} = copy.getImageData(0, 0, width, height);
            return new Uint32Array(data.buffer).reduce((sum, pixel) => (Math.imul(sum, 31) + pixel) | 0, 0);
        }""",
        i,
    )


def until(view, script):
    """Waits until a script gives true; the page's policy forbids playwright's own way."""
    for _ in range(500):
        if view.evaluate(script):
            return
        view.wait_for_timeout(10)
    pytest.fail(f"never: {script}")


def test_it_opens_without_a_word_at_the_worst_moment_and_asks_for_nothing(opened, pages):
    view = opened("hall", at="")
    worst = inspect(pages / "hall.mcap").moments[0]
    assert clock(view) == f"{worst.time_s:.2f} s"
    assert view.inner_text("#seen") == f"Worst moment 1: {worst.text}"
    assert view.get_attribute("[data-moment='1']", "aria-current") == "true"
    assert view.inner_text("h1") == "hall"
    assert view.evaluate("performance.getEntriesByType('resource').length") == 0


def test_a_definition_shows_by_pointer_keyboard_and_touch(opened):
    view = opened("hall")
    term, box = view.locator(".card .term", has_text="Control cost"), view.locator("#definition")
    assert box.is_hidden()
    term.hover()
    assert "track_width" in box.inner_text()
    view.mouse.move(1, 1)
    assert box.is_hidden()
    term.focus()
    assert "track_width" in box.inner_text()
    assert "track_width" in term.get_attribute("aria-description")
    view.keyboard.press("Escape")
    assert box.is_hidden()
    phone = opened("hall", viewport=PHONE, has_touch=True)
    phone.locator(".card .term", has_text="Mean deviation").tap()
    assert "lateral distance" in phone.inner_text("#definition")
    assert phone.evaluate("document.documentElement.scrollWidth") == PHONE["width"]


def test_what_is_drawn_is_what_happened(opened, pages):
    """Every array that the page makes of its text, against the log's own."""
    view = opened("hall")
    trajectory = mjnav.open_log(pages / "hall.mcap").trajectory()
    found = view.evaluate("""async () => {
        const run = await Run.load(JSON.parse(document.getElementById('runs').textContent)[0], 0);
        return Object.fromEntries(Object.entries(run.tables).map(([name, table]) => [name,
            Array.from(table.values, (value) => Number.isNaN(value) ? null : value)]));
    }""")

    def array(name, *shape):
        return np.array(found[name], float).reshape(-1, *shape)

    np.testing.assert_array_equal(array("time"), trajectory.time)
    for name, values in {
        "pose": trajectory.robot_pose,
        "twist": trajectory.robot_twist,
        "people": trajectory.people_position.reshape(len(trajectory.time), -1),
    }.items():
        np.testing.assert_allclose(array(name, values.shape[1]), values, atol=6e-4)
    np.testing.assert_allclose(array("estimate", 3)[:-1], trajectory.estimate, atol=6e-4)
    np.testing.assert_allclose(array("command", 2)[:-1], trajectory.command, atol=6e-4)
    np.testing.assert_allclose(array("nominal", 2)[:-1], trajectory.nominal, atol=6e-4)
    assert np.isnan(array("command", 2)[-1]).all()
    tracks = array("tracks", 5, 5)[:-1]
    np.testing.assert_allclose(tracks[:, :, :2], trajectory.tracks[:, :, :2], atol=6e-4)
    longest = np.sqrt(5.991 * np.linalg.eigvalsh(trajectory.track_covariance[:, :, :2, :2])[..., -1])
    np.testing.assert_allclose(tracks[:, :, 2], longest, atol=6e-4)
    particles = array("track_particles", 5, 16, 2)[:-1]
    assert np.abs(np.nanmean(particles, axis=(0, 2))).max() < 0.02  # about the tracks' means
    least = inspect(pages / "hall.mcap").document()["figures"]["min_clearance_m"]
    assert array("clearance").min() == pytest.approx(least, abs=6e-4)


def test_keys_move_time(opened):
    view = opened("hall")
    pictures = {pixels(view)}
    for key, expected in (
        ("ArrowRight", "0.10 s"),
        ("Shift+ArrowRight", "1.10 s"),
        ("ArrowLeft", "1.00 s"),
        ("End", "4.00 s"),
        ("Shift+ArrowLeft", "3.00 s"),
        ("Home", "0.00 s"),
        ("ArrowLeft", "0.00 s"),
    ):
        view.keyboard.press(key)
        assert clock(view) == expected, key
        pictures.add(pixels(view))
    assert len(pictures) == 6


def test_space_plays_and_pauses(opened):
    view = opened("hall")
    view.keyboard.press("Space")
    assert view.get_attribute("#play", "aria-label") == "Pause"
    until(view, "Number(document.getElementById('time').value) > 5")
    view.keyboard.press("Space")
    assert view.get_attribute("#play", "aria-label") == "Play"
    view.select_option("#speed", "8")
    view.evaluate("document.activeElement.blur()")
    view.keyboard.press("Space")
    view.wait_for_selector("#play[aria-label=Play]")
    assert clock(view) == "4.00 s"


def test_layers_can_be_hidden(opened):
    view = opened("hall")
    view.keyboard.press("3")
    view.keyboard.press("End")
    view.keyboard.press("Shift+ArrowLeft")
    seen = {pixels(view)}
    for layer in ("candidates", "particles", "estimates", "ways", "follow"):
        view.locator(f"[data-layer={layer}]").click()
        seen.add(pixels(view))
    assert len(seen) == 6
    assert not view.is_visible("[data-layer=predictions]")  # the run has none
    view.keyboard.press("Home")  # a box that has the focus leaves time its keys
    assert clock(view) == "0.00 s"


def test_two_runs_share_one_slider(opened):
    view = opened("hall-mppi")
    assert view.locator("canvas").count() == 2
    before = [pixels(view, i) for i in range(2)]
    view.fill("#time", "20")
    middle = [pixels(view, i) for i in range(2)]
    assert all(a != b for a, b in zip(before, middle, strict=True))
    view.keyboard.press("End")  # the second one ended a second before
    assert clock(view) == "4.00 s"
    assert view.locator(".run").nth(1).locator("[data-now=status]").inner_text() == "the run ended"
    lines = view.evaluate(
        "[...document.querySelectorAll('.plot')].map((plot) => plot.querySelectorAll('path.line').length)"
    )
    assert lines == [2] * 7
    assert view.locator(".comparison .difference").count() > 10


def test_a_hostile_name_is_shown_and_does_nothing(opened):
    view = opened("hostile")
    assert view.inner_text("h1") == HOSTILE
    assert HOSTILE in view.title()
    assert HOSTILE in view.inner_text("[data-outcome]")
    assert view.evaluate("window.hacked") is None
    assert view.locator("img").count() == 0


def test_a_script_that_is_not_the_page_s_own_does_not_run(browser, pages, tmp_path):
    text = (pages / "hall.html").read_text().replace("</body>", "<script>window.hacked=1</script></body>")
    (tmp_path / "changed.html").write_text(text)
    view = browser.new_page()
    view.goto(Path(tmp_path / "changed.html").as_uri())
    view.wait_for_selector("html[data-ready]")
    assert view.evaluate("window.hacked") is None
    view.close()
