"""Two methods over the same seeds, pair by pair: which did better, where a failure is worse than any success.

The first of these in which the two episodes of a pair differ decides it:

1. contact: who touched a person or a thing loses, whoever moved or was at fault;
2. the goal: who did not reach it in time, or whose run was aborted, loses;
3. of two successes a cost: who took more `time_s` loses, or whatever figure is chosen in its place.

What is equal in all of them is a tie: two collisions, two timeouts, two successes at the same cost. The win ratio is
wins / losses (Pocock, Ariti, Collier & Wang, European Heart Journal 33 (2012) 176, of matched pairs; the hierarchy:
Finkelstein & Schoenfeld, Statistics in Medicine 18 (1999) 1341). With p the share of wins among the pairs that are no
ties, it is p / (1 - p), and its interval is Wilson's of p, so transformed. p-values are of p = 1/2, by the exact
binomial test; where several rows are of one unit of evidence, by flipping the signs of the units' wins - losses.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import inf, nan

import numpy as np
from numpy.typing import NDArray

from mjnav.messages import Array
from mjnav.metrics.intervals import Interval, clustered_wilson, holm, mcnemar
from mjnav.study.compare.cell_rows import CellRows
from mjnav.study.compare.chosen_figures import more_is_better
from mjnav.study.compare.estimates import bootstrap, by_unit, common

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


@dataclass(frozen=True, slots=True)
class Rivals:
    """Two methods of a table, and the win ratio of the first against the second."""

    method: str
    other: str
    ratio: WinRatio


def win_ratio(cell: CellRows, base: CellRows, by: str) -> WinRatio:
    """Of `cell` against `base` over their common seeds that both have a result; the p-value without correction."""
    here, there = common(cell, base)
    scores = _scores(_standing(cell, by)[:, here], _standing(base, by)[:, there])
    units = cell.units_of(here)
    wins, losses, ties = (int((scores == score).sum()) for score in (1.0, -1.0, 0.0))
    won, decided = by_unit(np.where(np.abs(scores) == 1.0, scores > 0.0, np.nan), units)
    share = clustered_wilson(won, decided)
    interval = None if share is None else (_odds(share[0]), _odds(share[1]))
    return WinRatio(wins, losses, ties, interval, _p_value(scores, units))


def win_ratios(cells: Sequence[CellRows], base: CellRows, by: str) -> list[WinRatio]:
    """Of every cell against `base`, with Holm's correction over them."""
    return corrected([win_ratio(cell, base, by) for cell in cells])


def all_rivals(cells: Sequence[CellRows], by: str) -> tuple[Rivals, ...]:
    """Every two cells of a table, the earlier one first, with Holm's correction over all of these pairs."""
    pairs = list(combinations(cells, 2))
    ratios = corrected([win_ratio(cell, other, by) for cell, other in pairs])
    return tuple(Rivals(cell.method, other.method, ratio) for (cell, other), ratio in zip(pairs, ratios, strict=True))


def corrected(ratios: Sequence[WinRatio]) -> list[WinRatio]:
    """The same with Holm's correction over all that have pairs."""
    adjusted = iter(holm([ratio.p for ratio in ratios if ratio.p is not None]))
    return [ratio if ratio.p is None else replace(ratio, p=next(adjusted)) for ratio in ratios]


def _standing(cell: CellRows, by: str) -> Array:
    """How each episode ended, and of successes minus the cost, so that more is better, (2, n); NaN without a result."""
    ended = np.where(cell.columns["success"] == 1, SUCCEEDED, np.where(cell.collided == 1, COLLIDED, NOT_REACHED))
    cost = cell.columns[by]
    return np.stack([np.where(cell.failed, np.nan, ended), cost if more_is_better(by) else -cost])


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
