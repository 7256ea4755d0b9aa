"""Rates and means of cells with their intervals, and paired differences of two cells.

What is drawn with replacement, and whose signs are flipped, are the units of evidence: the rows, or the layouts where
`CellRows.units` says that several rows are of one.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjnav.messages import Array
from mjnav.metrics.intervals import Interval, SharedBootstrap, clustered_wilson, mcnemar, wilson
from mjnav.rng import stream
from mjnav.study.compare.cell_rows import CellRows
from mjnav.study.compare.chosen_figures import is_cost, is_rate

RESAMPLES = 5_000


@dataclass(frozen=True, slots=True)
class Estimate:
    """A figure and its 95 % interval, from `num` seeds; NaN and None where they are undefined."""

    value: float
    interval: Interval
    num: int


@dataclass(frozen=True, slots=True)
class Difference:
    """An estimate of method - reference, and its p-value with Holm's correction over the table's methods."""

    estimate: Estimate
    p: float | None
    ratio: Estimate | None = None  # of a cost: mean of the method over mean of the reference, over the same pairs


@lru_cache(8)
def bootstrap(num: int) -> SharedBootstrap:
    """The bootstrap that all figures of `num` seeds share."""
    return SharedBootstrap(num, stream(0, "compare.bootstrap"), resamples=RESAMPLES)


def estimate(cell: CellRows, figure: str) -> Estimate:
    """A rate or a mean of one cell."""
    return estimates([cell], [figure])[0][figure]


def estimates(cells: Sequence[CellRows], figures: Sequence[str]) -> list[dict[str, Estimate]]:
    """Rates and means of every cell."""
    means = [by_unit(cell.values(figure), cell.units) for cell in cells for figure in figures if not is_rate(figure)]
    intervals = iter(_by_length(means, _ratios))

    def one(cell: CellRows, figure: str) -> Estimate:
        values = cell.values(figure)
        return _estimate(values, _of_rate(values, cell.units) if is_rate(figure) else next(intervals))

    return [{figure: one(cell, figure) for figure in figures} for cell in cells]


def _of_rate(values: Array, units: NDArray[np.intp] | None) -> Interval:
    known = values[np.isfinite(values)]
    return wilson(int(known.sum()), known.size) if units is None else clustered_wilson(*by_unit(values, units))


def difference(cell: CellRows, base: CellRows, figure: str) -> Difference:
    """cell - base over the common seeds, the p-value without correction."""
    return differences([cell], base, [figure])[0][figure]


def paired(changes: Array) -> Difference:
    """The mean of differences by seed (n,), NaN where undefined; the p-value of sign flips, without correction."""
    if not len(changes):
        return Difference(Estimate(nan, None, 0), None)
    shared = bootstrap(len(changes))
    return Difference(_estimate(changes, shared.interval(changes)), shared.p_values(changes[None])[0])


def common(cell: CellRows, base: CellRows) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The indices of the common seeds in the first and in the second cell, (n,) each."""
    _, here, there = np.intersect1d(cell.seeds, base.seeds, assume_unique=True, return_indices=True)
    return here, there


def by_unit(values: Array, units: NDArray[np.intp] | None) -> Array:
    """Of values (n,) the sums of those that are known, and how many these are, by unit, (2, m)."""
    known = np.isfinite(values)
    kept = np.where(known, values, 0.0)
    if units is None:
        return np.stack([kept, known.astype(float)])
    _, place = np.unique(units, return_inverse=True)
    return np.stack([np.bincount(place, kept), np.bincount(place, known)]).astype(float)


def differences(cells: Sequence[CellRows], base: CellRows, figures: Sequence[str]) -> list[dict[str, Difference]]:
    """cell - base for every cell over the common seeds, the p-values without correction."""
    changes: list[Array] = []  # of every cell, of every figure
    sums: list[Array] = []
    costs: list[Array] = []
    for cell in cells:
        here, there = common(cell, base)
        units = cell.units_of(here)
        for figure in figures:
            own, others = cell.values(figure)[here], base.values(figure)[there]
            changes.append(own - others)
            sums.append(by_unit(changes[-1], units))
            costs.append(_costs(own, others, units) if is_cost(figure) else np.empty((2, 0)))
    intervals = iter(_by_length(sums, _ratios))
    flipped = iter(_by_length(sums, _p_values))
    quotients = iter(_by_length(costs, _ratios))
    following = iter(zip(changes, costs, strict=True))

    def one(cell: CellRows, figure: str) -> Difference:
        change, cost = next(following)
        p, quotient = next(flipped), next(quotients)
        if is_rate(figure) and p is not None and cell.units is None:
            p = mcnemar(int((change > 0).sum()), int((change < 0).sum()))
        estimate = _estimate(change, next(intervals))
        ratio = Estimate(float(np.divide(*cost.sum(axis=1))), quotient, estimate.num) if cost.size else None
        return Difference(estimate, p, ratio)

    return [{figure: one(cell, figure) for figure in figures} for cell in cells]


def _costs(own: Array, others: Array, units: NDArray[np.intp] | None) -> Array:
    """The sums of two methods' costs over their pairs by unit, (2, m); none, (2, 0), where a ratio is undefined."""
    both = np.isfinite(own - others)
    if not both.any() or (own[both] < 0.0).any() or (others[both] <= 0.0).any():
        return np.empty((2, 0))
    return np.stack([by_unit(np.where(both, values, np.nan), units)[0] for values in (own, others)])


def _ratios(num: int) -> Callable[[Array], list[Interval]]:
    """The intervals of sums over sums (F, 2, num)."""
    return lambda rows: bootstrap(num).ratios(rows[:, 0], rows[:, 1])


def _p_values(num: int) -> Callable[[Array], list[float | None]]:
    """The p-values of sums and counts (F, 2, num)."""
    return lambda rows: bootstrap(num).p_values(np.where(rows[:, 1] > 0, rows[:, 0], np.nan))


def _by_length(rows: Sequence[Array], function_for: Callable[[int], Callable[[Array], list[Any]]]) -> list[Any]:
    """An answer for every row (2, m), computed for all rows of one length together; None for an empty row.

    `function_for(m)` is the function that computes them.
    """
    answers: list[Any] = [None] * len(rows)
    for num in {row.shape[1] for row in rows} - {0}:
        places = [i for i, row in enumerate(rows) if row.shape[1] == num]
        for place, answer in zip(places, function_for(num)(np.array([rows[i] for i in places])), strict=True):
            answers[place] = answer
    return answers


def _estimate(values: Array, interval: Interval) -> Estimate:
    known = values[np.isfinite(values)]
    return Estimate(float(known.mean()) if known.size else nan, interval, known.size)
