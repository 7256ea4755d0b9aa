"""One decision's cheapest control, looked for on the candidates' grid and by a gradient method.

Gradients are central differences: a control costs five points, in one call of the kernel. The window is scaled to the
unit square and the cost to 1 at the start, as the method's tolerances are absolute; the best control that it looked at
counts.
"""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from mjnav.control.problem.candidates import candidate_grid
from mjnav.messages import Array
from mjnav.paper.continuous_cost import ContinuousCost

Cost = Callable[[Array, Array], Array]  # of controls v, omega (K,): (K,)

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
