"""A decision's cheapest control, searched for on the candidates' grid and by a gradient method, on many decisions.

Gradients are central differences: a control costs five points, in one call of the kernel. The window is scaled to the
unit square and the cost to 1 at the start, as the method's tolerances are absolute; the best control that it computed
counts.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjnav.control.decision_surface import DecisionSurface, decision_surface, require_candidates
from mjnav.control.problem.candidates import candidate_grid
from mjnav.errors import InvalidValue
from mjnav.loop.prepare import build_controller
from mjnav.messages import Array, TickRecord
from mjnav.paper.decision_cost import VARIANTS, ContinuousCost, Cost, clip_places, slope_jump, slopes, variant_costs
from mjnav.paper.decisions import decisions_that_matter, goal_cost_excess, spread
from mjnav.paper.item import Progress
from mjnav.scenarios.load import with_seed
from mjnav.scenarios.spec import Scenario

WINDOWS = ("reachable", "bounds")  # what one period reaches; all between the limits
STARTS = (1, 4, 16)
NEAR = 0.01  # of a cost: what counts as worse, and as the same
JUMP_STEPS = (1e-3, 1e-4)  # [rad/s] of the slopes of every decision
KINK = 0.3  # the jump of the smaller step over that of the larger: 0.1 where smooth, 1 at a kink

# Of the decision that is drawn.
CUT_STEP = 1e-3  # [rad/s]
STEPS = tuple((10.0 ** np.linspace(-1.5, -4.0, 11)).tolist())  # [rad/s] of the slopes whose jumps are drawn
BATCHES = (1, 5, 402)  # controls a call
CALLS = 50  # whose median counts

STEP = 1e-6  # of the window's width, for the differences
TOLERANCE = 1e-9  # of the cost at the start
MAX_ITERATIONS = 100
TINY = 1e-12  # below which a cost or a width is not divided by
_FIVE = STEP * np.array([[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])


@dataclass(frozen=True, slots=True)
class Found:
    """Where a search ended."""

    control: Array  # (2,) v, omega
    cost: float
    points: int  # at which the cost was computed
    seconds: float


def window_of(cost: ContinuousCost, window: str) -> tuple[Array, Array]:
    """Lowest and highest (v, omega) of the window "reachable" or "bounds"; each (2,)."""
    c = cost.controller
    grid = candidate_grid(cost.problem.observation.twist, c.limits, c.period, 2, 2, window)
    return np.array([grid.v[0], grid.omega[0]]), np.array([grid.v[3], grid.omega[3]])


def on_grid(cost: ContinuousCost, window: str) -> Found:
    """The cheapest of the controller's own candidates, keep and brake among them."""
    began = perf_counter()
    c, p = cost.controller, cost.controller.parameters
    grid = candidate_grid(cost.problem.observation.twist, c.limits, c.period, p.num_v, p.num_omega, window)
    total = cost(grid.v, grid.omega)
    best = int(np.argmin(total))
    seconds = perf_counter() - began
    return Found(np.array([grid.v[best], grid.omega[best]]), float(total[best]), total.size, seconds)


def by_gradient(cost: Cost, low: Array, high: Array, start: Array) -> Found:
    """Where sequential quadratic programming (SLSQP) ends that begins at `start` (2,) in the unit square."""
    from scipy.optimize import minimize

    size = np.maximum(high - low, TINY)
    seen: list[tuple[float, Array]] = []
    scale = 1.0

    def with_slope(place: Array) -> tuple[float, Array]:
        places = np.clip(np.clip(place, 0.0, 1.0) + _FIVE, 0.0, 1.0)
        v, omega = np.ascontiguousarray((low + places * size).T)
        y = cost(v, omega) / scale
        seen.append((float(y[0]) * scale, places[0]))
        slope = (y[[1, 3]] - y[[2, 4]]) / np.array([places[1, 0] - places[2, 0], places[3, 1] - places[4, 1]])
        return float(y[0]), slope

    began = perf_counter()
    scale = max(with_slope(start)[0], TINY)
    minimize(
        with_slope, start, jac=True, method="SLSQP", bounds=[(0.0, 1.0)] * 2,
        options={"ftol": TOLERANCE, "maxiter": MAX_ITERATIONS},
    )  # fmt: skip
    seconds = perf_counter() - began
    best, place = min(seen, key=lambda pair: pair[0])
    return Found(low + place * size, best, len(_FIVE) * len(seen), seconds)


def fine_grid(cost: Cost, low: Array, high: Array, num: int) -> float:
    """The least cost of num x num controls."""
    omega = np.linspace(low[1], high[1], num)
    return min(float(cost(np.full(num, v), omega).min()) for v in np.linspace(low[0], high[0], num))


def starts(num: int) -> Array:
    """Where searches begin in the unit square: 1 the middle, 4 the corners, 16 a regular grid; (num, 2)."""
    places = {1: [0.5], 4: [0.0, 1.0], 16: [0.125, 0.375, 0.625, 0.875]}[num]
    return np.array([(x, y) for x in places for y in places])


@dataclass(frozen=True, slots=True)
class CostView:
    """One cost around one decision, over the whole range between the limits; the cut is at the decision's v."""

    surface: DecisionSurface
    ends: Array  # (16, 2) v, omega where the gradient method ended
    slope_omega: Array  # (n - 1,) in the middles of the cut's steps
    slope: Array  # (n - 1,)
    clips: Array  # (m,) omega at which a pair of samples meets the clip
    jumps: Array  # (len(STEPS),) largest change of slope from one step to the next, of the range of slopes
    call_seconds: Array  # (3,) median of calls with BATCHES controls

    @classmethod
    def of(cls, cost: ContinuousCost, v: float, num: int) -> "CostView":
        """Of the cost around a decision of speed v; the surface is num x num."""
        controller, observation = cost.controller, cost.problem.observation
        low, high = window_of(cost, "bounds")
        omega, slope = slopes(cost, v, low[1], high[1], CUT_STEP)
        return cls(
            surface=decision_surface(controller, observation, controller.decide(observation), num=num),
            ends=np.array([by_gradient(cost, low, high, start).control for start in starts(16)]),
            slope_omega=omega,
            slope=slope,
            clips=clip_places(cost, v, np.linspace(low[1], high[1], omega.size + 1)),
            jumps=np.array([slope_jump(cost, v, low[1], high[1], step) for step in STEPS]),
            call_seconds=np.array([_call_seconds(cost, low, high, batch) for batch in BATCHES]),
        )


def _call_seconds(cost: Cost, low: Array, high: Array, num: int) -> float:
    v, omega = (np.ascontiguousarray(c) for c in np.linspace(low, high, num).T)
    taken = []
    for _ in range(CALLS):
        began = perf_counter()
        cost(v, omega)
        taken.append(perf_counter() - began)
    return float(np.median(taken))


@dataclass(frozen=True, slots=True)
class Searches:
    """Searches on D decisions: V variants of the cost, W windows, S numbers of starts. Times [s] are this machine's."""

    scene: Array  # (D,)
    seed: Array  # (D,)
    tick: Array  # (D,)
    run: Array  # (D,) which run each is from
    reference: Array  # (D, V, W) the least cost known
    grid: Array  # (D, V, W) of the cheapest candidate
    grid_seconds: Array  # (D, V, W)
    found: Array  # (D, V, W, S) of the best of the starts
    points: Array  # (D, V, W, S) at which the cost was computed
    seconds: Array  # (D, V, W, S)
    near: Array  # (D, V, W) share of 16 starts that end within NEAR of the reference
    jumps: Array  # (D, V, 2) as in CostView, at JUMP_STEPS
    drawn: tuple[str, int, float]  # scene, seed, time [s] of the decision that is drawn
    views: tuple[CostView, ...]  # one a variant, then the tuned d = 3 without its clip

    @property
    def against_grid(self) -> Array:
        """1 where all starts end more than NEAR above the grid, -1 where one ends as far below it: (D, V, W, S)."""
        grid = self.grid[..., None]
        worse, better = self.found > (1.0 + NEAR) * grid, grid > (1.0 + NEAR) * self.found
        return worse.astype(float) - better

    @property
    def kinked(self) -> NDArray[np.bool_]:
        """Whether the cut along omega through the chosen control has a kink, (D, V)."""
        return self.jumps[..., 1] > KINK * self.jumps[..., 0]

    def rows(self) -> list[dict[str, Any]]:
        """One for every decision, variant and window."""
        against, kinked, found = self.against_grid, self.kinked, []
        for i, v, w in np.ndindex(*self.grid.shape):
            row = {"scene": self.scene[i], "seed": self.seed[i], "tick": self.tick[i], "variant": tuple(VARIANTS)[v]}
            row |= {"window": WINDOWS[w], "reference_cost": self.reference[i, v, w], "grid_cost": self.grid[i, v, w]}
            row |= {"grid_s": self.grid_seconds[i, v, w], "near_share": self.near[i, v, w]}
            for s, num in enumerate(STARTS):
                row |= {f"slsqp{num}_cost": self.found[i, v, w, s], f"slsqp{num}_s": self.seconds[i, v, w, s]}
                row |= {f"slsqp{num}_points": self.points[i, v, w, s], f"slsqp{num}_against": against[i, v, w, s]}
            row |= {"slope_jump": self.jumps[i, v, 1], "kink": kinked[i, v]}
            found.append({key: value.item() if isinstance(value, np.generic) else value for key, value in row.items()})
        return found


def measure(scenarios: Sequence[Scenario], quick: bool, progress: Progress) -> Searches:
    """From runs of every scenario, from its seed on; a decision of the first run is drawn.

    Raises InvalidValue for a method without candidates, and where no obstacle matters.
    """
    num_seeds, num_decisions, fine = (1, 2, 61) if quick else (8, 6, 201)
    for scenario in scenarios:
        require_candidates(build_controller(scenario), scenario.control.method)
    runs = [with_seed(scenario, scenario.seed + k) for scenario in scenarios for k in range(num_seeds)]
    rows: list[dict[str, Any]] = []
    drawn: tuple[Scenario, TickRecord] | None = None
    for index, scenario in enumerate(runs):
        records = decisions_that_matter(scenario)
        if drawn is None and records:
            drawn = scenario, max(records, key=goal_cost_excess)
        for record in spread(records, num_decisions):
            where = {"scene": scenario.name, "seed": scenario.seed, "tick": record.tick, "run": index}
            rows.append(where | _compare(scenario, record, fine))
        progress(index + 1, len(runs) + 1)
    if drawn is None:
        raise InvalidValue("scenarios", tuple(s.name for s in scenarios), "one in which an obstacle matters")
    scenario, record = drawn
    costs = variant_costs(scenario, record.seen)
    views = tuple(CostView.of(cost, record.decision.v, 61 if quick else 161) for cost in costs)
    progress(len(runs) + 1, len(runs) + 1)
    return Searches(
        **{key: np.array([row[key] for row in rows]) for key in rows[0]},
        drawn=(scenario.name, scenario.seed, record.truth.time), views=views,
    )  # fmt: skip


def _compare(scenario: Scenario, record: TickRecord, fine: int) -> dict[str, Array]:
    """The part of Searches that is one decision's."""
    shape = (len(VARIANTS), len(WINDOWS))
    one = {key: np.empty(shape) for key in ("reference", "grid", "grid_seconds", "near")}
    one |= {key: np.empty((*shape, len(STARTS))) for key in ("found", "points", "seconds")}
    jumps = np.empty((len(VARIANTS), len(JUMP_STEPS)))
    for i, cost in enumerate(variant_costs(scenario, record.seen)[: len(VARIANTS)]):
        on_grid(cost, WINDOWS[0])  # so that no search's time includes what a decision computes once
        for j, window in enumerate(WINDOWS):
            low, high = window_of(cost, window)
            sampled = on_grid(cost, window)
            searches = [[by_gradient(cost, low, high, start) for start in starts(num)] for num in STARTS]
            costs = [np.array([found.cost for found in several]) for several in searches]
            reference = min(fine_grid(cost, low, high, fine), sampled.cost, *(c.min() for c in costs))
            one["reference"][i, j], one["grid"][i, j] = reference, sampled.cost
            one["grid_seconds"][i, j] = sampled.seconds
            one["near"][i, j] = (costs[-1] <= (1.0 + NEAR) * reference).mean()
            one["found"][i, j] = [c.min() for c in costs]
            one["points"][i, j] = [sum(found.points for found in several) for several in searches]
            one["seconds"][i, j] = [sum(found.seconds for found in several) for several in searches]
        low, high = window_of(cost, "bounds")
        jumps[i] = [slope_jump(cost, record.decision.v, low[1], high[1], step) for step in JUMP_STEPS]
    return one | {"jumps": jumps}
