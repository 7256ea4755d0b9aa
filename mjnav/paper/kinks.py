"""Where a cost over omega has kinks, told from what is only strongly curved.

Along a cut of constant v, the slope from one step of h to the next changes by h c'' where the cost is smooth, and by
what the kink is worth, whatever h, where it has one. The segment form itself has none: where t* reaches 0 or the
horizon, f is stationary in t, so its slope goes on. max(f, -clip) and max(0, f) have one for every pair of samples.
"""

from collections.abc import Callable

import numpy as np

from mjnav.messages import Array
from mjnav.paper.continuous_cost import ContinuousCost

CHUNK = 400  # controls a call, which the kernel is made for


def along_omega(cost: Callable[[Array, Array], Array], v: float, omega: Array) -> Array:
    """The cost at one v and many omega (n,)."""
    parts = np.array_split(omega, -(-omega.size // CHUNK))
    return np.concatenate([cost(np.full(part.size, v), part) for part in parts])


def slopes(
    cost: Callable[[Array, Array], Array], v: float, low: float, high: float, step: float
) -> tuple[Array, Array]:
    """Slopes [1/(rad/s)] from one step to the next and the omega in their middle, (n,) each."""
    omega = np.linspace(low, high, round((high - low) / step) + 1)
    slope = np.diff(along_omega(cost, v, omega)) / np.diff(omega)
    return 0.5 * (omega[1:] + omega[:-1]), slope


def slope_jump(cost: Callable[[Array, Array], Array], v: float, low: float, high: float, step: float) -> float:
    """The largest change of the slope from one step to the next, as a share of the range of slopes; 0 on a plane."""
    _, slope = slopes(cost, v, low, high, step)
    span = np.ptp(slope)
    return float(np.abs(np.diff(slope)).max() / span) if span > 0.0 else 0.0


def clip_places(cost: ContinuousCost, v: float, omega: Array) -> Array:
    """The omega at which a pair of samples meets the clip or leaves it, between those given (n,); sorted."""
    floor = -cost.controller.parameters.clip
    found = []
    for block in range(len(cost.problem.cone.blocks.column)):
        clipped = cost.problem.cone.samples(block, np.full(omega.size, v), omega) <= floor  # (pairs, n)
        _, at = np.nonzero(clipped[:, 1:] != clipped[:, :-1])
        found.append(0.5 * (omega[at] + omega[at + 1]))
    return np.sort(np.concatenate(found)) if found else np.zeros(0)
