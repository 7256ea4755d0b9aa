"""Win ratios, against pairs counted by hand, a literal second implementation, and published tests of proportions."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from mjnav.metrics.intervals import holm
from mjnav.study.compare.cell_rows import COLLISIONS, CellRows
from mjnav.study.compare.estimates import all_rivals, win_ratio
from mjnav.study.compare.study_comparison import compare

HIT, LATE, FAILED = "hit", "late", "failed"  # in place of the time of a success


def cell(method, episodes, seeds=None, units=None):
    """A cell of episodes, each the time of a success, or how it ended otherwise."""
    num = len(episodes)
    columns = {name: np.zeros(num) for name in COLLISIONS}
    columns["collisions_wall"] = np.array([float(e == HIT) for e in episodes])
    columns["success"] = np.array([np.nan if e == FAILED else float(not isinstance(e, str)) for e in episodes])
    columns["time_s"] = np.array([99.0 if isinstance(e, str) else float(e) for e in episodes])
    columns |= {"min_clearance_m": -columns["time_s"], "ticks": np.ones(num), "infeasible_ticks": np.zeros(num)}
    columns |= {"compute_ms_control_p50": np.ones(num), "compute_ms_control_p99": np.ones(num)}
    columns["seed"] = np.arange(num) if seeds is None else np.array(seeds)
    return CellRows("s", "default", method, columns, units=units)


def test_a_contact_is_worst_then_a_goal_not_reached_then_the_slower_success():
    pairs = [
        (30.0, HIT), (30.0, LATE), (LATE, HIT), (10.0, 10.1),  # won
        (HIT, LATE), (LATE, 30.0), (10.1, 10.0),  # lost
        (HIT, HIT), (LATE, LATE), (10.0, 10.0),  # tied
        (FAILED, 10.0), (10.0, FAILED), (FAILED, FAILED),  # not counted
    ]  # fmt: skip
    a, b = (cell(name, [pair[i] for pair in pairs]) for i, name in enumerate("ab"))
    found = win_ratio(a, b)
    assert (found.wins, found.losses, found.ties, found.pairs) == (4, 3, 3, 10)
    assert (found.value, found.share) == (pytest.approx(4 / 3), pytest.approx(4 / 7))
    assert found.p == pytest.approx(1.0)
    apart = win_ratio(cell("a", [1.0, 2.0, 3.0], [1, 2, 3]), cell("b", [9.0, 1.0], [3, 7]))
    assert (apart.wins, apart.pairs) == (1, 1)  # of common seeds


EPISODE = st.one_of(st.sampled_from([HIT, LATE, FAILED]), st.integers(1, 4).map(float))
PAIRS = st.lists(st.tuples(EPISODE, EPISODE), min_size=1, max_size=40)


def better(one, other):
    """Whether an episode is better than another, in words."""
    if FAILED in (one, other) or one == HIT:
        return False
    if other == HIT:
        return True
    if one == LATE:
        return False
    return other == LATE or one < other


@given(PAIRS)
@settings(deadline=None, max_examples=60)
def test_counts_interval_and_p_are_those_of_a_literal_count(pairs):
    a, b = (cell(name, [pair[i] for pair in pairs]) for i, name in enumerate("ab"))
    found = win_ratio(a, b)
    wins, losses = sum(better(x, y) for x, y in pairs), sum(better(y, x) for x, y in pairs)
    assert (found.wins, found.losses) == (wins, losses)
    assert found.pairs == sum(FAILED not in pair for pair in pairs)
    if wins + losses == 0:
        assert math.isnan(found.value)
        assert found.interval is None
        assert found.p == (1.0 if found.pairs else None)
        return
    test = stats.binomtest(wins, wins + losses)
    assert found.p == pytest.approx(test.pvalue)
    low, high = test.proportion_ci(method="wilson")
    assert found.interval[0] == pytest.approx(low / (1.0 - low), abs=1e-9)
    assert found.interval[1] == (math.inf if losses == 0 else pytest.approx(high / (1.0 - high)))
    assert found.interval[0] <= found.value <= found.interval[1]


def test_p_values_are_corrected_over_the_methods_and_in_the_matrix_over_all_pairs():
    rng = np.random.default_rng(0)
    times = {"a": rng.gamma(9.0, size=60), "b": rng.gamma(9.0, size=60) - 1.0, "c": rng.gamma(9.0, size=60) - 2.5}
    cells = [cell(name, list(own + 20.0)) for name, own in times.items()]
    (table,) = compare(cells, reference="a", figures=(), rivals=True)
    own = [row.wins for row in table.rows]
    assert own[0] is None

    def by_hand(one, other):
        return stats.binomtest(int(np.sum(times[one] < times[other])), 60).pvalue

    assert [one.p for one in own[1:]] == pytest.approx(holm([by_hand("b", "a"), by_hand("c", "a")]))
    pairs = [("a", "b"), ("a", "c"), ("b", "c")]
    assert [(one.method, one.other) for one in table.rivals] == pairs
    assert [one.ratio.p for one in table.rivals] == pytest.approx(holm([by_hand(*pair) for pair in pairs]))
    assert table.rivals == all_rivals(cells)


def test_episodes_of_one_layout_count_as_often_as_they_tell_anything_new():
    rng = np.random.default_rng(1)
    a, b = (list(rng.gamma(9.0, size=50)) for _ in "ab")
    alone = win_ratio(cell("a", a), cell("b", b))
    units = np.repeat(np.arange(50), 4)
    first, second = (cell(name, list(np.repeat(own, 4)), units=units) for name, own in (("a", a), ("b", b)))
    copied = win_ratio(first, second)
    assert (copied.wins, copied.losses) == (4 * alone.wins, 4 * alone.losses)
    assert copied.interval == pytest.approx(alone.interval, rel=1e-9)
    assert copied.p == pytest.approx(alone.p, abs=0.03)
