"""The cost as a function of any control, and how a gradient method does on it."""

from dataclasses import replace

import numpy as np
import pytest

from mjnav.control.decision_surface import decision_surface
from mjnav.loop.episode import Episode
from mjnav.loop.prepare import load_scenario
from mjnav.paper import surface
from mjnav.paper.claims import Verdict, judge
from mjnav.paper.episodes import changed, spread
from mjnav.paper.surface import VARIANTS, by_gradient, claims, continuous_cost, goal_cost_excess
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


@pytest.mark.parametrize(
    ("least", "end"), [((0.3, 0.4), (0.3, 0.4)), ((0.3, 9.0), (0.3, 1.5)), ((-2.0, -9.0), (0.0, -1.5))]
)
def test_the_gradient_method_finds_the_least_of_a_bowl_within_the_window(least, end):
    scale = 1e6

    def bowl(v, omega):
        return scale * (1.0 + (v - least[0]) ** 2 + 0.2 * (omega - least[1]) ** 2)

    control, cost = by_gradient(bowl, LOW, HIGH)
    assert control == pytest.approx(np.array(end), abs=1e-3)
    assert cost == pytest.approx(float(bowl(*map(np.array, end))), rel=1e-6)


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
