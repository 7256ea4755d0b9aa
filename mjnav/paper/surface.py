"""The paper's cost over (v, omega): whether it has kinks, and whether a gradient method does worse than samples.

Decisions are looked at where obstacles matter: where another candidate was chosen than the goal alone would choose. On
each of them the cost is that of the published method and of the tuned one for d = 1, 2, 3, with the nominal control and
the desired distributions held where the decision has them. The grid's 402 candidates stand against SLSQP from 1, 4 and
16 starts (`search`), in the window of one period and between the limits; the reference is the least cost that anything
found, a fine grid among them.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjnav.control.decision_surface import require_candidates
from mjnav.errors import InvalidValue
from mjnav.loop.prepare import build_controller
from mjnav.messages import Array, TickRecord
from mjnav.metrics.intervals import mcnemar, wilson
from mjnav.paper.by_run import LEAST_RUNS, mean_by_run
from mjnav.paper.continuous_cost import VARIANTS, variant_costs
from mjnav.paper.contrast import shown
from mjnav.paper.cost_view import BATCHES, View, look
from mjnav.paper.decisions import given_up, spread, that_matter
from mjnav.paper.finding import Claim, Finding, Measured, judge
from mjnav.paper.kinks import slope_jump
from mjnav.paper.search import by_gradient, fine_grid, on_grid, starts, window_of
from mjnav.scenarios.spec import Scenario

PUBLISHED = 3  # its place among them
WINDOWS = ("reachable", "bounds")
STARTS = (1, 4, 16)
NEAR = 0.01  # of a cost: what counts as worse, and as the same
JUMP_STEPS = (1e-3, 1e-4)  # [rad/s] of those in every decision
KINK = 0.3  # the jump of the smaller step over that of the larger: 0.1 where smooth, 1 at a kink
SOURCE = "why controls are sampled: the cost over (v, ω)"


@dataclass(frozen=True, slots=True)
class SurfaceData:
    """D decisions, V variants, W windows, S numbers of starts. Times [s] are this machine's."""

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
    jumps: Array  # (D, V, 2) as in View, at JUMP_STEPS
    drawn: tuple[str, int, float]  # scene, seed, time [s] of the decision that is drawn
    views: tuple[View, ...]  # one a variant, then the tuned d = 3 without its clip

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


def measure(
    scenarios: Sequence[Scenario],
    *,
    quick: bool = False,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> SurfaceData:
    """From runs of every scenario, from its seed on; a decision of the first run is drawn.

    Raises InvalidValue for a method without candidates, and where no obstacle matters.
    """
    num_seeds, num_decisions, fine = (1, 2, 61) if quick else (8, 6, 201)
    for scenario in scenarios:
        require_candidates(build_controller(scenario), scenario.control.method)
    runs = [replace(scenario, seed=scenario.seed + k) for scenario in scenarios for k in range(num_seeds)]
    rows: list[dict[str, Any]] = []
    drawn: tuple[Scenario, TickRecord] | None = None
    for index, scenario in enumerate(runs):
        records = that_matter(scenario)
        if drawn is None and records:
            drawn = scenario, max(records, key=given_up)
        for record in spread(records, num_decisions):
            where = {"scene": scenario.name, "seed": scenario.seed, "tick": record.tick, "run": index}
            rows.append(where | _compare(scenario, record, fine))
        progress(index + 1, len(runs) + 1)
    if drawn is None:
        raise InvalidValue("scenarios", tuple(s.name for s in scenarios), "one in which an obstacle matters")
    scenario, record = drawn
    views = look(scenario, record, 61 if quick else 161)
    progress(len(runs) + 1, len(runs) + 1)
    return SurfaceData(
        **{key: np.array([row[key] for row in rows]) for key in rows[0]},
        drawn=(scenario.name, scenario.seed, record.truth.time), views=views,
    )  # fmt: skip


def _compare(scenario: Scenario, record: TickRecord, fine: int) -> dict[str, Array]:
    """The part of SurfaceData that is one decision's."""
    shape = (len(VARIANTS), len(WINDOWS))
    one = {key: np.empty(shape) for key in ("reference", "grid", "grid_seconds", "near")}
    one |= {key: np.empty((*shape, len(STARTS))) for key in ("found", "points", "seconds")}
    jumps = np.empty((len(VARIANTS), len(JUMP_STEPS)))
    for i, cost in enumerate(variant_costs(scenario, record.observation)[: len(VARIANTS)]):
        on_grid(cost, WINDOWS[0])  # what a decision computes once is not the search's
        for j, window in enumerate(WINDOWS):
            low, high = window_of(cost, window)
            sampled = on_grid(cost, window)
            searches = [[by_gradient(cost, low, high, start) for start in starts(num)] for num in STARTS]
            costs = [np.array([found.cost for found in several]) for several in searches]
            reference = min(fine_grid(cost, low, high, fine), sampled.cost, *(c.min() for c in costs))
            one["reference"][i, j], one["grid"][i, j], one["grid_seconds"][i, j] = (
                reference, sampled.cost, sampled.seconds,
            )  # fmt: skip
            one["near"][i, j] = (costs[-1] <= (1.0 + NEAR) * reference).mean()
            one["found"][i, j] = [c.min() for c in costs]
            one["points"][i, j] = [sum(found.points for found in several) for several in searches]
            one["seconds"][i, j] = [sum(found.seconds for found in several) for several in searches]
        low, high = window_of(cost, "bounds")
        jumps[i] = [slope_jump(cost, record.decision.v, low[1], high[1], step) for step in JUMP_STEPS]
    return one | {"jumps": jumps}


def findings(data: SurfaceData) -> tuple[Finding, ...]:
    """Of the cost's kinks, of the gradient method's ends and of its price; the published method, then the tuned one."""
    tuned = [v for v in range(len(VARIANTS)) if v != PUBLISHED]
    return judge([
        _of_kinks(data, [PUBLISHED], "as published"),
        _of_kinks(data, tuned, "as tuned here, d = 1, 2, 3"),
        _of_ends(data, [PUBLISHED], "as published"),
        _of_ends(data, tuned, "as tuned here, d = 1, 2, 3"),
        _of_price(data),
    ])  # fmt: skip


def _of_kinks(data: SurfaceData, variants: list[int], name: str) -> Claim:
    kinked = np.any(data.kinked[:, variants], axis=1)
    jumps = ", ".join(f"{100 * jump:.2g}" for jump in np.median(data.jumps[:, variants, 1], axis=0))
    clipped, free = (100 * data.views[view].jumps[-1] for view in (PUBLISHED - 1, -1))
    why = (
        "The line form has a derivative wherever robot and obstacle do not move alike."
        if variants == [PUBLISHED]
        else f"They come from the clip: on the decision that is drawn, with d = 3, the jump is {clipped:.2g} % with it "
        f"and {free:.2g} % without. Where t* meets its bounds f is stationary in it, and the slope goes on."
    )
    # The exact binomial test of one half.
    p = mcnemar(int(kinked.sum()), int((~kinked).sum())) if len(np.unique(data.run)) >= LEAST_RUNS else None
    return Claim(
        f"The cost over (v, ω), {name}, is not smooth.",
        SOURCE,
        [Measured(bool(kinked.mean() > 0.5), p)],
        f"Kinks along ω through the chosen control, the desired distributions held, at {_share(kinked)} of "
        f"{len(kinked)} decisions. The slope's largest jump within {JUMP_STEPS[1]:g} rad/s is {jumps} % of its range "
        f"(medians). {why}",
    )


def _of_ends(data: SurfaceData, variants: list[int], name: str) -> Claim:
    texts, differences = [], []
    for w, window in enumerate(("what one period reaches", "the whole range between the limits")):
        against = data.against_grid[:, variants, w, 0]  # (D, n)
        difference = 100.0 * ((against > 0).mean(axis=1) - (against < 0).mean(axis=1))
        differences.append(mean_by_run(data.run, difference, int(data.seed[0]), "surface"))
        texts.append(
            f"In {window}: from one start more than {100 * NEAR:g} % worse than the 20 × 20 grid in "
            f"{_share(against > 0)}, as much better in {_share(against < 0)}, a difference of "
            f"{shown(differences[-1].estimate, 'points', signed=True)} by runs; from {STARTS[-1]} starts worse in "
            f"{_share(data.against_grid[:, variants, w, -1] > 0)}."
        )
    count = f"SLSQP on {len(data.run)} decisions of {differences[0].estimate.num} runs, {_costs(len(variants))}."
    return Claim(
        f"A gradient method finds worse controls than sampling them, on the cost {name}.",
        SOURCE,
        [Measured(differences[0].estimate.value > 0.0, differences[0].p)],
        " ".join([count, *texts]),
    )


def _of_price(data: SurfaceData) -> Claim:
    grid, searched = data.grid_seconds[:, :, 0], data.seconds[:, :, 0, 0]
    slower = mean_by_run(data.run, np.log2(searched / grid).mean(axis=1), int(data.seed[0]), "surface")
    ratio = slower.estimate
    times = 2.0**ratio.value
    ends = "" if ratio.interval is None else f" [{2.0 ** ratio.interval[0]:.1f}, {2.0 ** ratio.interval[1]:.1f}]"
    calls = 1e6 * np.mean([view.call_seconds for view in data.views[: len(VARIANTS)]], axis=0)
    each = ", ".join(f"{time:.0f} µs for {num}" for num, time in zip(BATCHES, calls, strict=True))
    return Claim(
        "Sampling the controls takes less time than a gradient method.",
        SOURCE,
        [Measured(ratio.value > 0.0, slower.p)],
        f"On this machine SLSQP from one start takes {times:.1f}{ends} times as long as the grid in what one period "
        f"reaches (geometric mean): {1e3 * np.median(searched):.2g} ms against {1e3 * np.median(grid):.2g} (medians; "
        f"{len(data.run)} decisions of {ratio.num} runs, {_costs(len(VARIANTS))}). It looks at fewer controls, "
        f"{np.median(data.points[:, :, 0, 0]):.0f} in place of 402, but a call of the compiled cost takes {each}.",
    )


def _costs(num: int) -> str:
    return f"{num} costs each" if num > 1 else "one cost"


def _share(events: NDArray[np.bool_]) -> str:
    low, high = wilson(int(events.sum()), events.size) or (0.0, 1.0)
    return f"{100 * events.mean():.1f} % [{100 * low:.1f}, {100 * high:.1f}]"
