import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjnav.errors import InvalidValue
from mjnav.messages import Contact
from mjnav.metrics import summarise, summary
from mjnav.scene.spec import LaneSpec, Pillar, Table, Wall
from tests.metrics.conftest import make_scenario, make_trajectory


def test_no_two_figures_have_one_name(monkeypatch):
    monkeypatch.setattr(summary, "OF_RUNS", (*summary.OF_RUNS, summary.OF_RUNS[0]))
    with pytest.raises(InvalidValue, match="a name that no other figure or group has"):
        summary._grouped()


def test_a_run_without_a_tick_has_a_summary():
    summary = summarise(make_trajectory([[0, 0]]), make_scenario(), outcome="aborted")
    assert (summary["ticks"], summary["time_s"], summary["localization_rmse_m"]) == (0, 0.0, None)
    assert summary["success"] is False


def test_the_time_is_how_long_it_took_whenever_it_began():
    for start in (0.0, 5.0):
        trajectory = make_trajectory([[0, 0]] * 4, time=start + 0.1 * np.arange(4))
        assert summarise(trajectory, make_scenario(), outcome="goal")["time_s"] == 0.3


def test_a_goal_reached_with_a_contact_is_no_success():
    touched = make_trajectory([[0, 0], [1, 0]], contacts=(Contact("table", "table0", 3.0, 0.05),))
    assert summarise(touched, make_scenario(), outcome="goal")["success"] is False
    assert summarise(make_trajectory([[0, 0], [1, 0]]), make_scenario(), outcome="goal")["success"] is True
    assert summarise(make_trajectory([[0, 0], [1, 0]]), make_scenario(), outcome="timeout")["success"] is False


def test_both_kinds_of_infeasible_ticks_count():
    trajectory = make_trajectory(
        [[0, 0]] * 6, status=("ok", "infeasible", "infeasible_nominal", "stopped", "infeasible")
    )
    assert summarise(trajectory, make_scenario(), outcome="goal")["infeasible_ticks"] == 3


def test_what_is_undefined_is_null_even_where_the_physics_broke():
    trajectory = make_trajectory([[0, 0], [np.nan, np.nan]])
    summary = summarise(trajectory, make_scenario(), outcome="aborted")
    json.dumps(summary, allow_nan=False)
    assert summary["path_length_m"] is None


def moved_world(angle, shift, seed):
    """A run in a furnished room, and the same run in the room turned by `angle` and moved by `shift`."""
    rng = np.random.default_rng(seed)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s], [s, c]])

    def point(xy):
        return tuple((turn @ xy + shift).tolist())

    def line(a, b, d):
        normal = turn @ [a, b]
        return (*normal.tolist(), float(d - normal @ shift))

    def scenario(point, line, yaw):
        return replace(
            make_scenario(start=(*point([0.0, 0.0]), yaw), goal=point([8.0, 1.0]), num_people=2),
            walls=(Wall(point([-1.0, 4.0]), point([9.0, 5.0]), 0.3),),
            tables=(Table(point([4.0, -2.0]), yaw=0.4 + yaw),),
            pillars=(Pillar(point([6.0, 3.0])),),
            lanes=LaneSpec(left=line(0.1, 1.0, -0.6), right=line(0.0, 1.0, 0.7)),
        )

    xy, people = np.cumsum(rng.normal(0.3, 0.4, (12, 2)), axis=0), rng.normal(4.0, 2.0, (12, 2, 2))
    command = rng.normal(size=(11, 2))
    estimate, tracks = xy[:-1] + rng.normal(size=(11, 2)), people[:-1] + rng.normal(size=(11, 2, 2))

    def trajectory(move):
        base = make_trajectory(move(xy), people=move(people), command=command)
        return replace(
            base,
            estimate=np.column_stack([move(estimate), np.zeros(11)]),
            tracks=np.concatenate([move(tracks), np.zeros((11, 2, 2))], axis=-1),
        )

    still = trajectory(lambda p: p), scenario(lambda p: tuple(p), lambda *abc: abc, 0.0)
    moved = trajectory(lambda p: p @ turn.T + shift), scenario(point, line, angle)
    return still, moved


@given(st.floats(-3, 3), st.floats(-20, 20), st.floats(-20, 20), st.integers(0, 1000))
def test_turning_and_moving_the_world_changes_no_figure(angle, x, y, seed):
    worlds = moved_world(angle, np.array([x, y]), seed)
    still, moved = (summarise(*world, outcome="goal") for world in worlds)
    for key in still:
        assert moved[key] == (pytest.approx(still[key], abs=1e-9) if isinstance(still[key], float) else still[key]), key
