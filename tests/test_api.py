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
from mjnav.scenarios.spec import Scenario

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
    import_module("mjnav.report.film")
    assert mjnav.report([path, path], tmp_path / "two.html").read_text(encoding="utf-8").startswith("<!")
    with pytest.raises(InvalidValue, match=r"^output: found '.*'; allowed: a file name that ends in .html"):
        mjnav.report(path, tmp_path / "a.pdf")
    with pytest.raises(InvalidValue, match=r"^logs: found 0; allowed: 1 to 4"):
        mjnav.report([], tmp_path / "a.html")


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"at": 99.0}, "at: found 99.0; allowed: a time from 0 to 1 s"),
        ({"size": (10, 10)}, r"size: found \(10, 10\); allowed: \(width, height\)"),
        ({"output": "a.gif"}, "output: found 'a.gif'; allowed: a file name that ends in .png or .mp4"),
    ],
)
def test_what_cannot_be_drawn_is_refused_in_the_words_of_the_call(path, arguments, told):
    with pytest.raises(InputError, match=f"^{told}"):
        mjnav.render(path, **arguments)


def test_names_come_by_kind_with_a_sentence():
    assert set(mjnav.names("engines")) == {"mujoco", "kinematic"}
    assert "hall" in mjnav.names("scenes")
    with pytest.raises(InvalidValue, match="did you mean 'engines'"):
        mjnav.names("engine")
