"""The plans of the oracle: wanted speeds and turn rates over time, some on a grid and some drawn.

A plan wants one (v, omega) in each of its knots of KNOT seconds; the base goes there at its limits of acceleration. All
lie within what the base takes as a command (`motion.diff_drive.command_bounds`): it may stop always, and reverse where
its lowest speed is below 0. In this order, which is about that of how often they help:

* one (v, omega) throughout: full braking, constant arcs, turning on the spot, straight back;
* one, then another from 0.5, 1 or 2 s on: brake, then go; swerve and return; back off and wait;
* stop and turn on the spot by one of TURNED, then go on an arc, and after 1 s on another;
* drawn at every knot of 0.5 or 1 s, a third of them at a limit.
"""

from functools import lru_cache
from itertools import product
from math import ceil, radians

import numpy as np

from mjnav.messages import Array, RobotLimits
from mjnav.motion.diff_drive import command_bounds
from mjnav.rng import stream

HORIZON = 4.0  # [s]
KNOT = 0.5  # [s]
KNOTS = round(HORIZON / KNOT)
SPEEDS, TURNS = (1.0, 0.75, 0.5, 0.25, 0.0), (0.0, 0.15, -0.15, 0.3, -0.3, 0.6, -0.6, 1.0, -1.0)  # shares of a limit
FEW_SPEEDS, FEW_TURNS = (1.0, 0.5, 0.0), (0.0, 0.5, -0.5, 1.0, -1.0)
SWITCHES = (1, 2, 4)  # knots after which the second (v, omega) begins
TURNED = tuple(radians(angle) for angle in range(-150, 181, 30) if angle)
ARCS = (0.0, 0.4, -0.4, 0.8, -0.8)  # shares of the highest turn rate
ARC_KNOTS = 2
DRAWN = 1500
BEYOND = 0.25  # of the range that is drawn from lies beyond either limit, where it is clipped
SEED, CHANNEL = 0, "oracle.plans"  # of the stream: the same plans for every log


@lru_cache(maxsize=8)
def plans(limits: RobotLimits) -> Array:
    """The wanted (v, omega) of every plan in every knot, (K, KNOTS, 2) [m/s, rad/s], read-only."""
    low, high = command_bounds(limits)
    speeds, few_speeds = (
        list(dict.fromkeys([*(share * high[0] for share in shares), low[0]])) for shares in (SPEEDS, FEW_SPEEDS)
    )
    turns, few_turns = ([share * high[1] for share in shares] for shares in (TURNS, FEW_TURNS))
    held = np.repeat(np.array([(0.0, 0.0), *product(speeds, turns)])[:, None], KNOTS, axis=1)
    few = np.array(list(product(few_speeds, few_turns)))
    one, other = (few[k.ravel()] for k in np.mgrid[: len(few), : len(few)])
    switched = [np.where(np.arange(KNOTS)[None, :, None] < switch, one[:, None], other[:, None]) for switch in SWITCHES]
    turned = [plan for angle in TURNED for plan in _turned(angle, [high[0], 0.5 * high[0]], high[1])]
    uniform = stream(SEED, CHANNEL).random((DRAWN, KNOTS, 2))
    uniform[::2] = uniform[::2, np.arange(KNOTS) // 2 * 2]  # every other plan changes only each second knot
    share = np.clip((1.0 + 2.0 * BEYOND) * uniform - BEYOND, 0.0, 1.0)
    found = np.concatenate([held, *switched, np.array(turned), low + share * (high - low)])
    found.flags.writeable = False
    return found


def _turned(angle: float, speeds: list[float], max_turn_rate: float) -> list[Array]:
    """Plans that turn by `angle` [rad] on the spot and go on.

    A turn rate that is wanted for n knots, and 0 after that, turns by itself times n KNOT, whatever its ramps take.
    """
    knots = min(ceil(abs(angle) / (max_turn_rate * KNOT)), KNOTS)
    rate = min(max(angle / (knots * KNOT), -max_turn_rate), max_turn_rate)  # a slow base turns less far
    turn = np.tile([0.0, rate], (knots, 1))
    found = []
    for pause, speed, first, second in product((0, 1), speeds, ARCS, ARCS):
        arcs = [*[(speed, first * max_turn_rate)] * ARC_KNOTS, *[(speed, second * max_turn_rate)] * KNOTS]
        found.append(np.concatenate([turn, np.zeros((pause, 2)), arcs])[:KNOTS])
    return found
