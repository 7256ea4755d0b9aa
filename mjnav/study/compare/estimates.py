"""Rates and means of cells with their intervals, and paired differences of two cells."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjnav.messages import Array
from mjnav.metrics.intervals import Interval, SharedBootstrap, mcnemar, wilson
from mjnav.rng import stream
from mjnav.study.compare.cell_rows import CellRows
from mjnav.study.compare.chosen_figures import is_rate

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


@lru_cache(8)
def bootstrap(num: int) -> SharedBootstrap:
    """The bootstrap that all figures of `num` seeds share."""
    return SharedBootstrap(num, stream(0, "compare.bootstrap"), resamples=RESAMPLES)


def estimate(cell: CellRows, figure: str) -> Estimate:
    """A rate or a mean of one cell."""
    return estimates([cell], [figure])[0][figure]


def estimates(cells: Sequence[CellRows], figures: Sequence[str]) -> list[dict[str, Estimate]]:
    """Rates and means of every cell."""
    means = [cell.values(figure) for cell in cells for figure in figures if not is_rate(figure)]
    intervals = iter(_by_length(means, lambda num: bootstrap(num).intervals))

    def one(values: Array, figure: str) -> Estimate:
        if not is_rate(figure):
            return _estimate(values, next(intervals))
        known = values[np.isfinite(values)]
        return _estimate(values, wilson(int(known.sum()), known.size))

    return [{figure: one(cell.values(figure), figure) for figure in figures} for cell in cells]


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


def differences(cells: Sequence[CellRows], base: CellRows, figures: Sequence[str]) -> list[dict[str, Difference]]:
    """cell - base for every cell over the common seeds, the p-values without correction."""
    changes: list[Array] = []
    for cell in cells:
        here, there = common(cell, base)
        changes += [cell.values(figure)[here] - base.values(figure)[there] for figure in figures]
    intervals = iter(_by_length(changes, lambda num: bootstrap(num).intervals))
    flipped = iter(_by_length(changes, lambda num: bootstrap(num).p_values))
    following = iter(changes)

    def one(change: Array, figure: str) -> Difference:
        p = next(flipped)
        if is_rate(figure) and p is not None:
            p = mcnemar(int((change > 0).sum()), int((change < 0).sum()))
        return Difference(_estimate(change, next(intervals)), p)

    return [{figure: one(next(following), figure) for figure in figures} for _ in cells]


def _by_length(rows: Sequence[Array], function_for: Callable[[int], Callable[[Array], list[Any]]]) -> list[Any]:
    """An answer for every row, computed for all rows of one length (F, n) together; None for an empty row.

    `function_for(n)` is the function that computes them.
    """
    answers: list[Any] = [None] * len(rows)
    for num in {len(row) for row in rows} - {0}:
        places = [i for i, row in enumerate(rows) if len(row) == num]
        for place, answer in zip(places, function_for(num)(np.array([rows[i] for i in places])), strict=True):
            answers[place] = answer
    return answers


def _estimate(values: Array, interval: Interval) -> Estimate:
    known = values[np.isfinite(values)]
    return Estimate(float(known.mean()) if known.size else nan, interval, known.size)
