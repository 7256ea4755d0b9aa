"""A run as the oracle knows it: where everybody truly was, what stands, and where the robot was to go."""

from dataclasses import dataclass, field

import numpy as np

from mjnav.geometry.floor import Floor
from mjnav.geometry.way_field import WayField
from mjnav.messages import Array, Trajectory
from mjnav.metrics.oracle.plans import KNOT, plans
from mjnav.metrics.oracle.rollouts import Base, Bodies, Way, first_clear
from mjnav.metrics.progress import legs_behind, targets
from mjnav.metrics.proximity import radii
from mjnav.scenarios.floor import floor_of_robot
from mjnav.scenarios.spec import Scenario

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
