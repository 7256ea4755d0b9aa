from math import log

import numpy as np
import pytest

from mjnav.estimation.lidar.tracker import CLUTTER, COASTING, CONFIRMED, DETECTED, SPREAD, SUREST, Life

NEAR = log(5.0)  # of the density of a detection beside where it was expected [1/m^2]


def detected(times):
    life = Life(born=0.0, seen=0.0)
    for k in range(1, times):
        life.detected(0.1 * k, NEAR)
    return life


def test_three_detections_confirm_a_track():
    assert CONFIRMED == 3
    assert [detected(n).confirmed for n in (1, 2, 3, 4)] == [False, False, True, True]


def test_the_score_is_the_log_odds_of_a_body():
    life = detected(2)
    assert life.score == pytest.approx(log(DETECTED * 5.0 / CLUTTER))
    life.missed(0.5)
    assert life.score == pytest.approx(log(DETECTED * 5.0 / CLUTTER * 0.5))


def test_what_was_seen_once_and_then_not_where_it_should_be_ends_after_two_scans():
    life = detected(1)
    life.missed(DETECTED)
    assert not life.over(0.1, spread=0.1)
    life.missed(DETECTED)
    assert life.over(0.2, spread=0.1)


def test_a_long_known_body_in_full_view_is_given_up_after_six_scans_and_not_before():
    life = detected(50)
    assert life.score == SUREST
    over = []
    for k in range(8):
        life.missed(DETECTED)
        over.append(life.over(5.0 + 0.1 * k, spread=0.1))
    assert over.index(True) == 5


def test_scans_that_could_not_see_it_count_nothing_against_it():
    life = detected(50)
    for _ in range(40):
        life.missed(0.0)
    assert life.score == SUREST
    assert not life.over(life.seen + 4.0, spread=0.5)


def test_it_ends_when_it_has_been_out_of_sight_too_long_or_might_be_anywhere():
    life = detected(50)
    assert not life.over(life.seen + COASTING - 0.01, spread=SPREAD - 0.01)
    assert life.over(life.seen + COASTING + 0.01, spread=0.1)
    assert life.over(life.seen, spread=SPREAD + 0.01)


def test_a_detection_where_nothing_was_expected_speaks_against_the_track():
    life = detected(3)
    before = life.score
    life.detected(0.4, float(np.log(CLUTTER / 10.0)))
    assert life.score < before
