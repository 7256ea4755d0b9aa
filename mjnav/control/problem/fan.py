"""The rollouts that a planner weighs, and the message that shows its plan and some of them in a log.

A rollout is a first move, a second one, and then the way to the goal. First moves are a grid of controls that are held
for a while, and the control that the robot has; behind each of them come the same second moves, also none. Rollouts
of one first move stand together. Behind them come standing still, and the way to the goal alone.
"""

from functools import lru_cache
from itertools import product
from math import inf

import numpy as np
from numpy.typing import NDArray

from mjnav.control.kernels.guides import lead
from mjnav.control.rollouts import ControlLimits, Rollouts
from mjnav.geometry.way_field import WayGrid
from mjnav.messages import Array, PlanShown, RobotLimits

FAN = 32  # rollouts shown, at most
NO_VIOLATION = np.zeros(0)  # of a method that has none


def shown_plan(
    rollouts: Rollouts, cost: Array, followed: Rollouts, position: Array, *, feasible: bool, violation: Array
) -> PlanShown:
    """The message of a plan, `followed`, the first of its rollouts, from `position` (2,) [m].

    The fan are FAN of the K `rollouts`, evenly over the order of their `cost` (K,), cheapest first; `violation` (S,) is
    the plan's.
    """
    shown = np.argsort(cost, kind="stable")[_evenly(cost.size)]
    path, fan = np.empty((len(rollouts.x), 2)), np.empty((len(shown), len(rollouts.x), 2))
    for c, (along, all_along) in enumerate(((followed.x, rollouts.x), (followed.y, rollouts.y))):
        np.add(along[:, 0], position[c], out=path[:, c])
        np.add(all_along[:, shown].T, position[c], out=fan[:, :, c])
    return PlanShown(
        step=followed.step,
        path=path,
        fan=fan,
        fan_cost=cost[shown],
        violation=violation,
        feasible=feasible,
    )


@lru_cache
def _evenly(num: int) -> NDArray[np.int64]:
    """Up to FAN places from the first to the last of `num`."""
    return np.linspace(0, num - 1, min(FAN, num)).astype(int)


# Second moves: share of the preferred speed, share of the highest turn rate, and how long [s].
SECOND = np.array([(0.0, 0.0, 0.0), *product((0.5, 1.0), (-1.0, -0.5, 0.0, 0.5, 1.0), (0.8, 2.0))])
SECOND.flags.writeable = False
ALONE = 2  # rollouts without a first move: standing still, and the way to the goal, which is the last


def num_rollouts(num_speeds: int, num_turn_rates: int, *, reverses: bool) -> int:
    """How many rollouts there are; a robot that `reverses` has one speed more."""
    return ((num_speeds + reverses) * num_turn_rates + 1) * len(SECOND) + ALONE


def moves(limits: RobotLimits, twist: Array, speed: float, num_speeds: int, num_turn_rates: int, hold: float) -> Array:
    """All rollouts as `kernels.guides.lead` takes them, (K, 6): two moves, each v, omega, and until when [s].

    The first moves, held for `hold` [s], are speeds from 0 to `speed` [m/s], and backwards where the robot can, each
    with turn rates between both limits; and the robot's `twist` (2,).
    """
    turn, back = limits.max_turn_rate, min(speed, max(-limits.min_speed, 0.0))
    speeds = [*([-back] if back else []), *np.linspace(0.0, speed, num_speeds)]
    first = np.array([*product(speeds, np.linspace(-turn, turn, num_turn_rates)), tuple(twist)])
    rows = np.zeros((len(first) * len(SECOND) + ALONE, 6))
    rows[-ALONE, 2] = inf
    pairs = by_first_move(rows)  # a view
    pairs[:, :, :2], pairs[:, :, 2] = first[:, None], hold
    pairs[:, :, 3:] = SECOND * (speed, turn, 1.0) + (0.0, 0.0, hold)
    return rows


def by_first_move(rows: Array) -> Array:
    """What all rollouts have, (K, ...), but for those without a first move: (first moves, second moves, ...)."""
    return rows[:-ALONE].reshape(-1, len(SECOND), *rows.shape[1:])


def led(
    rows: Array, pose: Array, way: WayGrid, limits: ControlLimits, speed: float, approach_time: float, preview: float,
    step: float, steps: int,
) -> Rollouts:  # fmt: skip
    """The rollouts of moves (K, 6) from a pose (3,) in the world, and then of the way at `speed` [m/s]."""
    v, omega, x, y, heading, cos, sin = out = np.empty((7, steps, len(rows)))
    lead(
        v, omega, x, y, heading, cos, sin, rows, pose, way, limits.first, limits.all, limits.change, speed,
        approach_time, preview, step,
    )  # fmt: skip
    return Rollouts(out[:2], x, y, heading, out[5:], step)
