"""Safety of a run: distances from others, contacts and whose fault they were, and time over a lane's boundary.

Each contact with a person says whether the robot moved, and whether it was its fault. The velocities are those of the
last tick before the contact; n is the direction from the robot to the person, u the robot's velocity, w the person's.
The robot approaches with u.n, the person with -w.n.

* At rest the robot is not at fault: it did what passive motion safety asks, which is to be at rest when a collision
  takes place (Macek, Vasquez Govea, Fraichard & Siegwart, Towards Safe Vehicle Navigation in Dynamic Urban Scenarios,
  2009; Bouraine, Fraichard & Salhi 2012).
* It moves, and the person does not see it, or never takes account of anybody: its fault, whatever the person did.
* It moves, and the person sees it: its fault if it approaches at least as fast as the person, u.n >= -w.n. Both can
  give way, and each owes half of it (reciprocal avoidance, van den Berg, Guy, Lin & Manocha 2011).
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from mjnav.geometry.distances import segment_distance
from mjnav.messages import Array, Contact, Trajectory
from mjnav.metrics.definitions import HIGHER, INTEGER, LOWER, NOBODY, STRING, TABLE_1, Definition, figures
from mjnav.metrics.effort import STALLED_SPEED
from mjnav.metrics.progress import ROWS, jumps
from mjnav.scene.people import REGULAR
from mjnav.scene.spec import Scenario, Wall

# -------------------------------------------------------------------- clearance, contacts and lanes


PERSON = "person"
KINDS: tuple[str, ...] = (PERSON, "table", "wall", "pillar")


class Clearances(NamedTuple):
    """Distances of the robot's surface from others [m], negative in contact; None where there are no such bodies."""

    least: float | None
    least_person: float | None
    least_thing: float | None  # walls, legs of tables and pillars
    mean_thing: float | None  # over the steps, of the least in each


@figures(
    "path",
    Definition("min_clearance_m", better=HIGHER, words="least clearance", null="an empty room"),
    Definition("min_human_distance_m", group="social", better=HIGHER, words="least distance from people", null=NOBODY,
               source=TABLE_1),
    Definition("min_obstacle_clearance_m", better=HIGHER, words="least clearance from things",
               source=f"{TABLE_1}: clearing distance", null="nothing but people"),
    Definition("mean_obstacle_clearance_m", words="mean clearance from things",
               source=f"{TABLE_1}: clearing distance", null="nothing but people"),
    over_all=True,
)  # fmt: skip
def clearances(trajectory: Trajectory, scenario: Scenario) -> Clearances:
    """Over straight moves from tick to tick, as `clearance`.

    * min_clearance_m: least distance of the robot's surface from any other, over straight moves between ticks; 0 or
      negative in contact, but for a millimetre in the kinematic engine. Table tops do not count
    * min_human_distance_m: least distance of the robot's surface from a person's, over straight moves between ticks
    * min_obstacle_clearance_m: min_clearance_m from walls, legs of tables and pillars alone
    * mean_obstacle_clearance_m: the same, mean over the ticks of the least distance in each
    """
    people: list[Array] = []
    things: list[Array] = []
    for part in _parts(trajectory):
        found = clearance(part, scenario)
        for steps, of_people in ((people, True), (things, False)):
            columns = [distance for name, distance in found.items() if name.startswith(PERSON) == of_people]
            if columns:
                steps.append(np.fmin.reduce(columns))
    person, thing = _least(people), _least(things)
    mean = float(np.mean(np.concatenate(things))) if things else None
    known = [least for least in (person, thing) if least is not None]
    return Clearances(min(known, default=None), person, thing, mean)


def _least(steps: Sequence[Array]) -> float | None:
    """The least of all steps without those that are not known, at which nobody is there."""
    finite = [step[np.isfinite(step)] for step in steps]
    return min((float(step.min()) for step in finite if step.size), default=None)


def _parts(trajectory: Trajectory) -> Iterator[Trajectory]:
    """The trajectory with ROWS steps of its poses at a time: each part begins with the last state of the one before."""
    for start in range(0, max(len(trajectory.robot_pose) - 1, 1), ROWS):
        yield _states(trajectory, slice(start, start + ROWS + 1))


def _states(trajectory: Trajectory, rows: slice | list[int]) -> Trajectory:
    pose, people, radius = trajectory.robot_pose[rows], trajectory.people_position[rows], trajectory.people_radius
    radius = None if radius is None else radius[rows]
    return replace(trajectory, robot_pose=pose, people_position=people, people_radius=radius)


def clearance(trajectory: Trajectory, scenario: Scenario) -> dict[str, Array]:
    """Least distance of the robot's surface from each body's in each step from tick to tick [m], (max(T, 1),) by name.

    Robot and people are taken to move straight from tick to tick, so nothing is missed between two. Table tops, above
    the robot, do not count. NaN for a person in steps in which they are not there; of a step in which they come or go,
    the end at which they are there counts. Of a step by which a kidnapping put the robot elsewhere both ends count.
    """
    (x, y, heading), discs = trajectory.robot_pose.T, scenario.robot.limits.discs
    axis = np.stack([np.cos(heading), np.sin(heading)], axis=1)
    routes = [(np.stack([x, y], axis=1) + ahead * axis, radius) for ahead, radius in discs]
    of_discs = [
        {name: gap - radius for name, gap in _gaps(route, trajectory, scenario).items()} for route, radius in routes
    ]
    found = {name: np.min([found[name] for found in of_discs], axis=0) for name in of_discs[0]}
    for k in np.flatnonzero(jumps(trajectory, scenario)).tolist():
        before, after = (clearance(_states(trajectory, [end, end]), scenario) for end in (k, k + 1))
        for name in found:
            found[name][k] = np.fmin(before[name], after[name])[0]
    return found


def _gaps(route: Array, trajectory: Trajectory, scenario: Scenario) -> dict[str, Array]:
    """The same of a point of the robot that moves along `route` (T + 1, 2)."""
    found: dict[str, Array] = {}
    radius = people_radius(trajectory, scenario)
    for i in range(len(scenario.people)):
        here = trajectory.people_position[:, i]
        of_step = np.where(np.isnan(here[:-1, 0]), radius[1:, i], radius[:-1, i]) if len(here) > 1 else radius[:, i]
        found[f"person{i}"] = _disc_distance(route - here) - of_step
    for i, table in enumerate(scenario.tables):
        legs = [_disc_distance(route - leg) for leg in table.legs]
        found[f"table{i}"] = np.min(legs, axis=0) - table.leg_radius
    for i, pillar in enumerate(scenario.pillars):
        found[f"pillar{i}"] = _disc_distance(route - pillar.position) - pillar.radius
    for i, wall in enumerate(scenario.walls):
        found[f"wall{i}"] = wall_distance(route, wall)
    return found


def people_radius(trajectory: Trajectory, scenario: Scenario) -> Array:
    """Each person's radius at each state, (T + 1, P) [m]."""
    told = trajectory.people_radius
    fixed = np.array([person.radius for person in scenario.people])
    return np.broadcast_to(fixed, trajectory.people_position.shape[:2]) if told is None else told


def _disc_distance(relative: Array) -> Array:
    """Least distance from the origin in each step through `relative` (n, 2), (max(n - 1, 1),)."""
    if len(relative) == 1:
        return np.hypot(*relative.T)
    distance = segment_distance(np.zeros(2), relative[:-1], relative[1:])
    if np.isnan(distance).any():
        at_ends = np.hypot(*relative.T)
        distance = np.where(np.isnan(distance), np.fmin(at_ends[:-1], at_ends[1:]), distance)
    return distance


def wall_distance(route: Array, wall: Wall) -> Array:
    """Least distance between each step of `route` (n, 2), n >= 1, and a wall as thick as it is [m], (max(n - 1, 1),).

    Outside of the wall it is exact: a straight line and a rectangle are closest at an end of the line or at a corner.
    Inside it is minus the depth below the nearest face, at the route's corners.
    """
    local, half = _in_wall(route, wall)
    at_ends = _box_distance(local, half)
    if len(local) == 1:
        return at_ends
    corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * half
    at_corners = segment_distance(corners[:, None], local[:-1], local[1:])
    return np.minimum(np.minimum(at_ends[:-1], at_ends[1:]), at_corners.min(0))


def thing_distance(points: Array, scenario: Scenario) -> Array:
    """Distance of points (n, 2) from the nearest wall, leg of a table or pillar [m], (n,); infinite without."""
    discs = [(leg, table.leg_radius) for table in scenario.tables for leg in table.legs]
    discs += [(pillar.position, pillar.radius) for pillar in scenario.pillars]
    nearest = np.full(len(points), np.inf)
    for centre, radius in discs:
        nearest = np.minimum(nearest, np.hypot(*(points - centre).T) - radius)
    for wall in scenario.walls:
        nearest = np.minimum(nearest, _box_distance(*_in_wall(points, wall)))
    return nearest


def _in_wall(points: Array, wall: Wall) -> tuple[Array, Array]:
    """Points (n, 2) along and across a wall from its middle, (n, 2), and half of its sides, (2,) [m]."""
    start, end = np.array(wall.start), np.array(wall.end)
    length = np.hypot(*(end - start))
    along = (end - start) / length
    across = np.array([-along[1], along[0]])
    relative = points - 0.5 * (start + end)
    return np.stack([relative @ along, relative @ across], axis=-1), 0.5 * np.array([length, wall.thickness])


def _box_distance(local: Array, half: Array) -> Array:
    """Of points (n, 2) from the box with these half sides around the origin, (n,); inside minus the depth."""
    excess = np.abs(local) - half
    return np.hypot(*np.maximum(excess, 0.0).T) + np.minimum(excess.max(-1), 0.0)


def beginnings(contacts: Iterable[Contact], period: float) -> list[Contact]:
    """The contacts with which the robot began to touch something, in order of time.

    A contact is reported in every period in which it lasts; the same body seen again within two periods [s] is the same
    contact, so a bump that bounces counts once.
    """
    begun: list[Contact] = []
    last: dict[str, float] = {}
    for contact in sorted(contacts, key=lambda contact: contact.time):
        if contact.time - last.get(contact.name, -np.inf) > 2.0 * period:
            begun.append(contact)
        last[contact.name] = contact.time
    return begun


@figures(
    "ending",
    *(
        Definition(f"collisions.{kind}", f"contacts with a {kind}; the same body seen again within two control periods "
                   "counts once", words=f"contacts with a {kind}")
        for kind in KINDS
    ),
    type=INTEGER, better=LOWER, source=TABLE_1, over_all=True,
)  # fmt: skip
def collision_counts(trajectory: Trajectory, scenario: Scenario) -> tuple[int, ...]:
    """`collisions` of each of KINDS."""
    counts = collisions(trajectory.contacts, scenario.control.period)
    return tuple(counts[kind] for kind in KINDS)


def collisions(contacts: Iterable[Contact], period: float) -> dict[str, int]:
    """How often the robot began to touch something, by kind."""
    count: dict[str, int] = dict.fromkeys(KINDS, 0)
    for contact in beginnings(contacts, period):
        count[contact.kind] = count.get(contact.kind, 0) + 1
    return count


@figures("path", Definition("lane_violation_s", better=LOWER, words="time over a lane's edge", null="no lanes"))
def lane_violation(trajectory: Trajectory, scenario: Scenario) -> float | None:
    """How long any part of the robot was over a boundary [s]; None without lanes.

    Over the left one is d1 + radius > 0, over the right one d2 - radius < 0, linear between ticks.

    * lane_violation_s: time for which any part of the robot was beyond a lane's boundary, linear between ticks
    """
    excess = _lane_excess(trajectory, scenario)
    if excess is None:
        return None
    before, after = excess[:-1], excess[1:]
    over = np.maximum(before, 0.0) + np.maximum(after, 0.0)
    size = np.abs(before) + np.abs(after)
    share = np.divide(over, size, out=np.zeros_like(size), where=size > 0.0)
    return float(share @ np.diff(trajectory.time))


@figures(
    "path",
    Definition("min_lane_clearance_m", words="least distance from the lane's edge"),
    Definition("mean_lane_clearance_m", words="mean distance from the lane's edge"),
    better=HIGHER, null="no lanes", over_all=True,
)  # fmt: skip
def lane_clearance(trajectory: Trajectory, scenario: Scenario) -> tuple[float, float] | None:
    """Distance of the robot's edge from the nearer boundary, its least and its mean over time [m]; None without lanes.

    * min_lane_clearance_m: from the robot's edge to the nearer boundary, minimum; negative beyond it
    * mean_lane_clearance_m: the same, mean over time
    """
    excess = _lane_excess(trajectory, scenario)
    if excess is None:
        return None
    duration = trajectory.time[-1] - trajectory.time[0]
    mean = np.trapezoid(excess, trajectory.time) / duration if duration > 0.0 else excess[0]
    return -float(excess.max()), -float(mean)


def _lane_excess(trajectory: Trajectory, scenario: Scenario) -> Array | None:
    """How far the robot's edge is beyond the boundary that it is nearer to, at each state (T + 1,); None as above."""
    if scenario.lanes is None:
        return None
    from mjnav.constraints.walls import lane_distance

    route, radius = trajectory.robot_pose[:, :2], scenario.robot.radius
    left = lane_distance(route, scenario.lanes.left) + radius
    right = radius - lane_distance(route, scenario.lanes.right)
    return np.maximum(left, right)


# -------------------------------------------------------------------------------------------- fault


@dataclass(frozen=True, slots=True)
class Touch:
    """The beginning of a contact with a person."""

    person: int
    time: float  # [s]
    speed: float  # [m/s] of the robot
    moving: bool
    at_fault: bool

    def __str__(self) -> str:
        if not self.moving:
            return "the robot stood"
        whose = "its own fault" if self.at_fault else "the person came faster"
        return f"the robot moved at {self.speed:.2f} m/s: {whose}"


@figures(
    "ending",
    Definition("collisions_moving", better=LOWER, source="Tsoi et al. (2022): robot on person",
               words="contacts with people while moving"),
    Definition("collisions_at_rest", source="Tsoi et al. (2022): person on robot",
               words="contacts with people at rest"),
    Definition("robot_at_fault", better=LOWER, words="contacts that are the robot's fault",
               source="at rest: passive motion safety, Macek et al. (2009); halves: van den Berg et al. (2011)"),
    type=INTEGER, over_all=True,
)  # fmt: skip
def fault_counts(trajectory: Trajectory, scenario: Scenario) -> tuple[int, int, int]:
    """How many touches there were while the robot moved, while it stood, and by its fault.

    * collisions_moving: contacts with people while the robot moved: its speed at the tick before was above 0.1 m/s
    * collisions_at_rest: contacts with people while the robot stood: its speed at the tick before was at most 0.1 m/s
    * robot_at_fault: contacts with people that are the robot's fault: it moved, and the person does not see it or
      approached no faster than it did
    """
    found = touches(trajectory, scenario)
    moving = sum(touch.moving for touch in found)
    return moving, len(found) - moving, sum(touch.at_fault for touch in found)


def touches(trajectory: Trajectory, scenario: Scenario) -> tuple[Touch, ...]:
    """Every beginning of a contact with a person, in order of time."""
    begun = beginnings(trajectory.contacts, scenario.control.period)
    return tuple(
        judged(
            contact,
            trajectory.robot_pose[row],
            trajectory.robot_twist[row],
            trajectory.people_position[row],
            trajectory.people_velocity[row],
            sees=sees_robot(scenario),
        )
        for contact in begun
        if contact.kind == PERSON
        for row in [max(int(np.searchsorted(trajectory.time, contact.time + 1e-9)) - 1, 0)]
    )


def judged(
    contact: Contact, pose: Array, twist: Array, people: Array, walking: Array, *, sees: Sequence[bool]
) -> Touch:
    """One contact with a person, from the state before it: pose (3,), twist (2,), people and velocities (P, 2)."""
    person = int(contact.name.removeprefix(PERSON))
    own = twist[0] * np.array([np.cos(pose[2]), np.sin(pose[2])])
    towards = people[person] - pose[:2]
    speed = abs(float(twist[0]))
    faster = float((own + walking[person]) @ towards) >= 0.0  # u.n >= -w.n
    moving = speed > STALLED_SPEED
    return Touch(person, contact.time, speed, moving, moving and (faster or not sees[person]))


def sees_robot(scenario: Scenario) -> tuple[bool, ...]:
    """Whether each person sees the robot and takes account of it, (P,).

    A person of a behaviour that walks on whatever happens does not, unless a temperament makes them: for them
    `sees_robot = true` alone changes nothing.
    """
    return tuple(
        person.sees and (person.behaviour.heeds_robot or person.temperament not in (None, REGULAR))
        for person in scenario.people
    )


@figures("ending", Definition("people_see_robot", type=STRING, null=NOBODY, words="people who see the robot"))
def people_see_robot(scenario: Scenario) -> str | None:
    """How many do: "all", "none" or "3 of 5"; None without people.

    * people_see_robot: how many people see the robot and take account of it: "all", "none", or "3 of 5". Who walks on
      whatever happens takes none, whatever sees_robot says
    """
    sees = sees_robot(scenario)
    if not sees:
        return None
    return "all" if all(sees) else f"{sum(sees)} of {len(sees)}" if any(sees) else "none"
