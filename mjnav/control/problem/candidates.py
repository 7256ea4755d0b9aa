"""The candidate controls: a grid over what the robot can reach, then keep and brake (Nair et al., algorithm 1)."""

from dataclasses import dataclass

import numpy as np

from mjnav.messages import Array, RobotLimits
from mjnav.motion.diff_drive import control_bounds, reachable


@dataclass(frozen=True, slots=True)
class Candidates:
    """K controls; the last two are keep and brake."""

    v: Array  # (K,) [m/s]
    omega: Array  # (K,) [rad/s]


def candidate_grid(
    twist: Array, limits: RobotLimits, period: float, num_v: int, num_omega: int, window: str
) -> Candidates:
    """num_v x num_omega controls, ends included, over what can be reached from `twist` in one period; keep; brake.

    `window` "bounds" takes the whole range between the limits instead. Keep is `twist` brought within the limits;
    brake goes as far towards (0, 0) as one period allows.
    """
    low, high = reachable(twist, limits, period)
    keep = np.minimum(np.maximum(twist, low), high)
    brake = np.minimum(np.maximum(0.0, low), high)
    if window == "bounds":
        low, high = control_bounds(limits)
    v, omega = np.empty(num_v * num_omega + 2), np.empty(num_v * num_omega + 2)
    v[:-2].reshape(num_v, num_omega)[:] = _between(low[0], high[0], num_v)[:, None]
    omega[:-2].reshape(num_v, num_omega)[:] = _between(low[1], high[1], num_omega)
    v[-2], omega[-2] = keep
    v[-1], omega[-1] = brake
    return Candidates(v, omega)


def _between(low: float, high: float, num: int) -> Array:
    """`num` values from low to high, ends included and exact; the low end where there is one."""
    share = np.arange(num) / max(num - 1, 1)
    return low * (1.0 - share) + high * share
