"""The cost as a function of any control, its kinks, how a gradient method does on it, and the figure of that."""

from dataclasses import fields, replace

import numpy as np
import pytest

from mjnav.constraints import collision_cone
from mjnav.control.decision_surface import decision_surface
from mjnav.errors import InvalidValue
from mjnav.loop.prepare import load_scenario
from mjnav.paper import gradient_search
from mjnav.paper.cost_surface import claims
from mjnav.paper.decision_cost import VARIANTS, ContinuousCost, clip_places, slope_jump, variant_costs
from mjnav.paper.decisions import decisions_that_matter, goal_cost_excess, spread, variant
from mjnav.paper.gradient_search import by_gradient, fine_grid, on_grid, starts, window_of
from mjnav.paper.item import Verdict, judge

LOW, HIGH = np.array([0.0, -1.5]), np.array([1.0, 1.5])


def measure(scenario):
    return gradient_search.measure([scenario], True, lambda done, total: None)


@pytest.fixture(scope="module")
def scenario():
    return load_scenario("crossing1", ["physics.engine=kinematic", "time_limit=6.0", "control.samples=9"])


@pytest.fixture(scope="module")
def records(scenario):
    return decisions_that_matter(scenario)


@pytest.fixture(scope="module")
def data(scenario):
    return measure(scenario)


@pytest.mark.parametrize("name", VARIANTS)
def test_on_its_candidates_and_beyond_it_equals_the_decision_s_cost(scenario, records, name):
    method, parameters = VARIANTS[name]
    for record in spread(records, 4):
        controller = variant(scenario, method, **parameters)
        decision = controller.decide(record.observation)
        cost = ContinuousCost.of(controller, record.observation)
        costs = decision.costs
        assert cost(costs.v, costs.omega) == pytest.approx(costs.total, rel=1e-9)
        assert [cost(costs.v[[k]], costs.omega[[k]])[0] for k in (0, 57, 401)] == pytest.approx(
            costs.total[[0, 57, 401]], rel=1e-9
        )
        wide = decision_surface(controller, record.observation, decision, num=9)
        v, omega = (a.ravel() for a in np.meshgrid(wide.v, wide.omega, indexing="ij"))
        assert cost(v, omega) == pytest.approx(wide.total.ravel(), rel=1e-9)
        found = on_grid(cost, "reachable")
        assert found.control.tolist() == [decision.v, decision.omega]
        assert (found.cost, found.points) == (pytest.approx(costs.total.min()), 402)
        low, high = window_of(cost, "reachable")
        assert (low <= found.control).all()
        assert (found.control <= high).all()
        assert [end.tolist() for end in window_of(cost, "bounds")] == [LOW.tolist(), HIGH.tolist()]


def test_only_decisions_that_leave_the_cheapest_way_matter(records):
    assert records
    for record in records:
        costs = record.decision.costs
        chosen = (costs.v == record.decision.v) & (costs.omega == record.decision.omega)
        assert goal_cost_excess(record) == pytest.approx(costs.goal[chosen].min() - costs.goal.min())
        assert goal_cost_excess(record) > 0.0


@pytest.mark.parametrize(
    ("least", "end"), [((0.3, 0.4), (0.3, 0.4)), ((0.3, 9.0), (0.3, 1.5)), ((-2.0, -9.0), (0.0, -1.5))]
)
@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e6])
def test_the_gradient_method_finds_the_least_of_a_bowl_within_the_window(least, end, scale):
    def bowl(v, omega):
        return scale * (1.0 + (v - least[0]) ** 2 + 0.2 * (omega - least[1]) ** 2)

    for start in starts(4):
        found = by_gradient(bowl, LOW, HIGH, start)
        assert found.control == pytest.approx(np.array(end), abs=1e-3)
        assert found.cost == pytest.approx(float(bowl(*map(np.array, end))), rel=1e-6)
        assert found.points % 5 == 0


def test_the_gradient_method_stays_in_its_basin_and_more_starts_find_others():
    def two_holes(v, omega):
        return (
            2.0
            - np.exp(-20.0 * ((v - 0.2) ** 2 + omega**2))
            - 1.5 * np.exp(-20.0 * ((v - 0.8) ** 2 + (omega - 1) ** 2))
        )

    assert by_gradient(two_holes, LOW, HIGH, np.array([0.25, 0.45])).control == pytest.approx([0.2, 0.0], abs=0.02)
    best = min((by_gradient(two_holes, LOW, HIGH, start) for start in starts(16)), key=lambda found: found.cost)
    assert best.control == pytest.approx([0.8, 1.0], abs=0.02)
    assert best.cost <= fine_grid(two_holes, LOW, HIGH, 41)


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


def test_pairs_meet_the_clip_where_their_cone_does(scenario, records):
    record = records[len(records) // 2]
    cost = variant_costs(scenario, record.observation)[0]
    o, p = record.observation, cost.controller.parameters
    v, omega = record.decision.v, np.linspace(-1.5, 1.5, 301)
    crossings = 0
    for pose, noise in zip(o.robot_pose, o.control_noise, strict=True):
        heading = pose[2] + (omega + noise[1]) * p.preview
        velocity = (v + noise[0]) * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
        disc = o.obstacles[0]
        radius = cost.controller.limits.radius + disc.radius + p.safety_margin
        for position, obstacle_velocity in zip(disc.position, disc.velocity, strict=True):
            f = collision_cone(pose[:2] - position, velocity - obstacle_velocity, radius, horizon=p.horizon) / radius**2
            crossings += int((np.diff(f <= -p.clip) != 0).sum())
    places = clip_places(cost, v, omega)
    assert crossings > 0
    assert len(places) == crossings
    assert (np.diff(places) >= 0.0).all()
    assert not clip_places(variant_costs(scenario, o)[-1], v, omega).size  # nothing is clipped there


def test_the_clip_makes_kinks_and_nothing_else_does(data):
    clipped, free = data.views[2].jumps, data.views[-1].jumps
    assert clipped[-1] > 20.0 * free[-1]
    assert free[-5] / free[-1] == pytest.approx(10.0, rel=0.1)  # in proportion to the step, four of them a decade


def many_runs(data, **changes):
    """The data as if its decisions were from eight runs."""
    times = 8 * 6 // len(data.tick) + 1
    keys = [f.name for f in fields(data) if f.name not in ("run", "drawn", "views")]
    arrays = {key: np.concatenate([getattr(data, key)] * times) for key in keys}
    return replace(
        data, **arrays | {"run": np.arange(len(arrays["tick"])) % 8} | {k: f(arrays) for k, f in changes.items()}
    )


@pytest.mark.parametrize(("factor", "expected"), [(1.5, Verdict.HOLDS), (0.5, Verdict.FAILS), (1.0, Verdict.OPEN)])
def test_the_gradient_methods_ends_decide_the_claim_that_they_are_worse(data, factor, expected):
    found = many_runs(data, found=lambda a: np.repeat(factor * a["grid"][..., None], 3, axis=-1))
    ends = [f for f in judge(claims(found)) if "finds worse controls" in f.claim]
    assert [f.verdict for f in ends] == [expected] * 2


@pytest.mark.parametrize(("ratio", "expected"), [(1.0, Verdict.HOLDS), (0.1, Verdict.FAILS)])
def test_jumps_that_stay_are_kinks_and_those_that_fall_are_not(data, ratio, expected):
    found = many_runs(data, jumps=lambda a: np.stack([a["jumps"][..., 0], ratio * a["jumps"][..., 0]], axis=-1))
    kinks = [f for f in judge(claims(found)) if "not smooth" in f.claim]
    assert [f.verdict for f in kinks] == [expected] * 2


def test_a_method_without_candidates_and_runs_without_obstacles_are_refused(scenario):
    with pytest.raises(InvalidValue, match="control"):
        measure(replace(scenario, control=replace(scenario.control, method="orca", parameters={})))
    with pytest.raises(InvalidValue, match="obstacle"):
        measure(replace(scenario, people=(), time_limit=0.5))
