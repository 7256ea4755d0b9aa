"""Whether what went wrong in a run could have been avoided: an oracle that knows the true paths of all people.

The oracle knows where everybody truly was, what stands, and where the robot was to go. It drives some thousands of
plans from the robot's true pose and twist, within the robot's limits and without noise, delay or a margin, among what
stands and the people as they walked in the run.

* A collision (the run's first contact) was avoidable 2 s or 1 s before if one of the plans from then touches nothing
  until AFTER_CONTACT behind it, or reaches the goal. From the contact on, which ends most runs, people are taken to
  walk straight on as they did at the last state before it.
* The robot is at rest where `stalled_s` counts it: slower than 0.1 m/s. It has a way free there if a plan of HORIZON
  keeps CLEARANCE from everything and ends PROGRESS nearer to the goal, along the route and round what stands, or at
  the goal.
* A time-out was avoidable if the robot stood with a way free for at least as long as the way that was left at the end
  takes at the preferred speed: had it used that time, it would have arrived. A robot that creeps or drives back and
  forth until the end is not detected by this.

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

What it cannot say: people are taken to walk as they did, whatever the robot does. Someone who gave way to the robot
would not have had to, and someone who would give way to a plan does not. A plan that is not sampled may avoid what no
sampled one does. And a robot that sees through noise cannot know which plan it is: "avoidable" says that the robot
lacked knowledge at that moment, not the power to avoid; "not avoidable", that the cause lies further back.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from math import ceil, radians
from typing import NamedTuple

import numpy as np

from mjnav.compile.compiled import Cube, Matrix, ReadOnlyCube, Vector, exact
from mjnav.geometry.floor import box_distance, point_segment, segment_box
from mjnav.geometry.way_field import WayField, WayGrid, way_lookup
from mjnav.messages import Array, Contact, RobotLimits, Trajectory
from mjnav.metrics.effort import STALLED_SPEED, stalled_time
from mjnav.metrics.ending import TIMEOUTS
from mjnav.metrics.progress import legs_behind, targets
from mjnav.metrics.safety import Touch, beginnings, touches
from mjnav.metrics.social import radii
from mjnav.motion.unicycle import arc, command_bounds
from mjnav.rng import stream
from mjnav.scene.spec import Scenario
from mjnav.scene.ways import floor_of_robot

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


# ---------------------------------------------------------------------------- what the oracle knows


STEP = 0.05  # [s] of the rollouts


class Foreknown:
    """A trajectory and its scenario; `first_clear_plan` asks."""

    def __init__(self, trajectory: Trajectory, scenario: Scenario):
        self.trajectory, self.scenario = trajectory, scenario
        self._floor = floor_of_robot(scenario.walls, scenario.tables, scenario.pillars)
        self._targets = targets(trajectory, scenario)  # (T + 1,)
        self._radii = radii(trajectory, scenario)  # (T + 1, P) [m]
        self._fields: dict[int, WayField] = {}  # by point of the route, once asked for

    def first_clear_plan(
        self,
        row: int,
        duration: float,
        *,
        until: int | None = None,
        clearance: float = 0.0,
        progress: float | None = None,
    ) -> int | None:
        """The first of `plans` from the true state of `row` that touches nothing for `duration` [s]; None without one.

        It keeps `clearance` [m] from everything, or the distance that there is at the start, and ends `progress` [m]
        nearer to the goal, by `way_left`, or at the goal; with None it may end anywhere. People go on as recorded
        to the state `until` (the last by default), then straight on at the velocity that they had there.
        """
        limits, steps = self.scenario.robot.limits, round(duration / STEP)
        pose, twist = self.trajectory.robot_pose[row], self.trajectory.robot_twist[row]
        fastest = max(limits.max_speed, -limits.min_speed, abs(float(twist[0])))
        knot = round(KNOT / STEP)
        base = Base(limits.max_acceleration, limits.max_turn_acceleration, fastest, STEP, knot, steps)
        times = np.linspace(0.0, steps * STEP, steps + 1) + float(self.trajectory.time[row])
        bodies = self._near(row, fastest * duration, true_paths(self.trajectory, times, until), clearance)
        found = first_clear(pose.copy(), twist.copy(), plans(limits), base, bodies, self._way(row, progress))
        return None if found < 0 else int(found)

    def way_left(self, row: int) -> float:
        """From the robot's place at a state round what stands to the point it makes for, and on along the route [m]."""
        left = self._field(row).way_left(self.trajectory.robot_pose[row, :2])[0]
        return float(left + legs_behind(self.scenario)[self._targets[row]])

    def _field(self, row: int) -> WayField:
        target, robot = int(self._targets[row]), self.scenario.robot
        if target not in self._fields:
            places = self.trajectory.robot_pose[:, :2]
            self._fields[target] = WayField.of(self._floor, robot.route[target], robot.radius, places)
        return self._fields[target]

    def _way(self, row: int, progress: float | None) -> Way:
        robot, target = self.scenario.robot, int(self._targets[row])
        wanted = np.inf if progress is None else self.way_left(row) - progress
        route, behind = np.array(robot.route)[target:], legs_behind(self.scenario)[target:]
        return Way(self._field(row).grid, route, behind, robot.goal_tolerance, wanted)

    def _near(self, row: int, reach: float, people: Array, clearance: float) -> Bodies:
        """All bodies that the robot can meet within `reach` [m] of where it is at a state."""
        pose, apart = self.trajectory.robot_pose[row], self._radii[row] + clearance
        own = self.scenario.robot.radius + clearance
        gaps = np.hypot(*np.moveaxis(people - pose[:2], -1, 0))  # (steps + 1, P)
        met = (np.where(np.isnan(gaps), np.inf, gaps) <= apart + reach).any(axis=0)
        discs, boxes = self._floor.discs, self._floor.boxes
        to_discs = np.hypot(*(discs[:, :2] - pose[:2]).T) - discs[:, 2]
        to_boxes = np.hypot(*(boxes[:, :2] - pose[:2]).T) - np.hypot(*boxes[:, 4:].T)
        return Bodies(
            np.ascontiguousarray(people[:, met]), apart[met], discs[to_discs <= own + reach],
            boxes[to_boxes <= own + reach], own,
        )  # fmt: skip


def true_paths(trajectory: Trajectory, times: Array, until: int | None = None) -> Array:
    """Where people are at `times` (n,) [s], (n, P, 2) [m]: straight between states, and on from the state `until`.

    NaN where a person is not there, and between a state at which they are and one at which they are not.
    """
    last = len(trajectory.time) - 1 if until is None else until
    time, position = trajectory.time[: last + 1], trajectory.people_position[: last + 1]
    before = np.clip(np.searchsorted(time, times + 1e-9, side="right") - 1, 0, last)
    after = np.minimum(before + 1, last)
    span = time[after] - time[before]
    share = np.divide(times - time[before], span, out=np.zeros(len(times)), where=span > 0.0)
    share = np.where(share < 1e-6, 0.0, share)[:, None, None]
    moved = position[before] + share * (position[after] - position[before])
    within = np.where(share > 0.0, moved, position[before])
    beyond = (times - time[-1])[:, None, None]
    return np.where(beyond > 1e-6, within + beyond * trajectory.people_velocity[last], within)


# ---------------------------------------------------------------------------------------- judgement


LEADS = (2.0, 1.0)  # [s] before the contact
AFTER_CONTACT = 2.0  # [s] for which nothing is to be touched after the moment of the contact
CLEARANCE = 0.05  # [m] of a free way: some three times the RMSE of the robot's estimated position under `pearson`
PROGRESS = 0.5  # [m] that a free way leads nearer to the goal: about the robot's diameter
SAMPLED = 0.2  # [s] between the moments at rest that are asked about; each stands for those up to the next


@dataclass(frozen=True, slots=True)
class Collision:
    """The first contact of a run."""

    contact: Contact
    touch: Touch | None  # of a person: who moved, whose fault; None of a thing
    avoidable: tuple[bool, ...]  # at each of LEADS before, or at the start of a run that is shorter
    last_chance: float | None  # [s] before, the latest tick at which it was avoidable; None without one


@dataclass(frozen=True, slots=True)
class Judgement:
    """What could have been avoided in a run."""

    collision: Collision | None
    stalled: float  # [s] at rest; the figure `stalled_s`
    free: float  # [s] of it with a way free
    timeout: bool | None  # whether the time-out was avoidable; None of a run that did not end so


def judged(trajectory: Trajectory, scenario: Scenario, *, outcome: str | None) -> Judgement:
    """Of a run that ended with `outcome`."""
    known = Foreknown(trajectory, scenario)
    free = _free_at_rest(known)
    needed = max(known.way_left(len(trajectory.time) - 1) - scenario.robot.goal_tolerance, 0.0)
    in_time = free >= needed / scenario.robot.preferred_speed
    return Judgement(_collision(known), stalled_time(trajectory), free, in_time if outcome in TIMEOUTS else None)


def _collision(known: Foreknown) -> Collision | None:
    trajectory, scenario = known.trajectory, known.scenario
    begun = beginnings(trajectory.contacts, scenario.control.period)
    if not begun:
        return None
    first = begun[0]
    before = max(int(np.searchsorted(trajectory.time, first.time - 1e-9)) - 1, 0)  # the last state before it

    def is_avoidable(row: int) -> bool:
        duration = first.time - float(trajectory.time[row]) + AFTER_CONTACT
        return known.first_clear_plan(row, duration, until=before) is not None

    rows = [max(int(np.searchsorted(trajectory.time, first.time - lead + 1e-9)) - 1, 0) for lead in LEADS]
    last = next((row for row in range(before, min(rows) - 1, -1) if is_avoidable(row)), None)
    whom = next((touch for touch in touches(trajectory, scenario) if touch.time == first.time), None)
    last_chance = None if last is None else first.time - float(trajectory.time[last])
    return Collision(first, whom, tuple(map(is_avoidable, rows)), last_chance)


def _free_at_rest(known: Foreknown) -> float:
    """How long the robot stood with a way free [s]: each state but the last stands for the period after it."""
    trajectory = known.trajectory
    time, speed = trajectory.time, np.abs(trajectory.robot_twist[:, 0])
    free, is_free, asked = 0.0, False, -np.inf
    for row in np.flatnonzero(speed[:-1] < STALLED_SPEED).tolist():
        if time[row] - asked >= SAMPLED - 1e-9:
            plan = known.first_clear_plan(row, HORIZON, clearance=CLEARANCE, progress=PROGRESS)
            is_free, asked = plan is not None, float(time[row])
        free += is_free * float(time[row + 1] - time[row])
    return free
