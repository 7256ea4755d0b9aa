"""A requirement is met by the figure itself, or not; what it cannot be about is refused."""

import pytest

from mjnav.errors import InputError, InvalidValue
from mjnav.study.requirements import Requirement, of_cells, of_run

CELLS = {
    ("hall", "default", "rkhs"): {"success": 0.95, "time_s": float("nan"), "worse": 0},
    ("hall", "default", "mean"): {"success": 0.5, "time_s": 20.0, "worse": 2},
    ("lane", "fast", "./own.py:Policy"): {"success": 1.0, "time_s": 10.0, "worse": 0},
}


@pytest.mark.parametrize(
    ("text", "found", "met"),
    [
        ("success>=0.95", 0.95, True),
        ("success > 0.95", 0.95, False),
        ("time_s<=20", 20.0, True),
        ("success==true", True, True),
        ("outcome==goal", "goal", True),
        ("outcome==goal", "collision", False),
        ("time_s<1e9", float("nan"), False),
    ],
)
def test_it_is_met_by_the_value_and_never_by_an_undefined_one(text, found, met):
    requirement = Requirement.parse(text)
    (answer,) = of_run([requirement], {requirement.figure: found})
    assert answer.met is met
    assert answer.document()["met"] is met


@pytest.mark.parametrize(
    ("where", "methods"),
    [
        ("", 3),
        ("hall/rkhs: ", 1),
        ("hall/default/mean: ", 1),
        ("lane/./own.py:Policy: ", 1),
        ("h*: ", 2),
    ],
)
def test_it_is_about_the_cells_that_it_names(where, methods):
    assert len(of_cells([Requirement.parse(f"{where}success>=0")], CELLS)) == methods


@pytest.mark.parametrize(
    "text", ["success", "success=1", "success>=", ">=1", "success>=0.9 0.8", "success>=nan", "a b>=1"]
)
def test_what_is_no_requirement_is_refused(text):
    with pytest.raises(InvalidValue, match="--require: "):
        Requirement.parse(text)


def test_an_unknown_figure_or_cell_is_named_with_what_there_is():
    with pytest.raises(InvalidValue, match=r"--require: found 'sucess'; .* did you mean 'success'"):
        of_cells([Requirement.parse("sucess>=1")], CELLS)
    with pytest.raises(InputError, match=r"no cell is 'hal/rkhs'; there are hall/default/rkhs; hall"):
        of_cells([Requirement.parse("hal/rkhs: success>=1")], CELLS)
