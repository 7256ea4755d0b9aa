"""Whether what went wrong in a run could have been avoided: an oracle that knows the true paths of all people.

The oracle knows where everybody truly was, what stands, and where the robot was to go. It drives some thousands of
plans (`oracle.rollouts`) from the robot's true pose and twist, within the robot's limits and without noise, delay or a
margin, among what stands and the people as they walked in the run.

* A collision (the run's first contact) was avoidable 2 s or 1 s before if one of the plans from then touches nothing
  until AFTER_CONTACT behind it, or reaches the goal. From the contact on, which ends most runs, people are taken to
  walk straight on as they did at the last state before it.
* The robot is at rest where `stalled_s` counts it: slower than 0.1 m/s. It has a way free there if a plan of HORIZON
  keeps CLEARANCE from everything and ends PROGRESS nearer to the goal, along the route and round what stands, or at
  the goal.
* A time-out was avoidable if the robot stood with a way free for at least as long as the way that was left at the end
  takes at the preferred speed: had it used that time, it would have arrived. A robot that creeps or drives back and
  forth until the end is not detected by this.

What it cannot say: people are taken to walk as they did, whatever the robot does. Someone who gave way to the robot
would not have had to, and someone who would give way to a plan does not. A plan that is not sampled may avoid what no
sampled one does. And a robot that sees through noise cannot know which plan it is: "avoidable" says that the robot
lacked knowledge at that moment, not the power to avoid; "not avoidable", that the cause lies further back.
"""

from dataclasses import dataclass, field

import numpy as np

from mjnav.geometry.floor import Floor
from mjnav.geometry.way_field import WayField
from mjnav.messages import Array, Contact, Trajectory
from mjnav.metrics.effort import STALLED_SPEED, stalled_time
from mjnav.metrics.oracle.rollouts import HORIZON, KNOT, Base, Bodies, Way, first_clear, plans
from mjnav.metrics.progress import legs_behind, targets
from mjnav.metrics.safety import Touch, beginnings, touches
from mjnav.metrics.social import radii
from mjnav.scene.spec import Scenario
from mjnav.scene.ways import floor_of_robot

# ---------------------------------------------------------------------------- what the oracle knows


STEP = 0.05  # [s] of the rollouts


@dataclass(frozen=True)
class Foreknown:
    """A trajectory and its scenario; `first_clear_plan` asks."""

    trajectory: Trajectory
    scenario: Scenario
    _floor: Floor = field(init=False)
    _targets: Array = field(init=False)  # (T + 1,)
    _fields: dict[int, WayField] = field(init=False, default_factory=dict)  # by point of the route, once asked for

    def __post_init__(self):
        one = self.scenario
        object.__setattr__(self, "_floor", floor_of_robot(one.walls, one.tables, one.pillars))
        object.__setattr__(self, "_targets", targets(self.trajectory, one))

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
        bodies = self._near(pose, fastest * duration, true_paths(self.trajectory, times, until), clearance)
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

    def _near(self, pose: Array, reach: float, people: Array, clearance: float) -> Bodies:
        """All bodies that the robot can meet within `reach` [m]."""
        apart = radii(self.scenario) + clearance
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
class Rest:
    """The time at rest."""

    total: float  # [s]; the figure `stalled_s`
    free: float  # [s] of it with a way free


@dataclass(frozen=True, slots=True)
class Judgement:
    """What could have been avoided in a run."""

    collision: Collision | None
    rest: Rest
    timeout: bool | None  # whether the time-out was avoidable; None of a run that did not end so


def judged(trajectory: Trajectory, scenario: Scenario, *, outcome: str | None) -> Judgement:
    """Of a run that ended with `outcome`."""
    known = Foreknown(trajectory, scenario)
    rest = _rest(known)
    needed = max(known.way_left(len(trajectory.time) - 1) - scenario.robot.goal_tolerance, 0.0)
    in_time = rest.free >= needed / scenario.robot.preferred_speed
    return Judgement(_collision(known), rest, in_time if outcome == "timeout" else None)


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


def _rest(known: Foreknown) -> Rest:
    """Over the states but the last; each stands for the period after it."""
    trajectory = known.trajectory
    time, speed = trajectory.time, np.abs(trajectory.robot_twist[:, 0])
    free, is_free, asked = 0.0, False, -np.inf
    for row in np.flatnonzero(speed[:-1] < STALLED_SPEED).tolist():
        if time[row] - asked >= SAMPLED - 1e-9:
            plan = known.first_clear_plan(row, HORIZON, clearance=CLEARANCE, progress=PROGRESS)
            is_free, asked = plan is not None, float(time[row])
        free += is_free * float(time[row + 1] - time[row])
    return Rest(stalled_time(trajectory), free)
