"""Whether what went wrong in a run could have been avoided: an oracle that knows the true paths of all people.

It drives some thousands of plans (`oracle.plans`) from the robot's true pose and twist, within the robot's limits and
without noise, delay or a margin, among what stands and the people as they walked in the run.

* A collision (the run's first contact) was avoidable 2 s or 1 s before if one of the plans from then touches nothing
  until AFTER_CONTACT behind it, or reaches the goal. From the contact on, which ends most runs, people are taken to
  walk straight on as they did at the last state before it.
* The robot is at rest where `stalled_s` counts it: slower than 0.1 m/s. It has a way free there if a plan of HORIZON
  keeps CLEARANCE from everything and ends PROGRESS nearer to the goal, along the route and round what stands, or at
  the goal.
* A time-out was avoidable if the robot stood with a way free for at least as long as the way that was left at the end
  takes at the preferred speed: had it used that time, it would have arrived. A robot that creeps or drives back and
  forth until the end is not found so.

What it cannot say: people are taken to walk as they did, whatever the robot does. Someone who gave way to the robot
would not have had to, and someone who would give way to a plan does not. A plan that is not sampled may avoid what no
sampled one does. And a robot that sees through noise cannot know which plan it is: "avoidable" says that the robot
lacked knowledge at that moment, not the power to avoid; "not avoidable", that the cause lies further back.
"""

from dataclasses import dataclass

import numpy as np

from mjnav.messages import Contact, Trajectory
from mjnav.metrics.fault import Touch, touches
from mjnav.metrics.kinematics import STALLED_SPEED, stalled_time
from mjnav.metrics.oracle.foreknown import Foreknown
from mjnav.metrics.oracle.plans import HORIZON
from mjnav.metrics.safety import beginnings
from mjnav.scenarios.spec import Scenario

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
