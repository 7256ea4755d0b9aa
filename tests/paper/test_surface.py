"""The cost as a function of any control, its kinks, and how a gradient method does on it."""

from dataclasses import replace

import numpy as np
import pytest

from mjnav.control.decision_surface import decision_surface
from mjnav.errors import InvalidValue
from mjnav.loop.episode import Episode
from mjnav.loop.prepare import load_scenario
from mjnav.motion.unicycle import reachable
from mjnav.paper import surface
from mjnav.paper.claims import Verdict, judge
from mjnav.paper.episodes import changed, spread
from mjnav.paper.surface import (
    KINK,
    VARIANTS,
    by_gradient,
    claims,
    continuous_cost,
    goal_cost_excess,
    on_grid,
    slope_jump,
)
from mjnav.robot.controller import build_controller

LOW, HIGH = np.array([0.0, -1.5]), np.array([1.0, 1.5])


def measure(scenario):
    return surface.measure([scenario], True, lambda done, total: None)


@pytest.fixture(scope="module")
def scenario():
    return load_scenario("crossing1", ["physics.engine=kinematic", "time_limit=6.0", "control.samples=9"])


@pytest.fixture(scope="module")
def records(scenario):
    records = []
    Episode(scenario, watch=records.append).run()
    return [record for record in records if goal_cost_excess(record) > 0.0]


@pytest.fixture(scope="module")
def data(scenario):
    return measure(scenario)


@pytest.mark.parametrize("name", VARIANTS)
def test_on_its_candidates_and_beyond_it_equals_the_decision_s_cost(scenario, records, name):
    method, parameters = VARIANTS[name]
    for record in spread(records, 3):
        controller = build_controller(changed(scenario, method, **parameters))
        decision = controller.decide(record.seen)
        cost, costs = continuous_cost(controller, record.seen), decision.costs
        assert cost(costs.v, costs.omega) == pytest.approx(costs.total, rel=1e-9)
        assert [cost(costs.v[[k]], costs.omega[[k]])[0] for k in (0, 401)] == pytest.approx(costs.total[[0, 401]])
        wide = decision_surface(controller, record.seen, decision, num=9)
        v, omega = (a.ravel() for a in np.meshgrid(wide.v, wide.omega, indexing="ij"))
        assert cost(v, omega) == pytest.approx(wide.total.ravel(), rel=1e-9)
        best = on_grid(cost, controller, record.seen)
        assert best.control.tolist() == [decision.v, decision.omega]
        assert best.cost == pytest.approx(costs.total.min())
        low, high = reachable(record.seen.twist, controller.limits, controller.period)
        assert (low <= best.control).all()
        assert (best.control <= high).all()


@pytest.mark.parametrize(
    ("least", "end"), [((0.3, 0.4), (0.3, 0.4)), ((0.3, 9.0), (0.3, 1.5)), ((-2.0, -9.0), (0.0, -1.5))]
)
def test_the_gradient_method_finds_the_least_of_a_bowl_within_the_window(least, end):
    scale = 1e6

    def bowl(v, omega):
        return scale * (1.0 + (v - least[0]) ** 2 + 0.2 * (omega - least[1]) ** 2)

    best = by_gradient(bowl, LOW, HIGH)
    assert best.control == pytest.approx(np.array(end), abs=1e-3)
    assert best.cost == pytest.approx(float(bowl(*map(np.array, end))), rel=1e-6)


def test_a_slope_s_jump_falls_with_the_step_unless_there_is_a_kink():
    def kink(v, omega):
        return np.abs(omega - 0.1234) + omega**2

    def smooth(v, omega):
        return np.cos(3.0 * omega)

    steps = (1e-1, 1e-2, 1e-3)
    # The slope runs from -4 to 4, and jumps by 2 within one step, or two.
    assert [slope_jump(kink, 0.5, -1.5, 1.5, step) for step in steps[1:]] == pytest.approx([0.25, 0.25], rel=0.4)
    falls = [slope_jump(smooth, 0.5, -1.5, 1.5, step) for step in steps]
    assert falls[0] / falls[1] == pytest.approx(10.0, rel=0.1)
    assert falls[1] / falls[2] == pytest.approx(10.0, rel=0.1)
    assert slope_jump(lambda v, omega: np.ones_like(omega), 0.5, -1.5, 1.5, 0.1) == 0.0


def test_the_clip_makes_kinks(data):
    assert data.column("jump_ratio", ["d = 3"]).max() > KINK > data.column("jump_ratio", ["as published"]).max()


def many_runs(data, change):
    """The data as if its decisions were from eight runs, every row changed."""
    num = len(data.table) // len(VARIANTS)
    rows = [{**row, **change(row)} for row in data.table]
    table = [
        {**row, "run": k} for k in range(8) for i in range(num) for row in rows[i * len(VARIANTS) :][: len(VARIANTS)]
    ]
    return replace(data, table=table)


@pytest.mark.parametrize(("factor", "expected"), [(1.5, Verdict.HOLDS), (0.5, Verdict.FAILS), (1.0, Verdict.OPEN)])
def test_the_gradient_method_s_ends_decide_the_claim_that_they_are_worse(data, factor, expected):
    found = many_runs(data, lambda row: {"slsqp_cost": factor * row["grid_cost"]})
    ends = [f for f in judge(claims(found)) if "finds worse controls" in f.claim]
    assert [f.verdict for f in ends] == [expected] * 2


@pytest.mark.parametrize(("ratio", "expected"), [(1.0, Verdict.HOLDS), (0.1, Verdict.FAILS)])
def test_jumps_that_stay_are_kinks_and_those_that_fall_are_not(data, ratio, expected):
    found = many_runs(data, lambda row: {"jump_ratio": ratio})
    kinks = [f for f in judge(claims(found)) if "not smooth" in f.claim]
    assert [f.verdict for f in kinks] == [expected] * 2


def test_a_method_without_candidates_and_runs_without_obstacles_are_refused(scenario):
    with pytest.raises(InvalidValue, match="control"):
        measure(changed(scenario, "orca"))
    with pytest.raises(InvalidValue, match="obstacle"):
        measure(replace(scenario, people=(), time_limit=0.5))
