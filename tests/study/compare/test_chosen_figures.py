"""Rates, groups and default figures of a table."""

import numpy as np
import pytest

from mjnav.errors import InvalidValue
from mjnav.metrics.definitions import FIGURES, GROUPS, STRING
from mjnav.metrics.intervals import wilson
from mjnav.study.compare.chosen_figures import DEFAULT_FIGURES, RATES, check_figures, expanded, numbers, over_all
from mjnav.study.compare.study_comparison import compare_study
from mjnav.study.store.store import Store
from tests.study.made_up import row

pytest.importorskip("pyarrow", reason="the sweep extra is not installed")


@pytest.fixture
def store(tmp_path):
    """Ten seeds: three hit a person, two of these by the robot's fault; one ran out of time."""
    store = Store(tmp_path)
    rows = []
    for seed in range(10):
        hit, late = seed < 3, seed == 5
        figures = {"robot_at_fault": 2 if seed < 2 else 0, "timeout": late, "min_human_distance_m": 0.1 * seed}
        figures |= {"people_see_robot": "none" if seed < 9 else "all", "stalled_s": float(seed)}
        if late:
            figures["success"] = False
        rows.append(row("rkhs", seed, 1.0 + seed, hit=hit, **figures))
    with store.writing(""):
        store.append(rows)
    return store


def test_a_truth_of_each_episode_is_a_rate_over_all_of_them(store):
    (table,) = compare_study(store, None, figures=["fault", "timeout", "min_human_distance_m", "stalled_s"]).tables
    found = table.rows[0].figures
    assert {name: (found[name].value, found[name].num) for name in ("success", "collision", "fault", "timeout")} == {
        "success": (0.6, 10), "collision": (0.3, 10), "fault": (0.2, 10), "timeout": (0.1, 10)
    }  # fmt: skip
    assert found["fault"].interval == wilson(2, 10)
    assert found["min_human_distance_m"].value == pytest.approx(0.45)  # over all
    assert found["stalled_s"].num == 6  # over those that succeeded
    assert table.people == ("all", "none")


def test_default_figures_that_no_row_has_are_left_out_and_those_asked_for_stay(store):
    known = compare_study(store, None, figures=DEFAULT_FIGURES).figures
    assert known == ("fault", "time_s", "control_cost", "min_clearance_m", "stalled_s", "min_human_distance_m")
    asked = compare_study(store, None, figures=["path_ratio"])
    assert asked.figures == ("path_ratio",)
    assert np.isnan(asked.tables[0].rows[0].figures["path_ratio"].value)
    beside = compare_study(store, None, figures=[*DEFAULT_FIGURES, "path_ratio"]).figures
    assert beside == (*known[:3], "path_ratio", *known[3:])


def test_a_group_stands_for_its_numbers():
    found = expanded(["social", "time_s", "ending"])
    assert found[: len(GROUPS["social"]) - 0] == tuple(GROUPS["social"])
    assert found.count("time_s") == 1
    assert not set(found) & {*RATES, *(name for name, one in FIGURES.items() if one.type == STRING)}
    check_figures(found)
    for group in GROUPS:
        assert set(expanded([group])) <= set(numbers())
    with pytest.raises(InvalidValue, match="did you mean 'social'"):
        check_figures(["socail"])


def test_distances_shares_and_contacts_are_of_all_runs_and_costs_of_those_that_succeeded():
    assert all(map(over_all, ("min_clearance_m", "collisions_person", "personal_space_share", "spl", "robot_at_fault")))
    assert not any(map(over_all, ("time_s", "control_cost", "path_ratio", "stalled_s", "metrics_of_ones_own")))
