"""Plans of the oracle and their rollouts against known paths, to find the first plan that touches nothing.

A plan wants one (v, omega) in each of its knots of KNOT seconds, some on a grid and some drawn; the base goes there at
its limits of acceleration. All lie within what the base takes as a command (`motion.unicycle.command_bounds`): it may
stop always, and reverse where its lowest speed is below 0. In this order, which is about that of how often they help:

* one (v, omega) throughout: full braking, constant arcs, turning on the spot, straight back;
* one, then another from 0.5, 1 or 2 s on: brake, then go; swerve and return; back off and wait;
* stop and turn on the spot by one of TURNED, then go on an arc, and after 1 s on another;
* drawn at every knot of 0.5 or 1 s, a third of them at a limit.

In each step of a rollout the base's (v, omega) move towards the wanted ones at its limits of acceleration, and it
drives the arc of their means. People move straight within a step, and so does the robot for the distances: at 1 m/s and
steps of 0.05 s an arc of 1.5 rad/s leaves its chord by 0.5 mm.
"""

from functools import lru_cache
from itertools import product
from math import ceil, radians
from typing import NamedTuple

import numpy as np

from mjnav.compile.compiled import Cube, Matrix, ReadOnlyCube, Vector, exact
from mjnav.geometry.floor import box_distance, point_segment, segment_box
from mjnav.geometry.way_field import WayGrid, way_lookup
from mjnav.messages import Array, RobotLimits
from mjnav.motion.unicycle import arc, command_bounds
from mjnav.rng import stream

# -------------------------------------------------------------------------------------------- plans


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


# ----------------------------------------------------------------------------------------- rollouts


SLACK = 0.2  # [m] by which a way left may change more than the robot drives: two cells of its grid


class Base(NamedTuple):
    """How the base moves."""

    acceleration: float  # [m/s^2]
    turn_acceleration: float  # [rad/s^2]
    max_speed: float  # [m/s] in either direction
    step: float  # [s] of the rollout
    steps_a_knot: int
    steps: int  # of the rollout; a plan that is shorter goes on with its last knot


class Bodies(NamedTuple):
    """What must not be touched. A body that is nearer at the start than its reach is to come no nearer."""

    people: Cube  # (steps + 1, P, 2) [m] centres; NaN where a person is not there
    people_reach: Vector  # (P,) [m] between centres
    discs: Matrix  # (n, 3) x, y, radius [m]
    boxes: Matrix  # (m, 6) as in `geometry.floor.Floor`
    reach: float  # [m] from the robot's centre to a disc's or a box's surface


class Way(NamedTuple):
    """Where the robot goes: on to the point that it makes for, round what stands, and straight along the route then."""

    first: WayGrid  # to the point that the robot makes for
    route: Matrix  # (n, 2) [m] the points from that one to the goal
    behind: Vector  # (n,) [m] of the route behind each point
    tolerance: float  # [m] within which a point is reached; the run ends at the last
    wanted: float  # [m] that may be left after the last step; inf where progress does not matter


@exact
def ramp(value, target, limit, step):
    """Mean and end of a set-point on its way to `target` at the limit, as `motion.unicycle.ramp_mean`."""
    change = min(max(target - value, -limit * step), limit * step)
    end = value + change
    return end - 0.5 * change * (abs(change) / limit) / step, end


@exact
def _way_left(way, target, x, y):
    """From (x, y) to the goal, for a robot that makes for point `target` of the route [m]."""
    if target == 0:
        left, _, _ = way_lookup(way.first, x, y)
        return left + way.behind[0]
    dx, dy = way.route[target, 0] - x, way.route[target, 1] - y
    return np.sqrt(dx * dx + dy * dy) + way.behind[target]


@exact
def _touches_person(people, reach, k, p, x0, y0, x1, y1):
    """Whether robot and person p touch in step k: 0 no, 1 yes, 2 as the person is put where the robot is."""
    bx, by = people[k + 1, p, 0] - x1, people[k + 1, p, 1] - y1
    if np.isnan(bx):
        return 0
    ax, ay = people[k, p, 0] - x0, people[k, p, 1] - y0
    if np.isnan(ax):
        return 2 if bx * bx + by * by < reach[p] * reach[p] else 0
    return 1 if point_segment(0.0, 0.0, ax, ay, bx, by) < reach[p] else 0


@exact
def first_clear(pose: Vector, twist: Vector, plans: ReadOnlyCube, base: Base, bodies: Bodies, way: Way):
    """The first of `plans` (K, knots, 2) that touches nothing and gets as far as wanted; -1 where none does.

    `pose` (3,) and `twist` (2,) are the robot's true ones at the start. A person who comes in where the robot is counts
    only once they have been apart: in the world newcomers wait.
    """
    num_people, num_points = bodies.people.shape[1], len(way.route)
    people_reach = bodies.people_reach.copy()
    for p in range(num_people):
        dx, dy = bodies.people[0, p, 0] - pose[0], bodies.people[0, p, 1] - pose[1]
        if not np.isnan(dx):
            people_reach[p] = min(people_reach[p], np.sqrt(dx * dx + dy * dy) - 1e-9)
    disc_reach, box_reach = np.empty(len(bodies.discs)), np.empty(len(bodies.boxes))
    for j in range(len(bodies.discs)):
        dx, dy = bodies.discs[j, 0] - pose[0], bodies.discs[j, 1] - pose[1]
        disc_reach[j] = min(bodies.reach, np.sqrt(dx * dx + dy * dy) - bodies.discs[j, 2] - 1e-9)
    for j in range(len(bodies.boxes)):
        box_reach[j] = min(bodies.reach, box_distance(pose[0], pose[1], bodies.boxes[j]) - 1e-9)
    waits = np.empty(num_people, np.bool_)  # newcomers who have not been apart from the robot yet
    for plan in range(len(plans)):
        x, y, heading, v, omega = pose[0], pose[1], pose[2], twist[0], twist[1]
        waits[:] = False
        target, clear, arrived = 0, True, False
        for k in range(base.steps):
            knot = min(k // base.steps_a_knot, plans.shape[1] - 1)
            mean_v, v = ramp(v, plans[plan, knot, 0], base.acceleration, base.step)
            mean_omega, omega = ramp(omega, plans[plan, knot, 1], base.turn_acceleration, base.step)
            to_x, to_y, heading = arc(x, y, heading, mean_v, mean_omega, base.step)
            for p in range(num_people):
                touch = _touches_person(bodies.people, people_reach, k, p, x, y, to_x, to_y)
                if touch == 2:
                    waits[p] = True
                elif touch == 0:
                    waits[p] = False
                elif not waits[p]:
                    clear = False
                    break
            for j in range(len(bodies.discs) if clear else 0):
                near = point_segment(bodies.discs[j, 0], bodies.discs[j, 1], x, y, to_x, to_y) - bodies.discs[j, 2]
                if near < disc_reach[j]:
                    clear = False
                    break
            for j in range(len(bodies.boxes) if clear else 0):
                # A step moves less than this, so that most boxes cost one distance.
                room = box_distance(to_x, to_y, bodies.boxes[j]) - abs(mean_v) * base.step
                if room < box_reach[j] and segment_box(x, y, to_x, to_y, bodies.boxes[j]) < box_reach[j]:
                    clear = False
                    break
            if not clear:
                break
            x, y = to_x, to_y
            dx, dy = way.route[target, 0] - x, way.route[target, 1] - y
            if dx * dx + dy * dy <= way.tolerance * way.tolerance:
                if target == num_points - 1:
                    arrived = True
                    break
                target += 1
            can_drive = base.max_speed * base.step * (base.steps - 1 - k) + SLACK
            if target == num_points - 1 and _way_left(way, target, x, y) - can_drive > way.wanted:
                clear = False  # too far from the goal to get there in time
                break
        if arrived or (clear and _way_left(way, target, x, y) <= way.wanted):
            return plan
    return -1
