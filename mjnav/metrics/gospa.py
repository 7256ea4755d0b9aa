"""GOSPA: how far the tracks are from the people, with who was missed and what nobody is.

Of the people X = {x_1 .. x_n} and the tracks Y = {y_1 .. y_m} of one tick, with the cut-off c, alpha = 2 and p = 2:

    GOSPA^2 = min over pairs g  sum_(i,j) in g |x_i - y_j|^2  +  c^2/2 (n - |g|)  +  c^2/2 (m - |g|)
                                localisation                    missed             false

over all sets g of pairs in which each point is at most once. A pair costs no more than a person missed and a false
track, c^2 in all, so only points nearer than c are paired. Source: Rahmathullah, Garcia-Fernandez & Svensson,
"Generalized optimal sub-pattern assignment metric" (FUSION 2017), proposition 1.
"""

from dataclasses import dataclass
from math import sqrt

import numpy as np

from mjnav.geometry.assignment import GATE
from mjnav.messages import Array, Trajectory
from mjnav.metrics.tracked import tracked_blocks
from mjnav.scenarios.spec import Scenario

CUTOFF = GATE  # [m], c: farther away a track is of no use to who has to avoid the person


@dataclass(frozen=True, slots=True)
class Gospa:
    """Roots of the means of the squares over ticks [m]: total^2 = localization^2 + missed^2 + false^2."""

    total: float
    localization: float
    missed: float
    false: float


def gospa(trajectory: Trajectory, scenario: Scenario) -> Gospa | None:
    """Of all ticks with a belief; None without any, and in scenes without people."""
    if not scenario.people:
        return None
    total, ticks = np.zeros(3), 0
    for block in tracked_blocks(trajectory, scenario):
        believed = np.isfinite(trajectory.estimate[block.start : block.start + len(block.people), 0])
        total += gospa_squared(block.people[believed], block.tracks[believed]).sum(axis=0)
        ticks += int(believed.sum())
    if not ticks:
        return None
    localization, missed, false = (total / ticks).tolist()
    return Gospa(sqrt(localization + missed + false), sqrt(localization), sqrt(missed), sqrt(false))


def gospa_squared(people: Array, tracks: Array, cutoff: float = CUTOFF) -> Array:
    """The parts localisation, missed and false of GOSPA^2 at each tick, (t, 3) [m^2].

    Of people (t, n, 2) and tracks (t, m, 2) [m]; those that are NaN are not there.
    """
    from scipy.optimize import linear_sum_assignment

    num_people, num_tracks = (np.isfinite(points[..., 0]).sum(axis=1) for points in (people, tracks))
    squared = ((people[:, :, None] - tracks[:, None]) ** 2).sum(axis=-1)  # (t, n, m)
    limit = cutoff**2
    near = squared < limit
    cost = np.where(near, squared, 0.0).sum(axis=(1, 2))
    pairs = near.sum(axis=(1, 2))
    # Where no point has two others near it, all who are near are pairs.
    for k in np.flatnonzero((near.sum(axis=1) > 1).any(axis=1) | (near.sum(axis=2) > 1).any(axis=1)).tolist():
        bounded = np.where(near[k], squared[k], limit)
        chosen = linear_sum_assignment(bounded)
        paired = near[k][chosen]
        cost[k], pairs[k] = bounded[chosen][paired].sum(), paired.sum()
    return np.column_stack([cost, 0.5 * limit * (num_people - pairs), 0.5 * limit * (num_tracks - pairs)])
