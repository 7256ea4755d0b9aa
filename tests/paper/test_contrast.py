"""Differences by setting and by run, from rows whose answers are known."""

import numpy as np
import pytest

from mjnav.paper.contrast import LEAST_RUNS, Contrast, claim, contrasts, mean_by_run, short, shown
from mjnav.paper.item import Claim, Verdict, judge
from mjnav.study.compare.estimates import Difference, Estimate


@pytest.mark.parametrize(
    ("value", "p", "num", "expected"),
    [
        (0.15, 0.01, 40, Verdict.HOLDS),
        (-0.15, 0.01, 40, Verdict.FAILS),
        (0.15, 0.05, 40, Verdict.OPEN),
        (0.15, 0.01, 19, Verdict.OPEN),  # too few seeds to judge by
        (np.nan, None, 0, Verdict.OPEN),
    ],
)
def test_a_sign_is_judged_by_its_p_value(value, p, num, expected):
    contrast = Contrast("here", Difference(Estimate(value, None, num), p))
    swapped = {Verdict.HOLDS: Verdict.FAILS, Verdict.FAILS: Verdict.HOLDS}
    for sign, wanted in ((+1, expected), (-1, swapped.get(expected, expected))):
        (found,) = judge([Claim("it is", "figure 1", [contrast.measured(sign)])])
        assert found.verdict == wanted


def test_contrasts_are_paired_by_setting_and_say_so(made_up):
    here, there = "direct, physics.engine=kinematic", "filtered, physics.engine=kinematic"
    cells = [made_up("a", setting=here, control_cost=3.0), made_up("b", setting=here, control_cost=1.0)]
    found, alone = contrasts([*cells, made_up("a", setting=there)], "a", "b", "control_cost")
    assert alone.measured(+1).line == "crossing1, filtered, kinematic: undefined (n = 0)"
    assert found.where == "crossing1, direct, kinematic"
    assert found.difference.estimate.value == pytest.approx(2.0)
    (judged,) = judge([claim("a is more", "figure 1", [found], +1, "m")])
    assert judged.verdict == Verdict.HOLDS
    assert judged.evidence.splitlines()[0] == "settings: 1 for it, 0 against, 0 open"
    assert "+2 m [+2, +2] (n = 40); p = 0.0002" in judged.evidence
    assert shown(Estimate(np.nan, None, 0)) == "undefined (n = 0)"
    assert short("direct, physics.engine=mujoco noise.profile=bimodal") == "direct, mujoco bimodal"


def test_a_mean_by_run_counts_runs_not_decisions():
    run = np.repeat(np.arange(6), [100, 1, 1, 1, 1, 1])
    values = np.where(run == 0, 1.0, 0.0)
    found = mean_by_run(run, values, 0, "test")
    assert (found.estimate.value, found.estimate.num) == (pytest.approx(1.0 / 6.0), 6)
    assert found.estimate.interval[0] == 0.0  # the first run may not be drawn
    assert found.estimate.interval[1] == pytest.approx(0.5)
    assert found == mean_by_run(run, values, 0, "test")
    few = run < LEAST_RUNS - 1
    too_few = mean_by_run(run[few], values[few], 0, "test")
    assert (too_few.estimate.interval, too_few.p) == (None, None)
