"""Claims and their verdicts."""

import numpy as np
import pytest

from mjnav.paper.item import Claim, Measured, Verdict, judge, overall


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
