"""The Python interface that `import mjnav` offers."""

from importlib import import_module
from pathlib import Path
from typing import assert_type

import pytest
from PIL.Image import Image

import mjnav
from mjnav.errors import InvalidValue
from mjnav.loop.replay import Replay
from mjnav.loop.result import Result
from mjnav.notebook import Log
from mjnav.scene.spec import Scenario

SCENE = ("crossing1", {"physics.engine": "kinematic", "time_limit": 1.0})


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "a.mcap"
    mjnav.run(mjnav.load_scenario(*SCENE), log=path)
    return path


def test_it_offers_what_it_lists():
    assert set(mjnav.__all__) <= set(dir(mjnav))
    runs, results = (
        {"Simulation", "load_scenario", "replay", "run", "sweep"},
        {"compare", "open_log", "render", "report"},
    )
    assert runs | results | {"names"} <= set(mjnav.__all__)
    assert all(callable(getattr(mjnav, name)) for name in mjnav.__all__)


def test_every_call_is_typed(path: Path, tmp_path: Path, capsys):
    """What pyright sees is what comes."""
    scenario = assert_type(mjnav.load_scenario(*SCENE), Scenario)
    log = assert_type(mjnav.open_log(path), Log)
    written = mjnav.report(log, tmp_path / "a.html")
    assert_type(written, Path)
    picture = assert_type(mjnav.render(log, at=0.5, size=(320, 160)), Image)
    saved = assert_type(mjnav.render(path, tmp_path / "a.png", at=0.5, size=(320, 160)), Path)
    result, replayed = assert_type(mjnav.run(scenario), Result), assert_type(mjnav.replay(path), Replay)
    assert isinstance(scenario, Scenario)
    assert isinstance(result, Result)
    assert isinstance(replayed, Replay)
    assert (picture.size, written.stat().st_size > 50_000, saved.stat().st_size > 1_000) == ((320, 160), True, True)
    assert capsys.readouterr() == ("", "")


def test_the_folder_of_reports_is_also_the_call(path, tmp_path):
    """Importing mjnav.report makes the name a module."""
    import_module("mjnav.report.log_pictures")
    assert mjnav.report([path, path], tmp_path / "two.html").read_text(encoding="utf-8").startswith("<!")
    with pytest.raises(InvalidValue, match=r"^output: found '.*'; allowed: a file name that ends in .html"):
        mjnav.report(path, tmp_path / "a.pdf")
    with pytest.raises(InvalidValue, match=r"^logs: found 0; allowed: 1 to 4"):
        mjnav.report([], tmp_path / "a.html")


@pytest.mark.parametrize("wrong", ["a\0b.mcap", "\ud800.mcap", 3, None, b"a.mcap", ["a.mcap"]])
@pytest.mark.parametrize(
    "call",
    [
        lambda wrong: mjnav.run("crossing1", log=wrong or 0),
        lambda wrong: mjnav.Simulation("crossing1", log=wrong or 0),
        mjnav.open_log,
        mjnav.replay,
        mjnav.load_scenario,
        mjnav.compare,
        mjnav.sweep,
        lambda wrong: mjnav.sweep("social", folder=wrong or 0),
        lambda wrong: mjnav.report(wrong if wrong != ["a.mcap"] else [3], "a.html"),
        lambda wrong: mjnav.report("a.mcap", wrong),
    ],
)
def test_what_is_no_path_is_refused_with_what_came_and_what_is_allowed(call, wrong):
    with pytest.raises(InvalidValue, match=r": found .*; allowed: "):
        call(wrong)
