"""Settings that a study draws: the same from the same file, as many as asked for, spread as the file says."""

from typing import Any

import numpy as np
import pytest
from scipy.stats import chisquare, kstest

from mjnav.errors import InvalidValue
from mjnav.scene import loads
from mjnav.scene.draws import Uniform, draw_number
from mjnav.study.cells import resolve
from mjnav.study.study_file import Search, load_study

LOG = {"low": 1.0, "high": 30.0, "log": True}
STUDY = """
schema = 1
name = "searched"
scenes = ["crossing1"]
[[methods]]
controller = "rkhs"
set = { degree = 2 }
search = { count = 4, weight = { low = 1, high = 30, log = true }, robot.min_speed = { low = -0.5, high = 0.0 } }
[[methods]]
controller = "mean"
"""


def settings(search: Search, *, study="tuning", label="rkhs", controller="rkhs", standing=None):
    return search.settings(study, label, controller, standing or {"control.weight": 10.0})


def drawn(key: str, draw: object, **options) -> list[Any]:
    """All values of one key but the first, which is none."""
    return [one[f"control.{key}"] for one in settings(Search(100, None, {key: draw}), **options)[1:]]


@pytest.fixture
def cells(tmp_path):
    """Resolves a study of this text."""

    def resolved(text: str):
        (tmp_path / "study.toml").write_text(text)
        return resolve(load_study(tmp_path / "study.toml"))

    return resolved


def test_the_first_setting_is_the_method_as_it_stands_and_every_other_a_cell(cells):
    found = cells(STUDY)
    assert [cell.method for cell in found] == ["rkhs #1", "rkhs #2", "rkhs #3", "rkhs #4", "mean"]
    first, *others, mean = found
    assert first.parameters == mean.parameters == "{}"
    assert dict(loads(first.document).control.parameters) == {"degree": 2}
    search = Search(4, None, {"weight": LOG, "robot": {"min_speed": {"low": -0.5, "high": 0.0}}})
    for cell, values in zip(others, settings(search, study="searched")[1:], strict=True):
        scenario = loads(cell.document)
        assert scenario.control.parameters == {"degree": 2, "weight": values["control.weight"]}
        assert scenario.robot.min_speed == values["robot.min_speed"]


def test_settings_stay_with_a_larger_count_and_beside_another_parameter():
    few, many = (settings(Search(count, None, {"weight": LOG})) for count in (5, 24))
    assert many[:5] == few
    more = settings(Search(24, None, {"degree": {"low": 1, "high": 10}, "weight": LOG}))
    assert [one["control.weight"] for one in more[1:]] == [one["control.weight"] for one in many[1:]]
    assert settings(Search(24, None, {"weight": LOG}), study="other")[1:] != many[1:]
    seeded = [settings(Search(24, 7, {"weight": LOG}), study=study) for study in ("tuning", "other")]
    assert seeded[0] == seeded[1] != many


def test_numbers_are_spread_as_the_file_says():
    decades = np.log10(drawn("weight", {"low": 0.01, "high": 100.0, "log": True}))
    assert kstest((decades + 2.0) / 4.0, "uniform").pvalue > 0.01
    plain = np.array(drawn("weight", {"low": 0.0, "high": 2.0}))
    assert kstest(plain / 2.0, "uniform").pvalue > 0.01


def test_a_parameter_that_is_a_whole_number_stays_one():
    assert {type(value) for value in drawn("steps", {"low": 1, "high": 1000}, controller="mppi")} == {int}
    assert {type(value) for value in drawn("weight", {"low": 1, "high": 300})} == {float}
    rng = np.random.default_rng(3)
    counts = np.bincount([draw_number(Uniform(1, 3, log=True), None, True, rng) for _ in range(4000)])
    assert chisquare(counts[1:], 4000 * np.diff(np.log([1, 2, 3, 4])) / np.log(4)).pvalue > 0.01


def test_a_setting_that_the_method_has_as_it_stands_is_not_drawn():
    degrees = {"degree": {"one_of": [1, 2, 3]}}
    found = settings(Search(3, None, degrees), standing={"control.degree": 2})[1:]
    assert sorted(one["control.degree"] for one in found) == [1, 3]
    with pytest.raises(InvalidValue, match="count: found 4; allowed: at most 3: its values make no more settings"):
        settings(Search(4, None, degrees))


def test_a_count_that_the_values_fill_is_drawn_however_often_one_comes_again():
    values = [float(i) for i in range(1, 401)]
    found = settings(Search(400, None, {"weight": {"one_of": values}}), standing={"control.weight": 1.0})[1:]
    assert sorted(one["control.weight"] for one in found) == values[1:]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("weight =", "wieght =", "study.toml: method rkhs: search.wieght: .*did you mean 'weight'?"),
        ("low = 1,", "low = 40,", r"methods.0.search.weight.high: found 30.0; allowed: .*least one \(40\)"),
        ("-0.5", "-500.0", "method rkhs #2: robot.min_speed: found -"),
        ("{ degree = 2 }", "{ degree = 2 }\ngrid = { degree = [1] }", "methods.0.search: .*one of the two"),
    ],
)
def test_what_is_wrong_is_told_in_a_line(cells, old, new, message):
    with pytest.raises(InvalidValue, match=message):
        cells(STUDY.replace(old, new, 1))
