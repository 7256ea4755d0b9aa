"""Statistics of cells of results: rates and means with intervals, paired differences, and win ratios of two methods.

What is drawn with replacement, and whose signs are flipped, are the units of evidence: the rows, or the layouts where
`CellRows.units` says that several rows are of one.

A win ratio compares two methods over the same seeds, pair by pair: which did better, where a failure is worse than any
success. The first of these criteria in which the two episodes of a pair differ decides the pair:

1. contact: the episode in which the robot touched a person or a thing loses, no matter who moved or was at fault;
2. the goal: the episode that did not reach it in time, or was aborted, loses;
3. of two successes a cost: the episode with more `time_s` loses; another figure may be chosen in its place.

What is equal in all of them is a tie: two collisions, two timeouts, two successes at the same cost. The win ratio is
wins / losses (Pocock, Ariti, Collier & Wang, European Heart Journal 33 (2012) 176, of matched pairs; the hierarchy:
Finkelstein & Schoenfeld, Statistics in Medicine 18 (1999) 1341). With p the share of wins among the pairs that are no
ties, it is p / (1 - p), and its interval is Wilson's of p, so transformed. p-values are of p = 1/2, by the exact
binomial test; where several rows are of one unit of evidence, by flipping the signs of the units' wins - losses.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations
from math import inf, nan
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from mjnav.messages import Array
from mjnav.metrics.intervals import Interval, SharedBootstrap, clustered_wilson, holm, mcnemar, wilson
from mjnav.rng import stream
from mjnav.study.compare.cell_rows import WIN_BY, CellRows, is_cost, is_rate

# ----------------------------------------------------------------------- rates, means and differences


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
    pairs = [(cell, *common(cell, base)) for cell in cells]
    values = [
        (cell.values(figure)[here], base.values(figure)[there]) for cell, here, there in pairs for figure in figures
    ]
    units = [cell.units_of(here) for cell, here, _ in pairs for _ in figures]
    sums = [by_unit(own - others, unit) for (own, others), unit in zip(values, units, strict=True)]
    costs = [
        _costs(*pair, unit) if is_cost(figure) else np.empty((2, 0))
        for pair, unit, figure in zip(values, units, [*figures] * len(pairs), strict=True)
    ]
    rates = [is_rate(figure) for figure in figures] * len(pairs)
    nothing = np.empty((2, 0))
    of_means = _by_length([nothing if rate else row for row, rate in zip(sums, rates, strict=True)], _ratios)
    of_rates = _by_length([row if rate else nothing for row, rate in zip(sums, rates, strict=True)], _rate_changes)
    intervals = [of_rates[i] if rate else of_means[i] for i, rate in enumerate(rates)]
    computed = zip(values, costs, intervals, _by_length(sums, _p_values), _by_length(costs, _ratios), strict=True)

    def one(cell: CellRows, figure: str) -> Difference:
        (own, others), cost, interval, p, quotient = next(computed)
        change = own - others
        if is_rate(figure) and p is not None and cell.units is None:
            p = mcnemar(int((change > 0).sum()), int((change < 0).sum()))
        estimate = _estimate(change, interval)
        ratio = Estimate(float(np.divide(*cost.sum(axis=1))), quotient, estimate.num) if cost.size else None
        return Difference(estimate, p, ratio)

    return [{figure: one(cell, figure) for figure in figures} for cell in cells]


ROUNDING = 1e-9  # of a cost: below, it is one of rounding, as the control cost of a command that never changes


def _costs(own: Array, others: Array, units: NDArray[np.intp] | None) -> Array:
    """The sums of two methods' costs over their pairs by unit, (2, m); none, (2, 0), where a ratio is undefined."""
    both = np.isfinite(own - others)
    if not both.any() or (own[both] < 0.0).any() or (others[both] <= ROUNDING).any():
        return np.empty((2, 0))
    return np.stack([by_unit(np.where(both, values, np.nan), units)[0] for values in (own, others)])


def _ratios(num: int) -> Callable[[Array], list[Interval]]:
    """The intervals of sums over sums (F, 2, num)."""
    return lambda rows: bootstrap(num).ratios(rows[:, 0], rows[:, 1])


def _rate_changes(num: int) -> Callable[[Array], list[Interval]]:
    """The same of differences of rates."""
    return lambda rows: bootstrap(num).ratios(rows[:, 0], rows[:, 1], studentised=False)


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


# ----------------------------------------------------------------------------------------- win ratios


COLLIDED, NOT_REACHED, SUCCEEDED = 0.0, 1.0, 2.0


@dataclass(frozen=True, slots=True)
class WinRatio:
    """How often one method did better than another: wins, losses, and the interval of their ratio.

    The interval ends at infinity where there is no loss, and is None where all pairs are ties.
    """

    wins: int
    losses: int
    ties: int
    interval: Interval
    p: float | None  # with Holm's correction, once there are others; None without pairs

    @property
    def value(self) -> float:
        """Wins over losses; infinite without a loss, NaN where all pairs are ties."""
        if self.losses:
            return self.wins / self.losses
        return inf if self.wins else nan

    @property
    def share(self) -> float:
        """Wins among the pairs that are no ties; NaN where all are."""
        decided = self.wins + self.losses
        return self.wins / decided if decided else nan

    @property
    def pairs(self) -> int:
        """All of them, ties included."""
        return self.wins + self.losses + self.ties

    @property
    def inverse(self) -> "WinRatio":
        """The same of the other method against this one."""
        ends = None if self.interval is None else (_inverse(self.interval[1]), _inverse(self.interval[0]))
        return WinRatio(self.losses, self.wins, self.ties, ends, self.p)


Test = TypeVar("Test", Difference, WinRatio)


@dataclass(frozen=True, slots=True)
class Rivals:
    """Two methods of a table, and the win ratio of the first against the second."""

    method: str
    other: str
    ratio: WinRatio


def win_ratio(cell: CellRows, base: CellRows) -> WinRatio:
    """Of `cell` against `base` over their common seeds that both have a result; the p-value without correction."""
    here, there = common(cell, base)
    scores = _scores(_standing(cell)[:, here], _standing(base)[:, there])
    units = cell.units_of(here)
    wins, losses, ties = (int((scores == score).sum()) for score in (1.0, -1.0, 0.0))
    won, decided = by_unit(np.where(np.abs(scores) == 1.0, scores > 0.0, np.nan), units)
    share = clustered_wilson(won, decided)
    interval = None if share is None else (_odds(share[0]), _odds(share[1]))
    return WinRatio(wins, losses, ties, interval, _p_value(scores, units))


def all_rivals(cells: Sequence[CellRows]) -> tuple[Rivals, ...]:
    """Every two cells of a table, the earlier one first, with Holm's correction over all of these pairs."""
    pairs = list(combinations(cells, 2))
    ratios = corrected([win_ratio(cell, other) for cell, other in pairs])
    return tuple(Rivals(cell.method, other.method, ratio) for (cell, other), ratio in zip(pairs, ratios, strict=True))


def corrected(tests: Sequence[Test]) -> list[Test]:
    """Differences or win ratios with Holm's correction over all that have a p-value."""
    adjusted = iter(holm([test.p for test in tests if test.p is not None]))
    return [test if test.p is None else replace(test, p=next(adjusted)) for test in tests]


def _standing(cell: CellRows) -> Array:
    """How each episode ended, and of successes minus the cost, so that more is better, (2, n); NaN without a result."""
    ended = np.where(cell.columns["success"] == 1, SUCCEEDED, np.where(cell.collided == 1, COLLIDED, NOT_REACHED))
    return np.stack([np.where(cell.failed, np.nan, ended), -cell.columns[WIN_BY]])


def _scores(own: Array, others: Array) -> Array:
    """1 of a pair that the first won, -1 of one that it lost, 0 of a tie, (n,); NaN where an episode has no result."""
    ended = np.sign(own[0] - others[0])
    cost = np.nan_to_num(np.sign(own[1] - others[1]))
    return np.where((ended == 0.0) & (own[0] == SUCCEEDED), cost, ended)


def _p_value(scores: Array, units: NDArray[np.intp] | None) -> float | None:
    if not np.isfinite(scores).any():
        return None
    if units is None:
        return mcnemar(int((scores > 0).sum()), int((scores < 0).sum()))
    net = by_unit(scores, units)[0]
    return bootstrap(len(net)).p_values(net[None])[0]


def _odds(share: float) -> float:
    return share / (1.0 - share) if share < 1.0 else inf


def _inverse(ratio: float) -> float:
    return 1.0 / ratio if ratio else inf
