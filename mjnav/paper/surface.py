"""The cost over (v, omega) (figure 3): whether a gradient method does worse on it than samples.

Decisions are those in which obstacles matter: another candidate was chosen than the goal alone would choose. On each
of them the cost is that of the published method and of mjnav's class, with the nominal control and the desired
distributions held at the decision's. Within what one period reaches, the grid's 402 candidates are compared with
sequential quadratic programming (SLSQP) from the middle.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjnav.control.decision_surface import DecisionSurface, decision_surface
from mjnav.control.methods.rkhs import Rkhs
from mjnav.control.problem.candidates import Candidates
from mjnav.control.problem.goal_cost import GoalCost
from mjnav.loop.episode import Episode
from mjnav.messages import Array, Observation, TickRecord
from mjnav.metrics.intervals import wilson
from mjnav.motion.unicycle import reachable
from mjnav.paper.claims import Claim, Measured, MeasuredItem, Progress, mean_by_run, shown
from mjnav.paper.episodes import CLASS, DIRECT, changed, spread
from mjnav.report.figures import decision_surface_figure
from mjnav.rkhs.mmd import moment_distance
from mjnav.robot.controller import build_controller
from mjnav.scene.load import with_seed
from mjnav.scene.spec import Scenario

Cost = Callable[[Array, Array], Array]  # of controls v, omega (K,): (K,)

PUBLISHED = "as published"
VARIANTS: Mapping[str, tuple[str, Mapping[str, Any]]] = MappingProxyType(  # method, and its parameters that are changed
    {
        **{f"d = {d}": (CLASS, {"degree": d}) for d in (1, 2, 3)},
        PUBLISHED: ("rkhs-paper", {}),
    }
)
GROUPS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {PUBLISHED: (PUBLISHED,), "by the class's defaults, d = 1, 2, 3": ("d = 1", "d = 2", "d = 3")}
)
SOURCE = "figure 3, section V-A"
NEAR = 0.01  # of a cost: what counts as worse, and as the same
TOLERANCE = 1e-9  # of SLSQP, of the cost at the start
TINY = 1e-12  # below which a cost or a width is not divided by


@dataclass(frozen=True, slots=True)
class Searches:
    """Searches on decisions, and one decision that is drawn."""

    table: Sequence[Mapping[str, Any]]  # a row for every decision and variant
    drawn: str  # scene, seed and time of the decision
    surface: DecisionSurface  # its cost for d = 3

    def rows(self) -> list[dict[str, Any]]:
        """One for every decision and variant."""
        return [dict(row) for row in self.table]

    def column(self, name: str, variants: Sequence[str] = tuple(VARIANTS)) -> Array:
        """A column's values for these variants, (n,)."""
        return np.array([row[name] for row in self.table if row["variant"] in variants])


# --------------------------------------------------------------------------------------------- searches


def continuous_cost(controller: Rkhs, observation: Observation) -> Cost:
    """J + lambda sum_j MMD^2(F_j, F_j^des) of any controls, by the decision's own kernel; lanes do not count.

    The nominal control, and with it F^des, stay the decision's: on its candidates these are the costs it compared.
    """
    problem, parameters = controller.problem(observation), controller.parameters
    desired, sizes = controller.desired(problem).raw_moments(parameters.degree)
    heading, limits, period = float(problem.mean_pose[2]), controller.limits, controller.period

    def cost(v: Array, omega: Array) -> Array:
        goal = GoalCost.of(Candidates(v, omega), heading, observation.twist, limits, period, parameters)
        # Where F^des is empty, max(0, f) is compared with 0.
        moments = problem.cone.raw_moments(v, omega, parameters.degree, sizes == 0)
        risk = moment_distance(moments, desired, parameters.kernel).sum(axis=1)
        return goal(problem.mean_pose[:2], observation.goal) + parameters.weight * risk

    return cost


def by_gradient(cost: Cost, low: Array, high: Array) -> tuple[Array, float]:
    """The best control (2,) that SLSQP computes between `low` and `high` (2,) from their middle, and its cost.

    The window is scaled to the unit square and the cost to 1 at the start, as the method's tolerances are absolute.
    """
    from scipy.optimize import minimize

    def cost_at(place: Array) -> float:
        v, omega = low + place * (high - low)
        return float(cost(np.array([v]), np.array([omega]))[0])

    scale = max(cost_at(np.array([0.5, 0.5])), TINY)
    end = minimize(
        lambda place: cost_at(place) / scale,
        np.array([0.5, 0.5]),
        jac="3-point",
        method="SLSQP",
        bounds=[(0.0, 1.0)] * 2,
        options={"ftol": TOLERANCE},
    )
    return low + end.x * (high - low), cost_at(end.x)


def goal_cost_excess(record: TickRecord) -> float:
    """The goal cost of the chosen candidate above the least; 0 where the method has no costs."""
    costs = record.decision.costs
    return 0.0 if costs is None else float(costs.goal[np.argmin(costs.total)] - costs.goal.min())


def measure(scenarios: Sequence[Scenario], quick: bool, progress: Progress) -> Searches:
    """From runs of every scenario, from its seed on; a decision of the first run is drawn."""
    num_seeds, num_decisions = (1, 2) if quick else (8, 6)
    runs = [with_seed(scenario, scenario.seed + k) for scenario in scenarios for k in range(num_seeds)]
    table: list[dict[str, Any]] = []
    hardest: list[tuple[Scenario, TickRecord]] = []  # of each run
    for index, scenario in enumerate(runs):
        records: list[TickRecord] = []
        Episode(scenario, watch=records.append).run()
        records = [record for record in records if goal_cost_excess(record) > 0.0]
        hardest.append((scenario, max(records, key=goal_cost_excess)))
        for record in spread(records, num_decisions):
            decision = {"scene": scenario.name, "seed": scenario.seed, "tick": record.tick, "run": index}
            table += [decision | _compared(scenario, record, name) for name in VARIANTS]
        progress(index + 1, len(runs))
    scenario, record = hardest[0]
    controller = _controller(scenario, "d = 3")
    surface = decision_surface(controller, record.seen, controller.decide(record.seen), num=61 if quick else 161)
    where = f"d = 3, {scenario.name}, seed {scenario.seed}, {record.truth.time:.1f} s"
    return Searches(table, where, surface)


def _controller(scenario: Scenario, name: str) -> Rkhs:
    method, parameters = VARIANTS[name]
    controller = build_controller(changed(scenario, method, **parameters))
    assert isinstance(controller, Rkhs)
    return controller


def _compared(scenario: Scenario, record: TickRecord, name: str) -> dict[str, Any]:
    """What one decision shows of one variant."""
    controller = _controller(scenario, name)
    window = reachable(record.seen.twist, controller.limits, controller.period)
    _, searched = by_gradient(continuous_cost(controller, record.seen), *window)
    costs = controller.decide(record.seen).costs
    assert costs is not None
    return {"variant": name, "grid_cost": float(costs.total.min()), "slsqp_cost": searched}


# ---------------------------------------------------------------------------------------------- claims


def claims(data: Searches) -> Iterator[Claim]:
    """On where the gradient method ends."""
    num, seed = len(data.table) // len(VARIANTS), int(data.table[0]["seed"])
    for name, variants in GROUPS.items():
        searched, grid = data.column("slsqp_cost", variants), data.column("grid_cost", variants)
        worse, better = searched > (1.0 + NEAR) * grid, grid > (1.0 + NEAR) * searched
        points = 100.0 * (worse.astype(float) - better)
        difference = mean_by_run(data.column("run", variants), points, seed, "surface")
        e = difference.estimate
        yield Claim(
            f"A gradient method finds worse controls than sampling them, on the cost {name}.",
            SOURCE,
            [Measured(e.value > 0.0, difference.p)],
            f"SLSQP on {num} decisions of {e.num} runs, in what one period reaches: more than {100 * NEAR:g} % worse "
            f"than the 20 × 20 grid in {_share(worse)}, as much better in {_share(better)}, a difference of "
            f"{shown(e, 'points', signed=True)} by runs.",
        )


def _share(events: NDArray[np.bool_]) -> str:
    low, high = wilson(int(events.sum()), events.size) or (0.0, 1.0)
    return f"{100 * events.mean():.1f} % [{100 * low:.1f}, {100 * high:.1f}]"


SURFACE = MeasuredItem(
    "The cost over (v, ω), and a gradient method against samples",
    ("crossing1", "crossing3"),
    DIRECT,
    measure,
    claims,
    lambda data: decision_surface_figure(data.surface, data.drawn),
)
