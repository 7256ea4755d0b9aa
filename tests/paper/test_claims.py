"""Claims, the differences that they are tested by, and their verdicts."""

import numpy as np
import pytest

from mjnav.paper.claims import (
    LEAST_RUNS,
    Claim,
    Measured,
    Verdict,
    contrasts,
    judge,
    mean_by_run,
    measured,
    overall,
    short,
    shown,
)
from mjnav.study.compare.estimates import Difference, Estimate


def test_a_claim_about_all_settings_holds_in_all_of_them_or_in_some():
    holds, fails, open_ = Verdict.HOLDS, Verdict.FAILS, Verdict.OPEN
    assert overall([holds, holds]) == Verdict.HOLDS
    assert overall([holds, open_]) == Verdict.PARTLY
    assert overall([holds, open_, fails]) == Verdict.MIXED
    assert overall([fails, open_]) == Verdict.FAILS
    assert overall([open_]) == overall([]) == Verdict.OPEN


def test_the_tests_of_an_item_are_corrected_together_for_their_number():
    # 0.012 x 4, 0.02 x 3, 0.6 x 2: only the first is left; 0.02 would have decided the second claim alone.
    tests = [Measured(True, 0.012), Measured(True, 0.02), Measured(False, 0.6), Measured(False, 0.9)]
    together = judge([Claim("first", "", tests[:1]), Claim("second", "", tests[1:3]), Claim("third", "", tests[3:])])
    assert [finding.verdict for finding in together] == [Verdict.HOLDS, Verdict.OPEN, Verdict.OPEN]
    (alone,) = judge([Claim("second", "", tests[1:3])])
    assert alone.verdict == Verdict.PARTLY


def test_an_absent_difference_is_found_in_one_item_of_twenty_at_most():
    rng = np.random.default_rng(0)
    wrong = [
        {f.verdict for f in judge([Claim("it", "", [Measured(True, p) for p in rng.random(50)]) for _ in range(8)])}
        for _ in range(400)
    ]
    assert np.mean([found != {Verdict.OPEN} for found in wrong]) == pytest.approx(0.05, abs=0.03)


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
    change = Difference(Estimate(value, None, num), p)
    swapped = {Verdict.HOLDS: Verdict.FAILS, Verdict.FAILS: Verdict.HOLDS}
    for sign, wanted in ((+1, expected), (-1, swapped.get(expected, expected))):
        (found,) = judge([Claim("it is", "figure 1", [measured("here", change, sign)])])
        assert found.verdict == wanted


def test_contrasts_are_paired_by_setting_and_say_so(made_up):
    here, there = "direct, physics.engine=kinematic", "filtered, physics.engine=kinematic"
    cells = [made_up("a", setting=here, control_cost=3.0), made_up("b", setting=here, control_cost=1.0)]
    here, alone = contrasts([*cells, made_up("a", setting=there)], "a", "b", "control_cost", +1)
    assert alone.line == "crossing1, filtered, kinematic: undefined (n = 0)"
    (judged,) = judge([Claim("a is more", "figure 1", [here])])
    assert judged.verdict == Verdict.HOLDS
    assert judged.evidence.splitlines()[0] == "settings: 1 for it, 0 against, 0 open"
    assert "crossing1, direct, kinematic: +2 m²/s³ [+2, +2] (n = 40); p = 0.0002" in judged.evidence
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
