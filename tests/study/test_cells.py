"""The combinations that a study file asks for, each as a scenario that is checked."""

import json
import re

import pytest

from mjnav.errors import InvalidValue
from mjnav.loop.prepare import load_scenario
from mjnav.scene import loads
from mjnav.study.cells import resolve
from mjnav.study.study_file import load_study

STUDY = """
schema = 1
name = "every kind"
scenes = ["crossing1", "mine.toml"]
[set]
time_limit = 1.0
physics.engine = "kinematic"
[grid]
control.rate = [10.0, 20.0]
[[settings]]
name = "plain"
[[settings]]
name = "loud"
set = { noise.profile = "bimodal", time_limit = 2.0 }
[[methods]]
controller = "rkhs"
name = "mine"
set = { degree = 2, estimation.robot.source = "direct" }
grid = { weight = [0.3, 3.0], form = ["line"] }
[[methods]]
controller = "mean"
"""
MINE = 'schema = 1\nname = "mine"\n[robot]\nstart = [0, 0, 0]\ngoal = [3, 0]\n'


@pytest.fixture
def cells(tmp_path):
    """Resolves a study of this text, beside a scene of one's own."""
    (tmp_path / "mine.toml").write_text(MINE)

    def resolved(text: str, *overrides: str, scenes=()):
        (tmp_path / "study.toml").write_text(text)
        return resolve(load_study(tmp_path / "study.toml"), overrides, scenes)

    return resolved


PLUGINS = """
from mjnav.control.methods.mean import Mean
class Own(Mean): ...
class Still:
    def __init__(self, scenario, seed, parameters): ...
    def predict(self, crowd): ...
"""


def test_a_file_of_ones_own_lies_beside_the_study_whatever_key_names_it(cells, tmp_path):
    (tmp_path / "own.py").write_text(PLUGINS)
    found = cells(
        'schema = 1\nname = "own"\nscenes = ["crossing1"]\nmethods = [{ controller = "own.py:Own" }]\n'
        'settings = [{ name = "still", set.prediction.model = "own.py:Still" }]\n'
    )
    scenario = loads(found[0].document)
    assert (
        scenario.prediction.model.name == scenario.control.method.replace("Own", "Still") == f"{tmp_path}/own.py:Still"
    )


def test_every_scene_meets_every_setting_value_and_method(cells):
    found = cells(STUDY)
    methods = ("mine weight=0.3 form=line", "mine weight=3.0 form=line", "mean")
    settings = [f"{name}, rate={rate}" for name in ("plain", "loud") for rate in ("10.0", "20.0")]
    assert [(cell.scene, cell.setting, cell.method) for cell in found] == [
        (scene, setting, method) for scene in ("crossing1", "mine") for setting in settings for method in methods
    ]
    assert [json.loads(cell.parameters) for cell in found[:3]] == [
        {"control.form": "line", "control.rate": 10.0, "control.weight": 0.3},
        {"control.form": "line", "control.rate": 10.0, "control.weight": 3.0},
        {"control.rate": 10.0},
    ]
    assert [cell.controller for cell in found[:3]] == ["rkhs", "rkhs", "mean"]


def test_a_cell_is_the_scenario_that_run_makes_of_the_same_overrides(cells):
    loud = next(cell for cell in cells(STUDY, "time_limit=0.5") if cell.setting == "loud, rate=20.0")
    overrides = ["physics.engine=kinematic", "noise.profile=bimodal", "control.rate=20", "control.degree=2"]
    overrides += ["estimation.robot.source=direct", "control.weight=0.3", "control.form=line", "time_limit=0.5"]
    own = loads(loud.document)
    expected = load_scenario("crossing1", [*overrides, "description=''", "seed=0"], controller="rkhs")
    assert own == expected


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"crossing1"', '"crosing1"', "study.toml: scenes.0: scene: found 'crosing1'.*did you mean 'crossing1'?"),
        ('"bimodal"', '"bimodel"', "setting loud, rate=10.0, .*noise.profile: .*did you mean 'bimodal'?"),
        (
            'name = "loud"\nset',
            'name = "loud"\n# set',
            "found 'scene crossing1, setting loud.*allowed: cells that differ",
        ),
        (
            'controller = "mean"',
            'controller = "mean"\nname = "mine weight=0.3 form=line"',
            "method mine weight=0.3 form=line'; allowed: names that differ",
        ),
        ('"mine.toml"', '"./mine.toml", "mine.toml"', "scenes.2: .*allowed: a scene of another name than 'mine'"),
    ],
)
def test_what_is_wrong_is_told_with_its_cell(cells, old, new, message):
    with pytest.raises(InvalidValue, match=message):
        cells(STUDY.replace(old, new, 1))


@pytest.mark.parametrize("given", ["control.method=mean", 'control={ method = "mean" }'])
def test_no_value_replaces_the_controller_that_a_method_names(cells, given):
    message = "control.method: found 'mean'; allowed: values of other keys; 'rkhs' is the controller of method mine"
    with pytest.raises(InvalidValue, match=re.escape(message)):
        cells(STUDY, given)
    with pytest.raises(InvalidValue, match=re.escape(message)):
        cells(STUDY.replace("degree = 2", 'method = "mean"'))
