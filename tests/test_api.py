"""The Python interface that `import mjnav` offers."""

import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import assert_type

import pytest
from PIL.Image import Image

import mjnav
from mjnav.errors import InputError, InvalidValue
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


def test_a_name_that_it_does_not_have_is_an_attribute_error():
    with pytest.raises(AttributeError, match="module 'mjnav' has no attribute 'runn'"):
        _ = mjnav.runn


def test_importing_it_loads_nothing_heavy_and_prints_nothing():
    code = "import sys, mjnav; print(sorted({'numpy', 'numba', 'mujoco', 'mcap', 'matplotlib'} & sys.modules.keys()))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("[]\n", "")


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


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"at": 99.0}, "at: found 99.0; allowed: a time from 0 to 1 s"),
        ({"at": "end"}, r"at: found 'end'; allowed: a finite number \[s\]"),
        ({"size": 640}, r"size: found 640; allowed: \(width, height\)"),
        ({"output": "a.mp4", "fps": 2.5}, "fps: found 2.5; allowed: a whole number"),
        ({"output": "a.mp4", "start": "a"}, "start: found 'a'; allowed: a finite number"),
        ({"size": (10, 10)}, r"size: found \(10, 10\); allowed: \(width, height\)"),
        ({"output": "a.gif"}, "output: found 'a.gif'; allowed: a file name that ends in .png or .mp4"),
    ],
)
def test_what_cannot_be_drawn_is_refused_in_the_words_of_the_call(path, arguments, told, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=f"^{told}"):
        mjnav.render(path, **arguments)


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
        lambda wrong: mjnav.sweep("methods", folder=wrong or 0),
        lambda wrong: mjnav.report(wrong if wrong != ["a.mcap"] else [3], "a.html"),
        lambda wrong: mjnav.report("a.mcap", wrong),
    ],
)
def test_what_is_no_path_is_refused_with_what_came_and_what_is_allowed(call, wrong):
    with pytest.raises(InvalidValue, match=r": found .*; allowed: "):
        call(wrong)


def test_a_name_too_long_for_a_file_is_refused(tmp_path):
    for call in (lambda name: mjnav.run("crossing1", log=name), mjnav.open_log, mjnav.compare):
        with pytest.raises(InputError):
            call(str(tmp_path / ("x" * 300)))


def test_names_come_by_kind_with_a_sentence():
    assert set(mjnav.names("engines")) == {"mujoco", "kinematic"}
    assert "hall" in mjnav.names("scenes")
    with pytest.raises(InvalidValue, match="did you mean 'engines'"):
        mjnav.names("engine")
