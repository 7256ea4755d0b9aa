"""How people take a robot that they see: what a temperament makes of the velocity that the behaviour wants.

After HuNavSim (Perez-Higueras, Otero, Caballero & Merino 2023, "HuNavSim: a ROS 2 human navigation simulator for
benchmarking human-aware robot navigation"), whose constants stand below. With d the distance between the centres:

    regular       w, the behaviour's
    yields        0 while the robot is seen within 4 m, for 30 s of a run at most ("surprised" there)
    impassive     w; whatever it does, the robot is a thing at rest for this person
    curious       towards the robot at 1.8 d / 10 m/s while it is seen within 10 m, 0 from 1.5 m on; 30 s at most
    scared        0.6 m/s towards  w / (|w| tau) 0.6 + 20 sigma / (d - r) n  while the robot is seen within 3 m, n the
                  unit vector away from it, r the person's radius, tau = 0.5 s, sigma = 0.2 m
    threatening   at 2 m/s to the point 1.1 m ahead of the robot while it is seen within 4 m; 40 s at most

A person sees what lies up to 100 degrees from where they walk or look, and behind no wall. Who stands for the robot,
walks up to it or blocks its way, looks at it. Differences from HuNavSim: there walls hide nothing, and the robot is
no source of social forces for yields and scared.
"""

from collections.abc import Sequence
from math import cos, hypot, inf, isnan, pi
from types import MappingProxyType

import numpy as np

from mjnav.compile.compiled import Flags, Indices, Matrix, Vector, exact
from mjnav.messages import Array, WorldState
from mjnav.scene.people import CURIOUS, IMPASSIVE, PERIOD, REGULAR, SCARED, THREATENING, YIELDS
from mjnav.scene.ranges import Point
from mjnav.scene.spec import Scenario
from mjnav.scene.ways import floor_of_people
from mjnav.world.people.walk import ARRIVAL_TIME, NEARLY

# Each person's numbers are floats: NumPy takes ten times as long for arrays of two.
SIGHT = MappingProxyType({YIELDS: 4.0, CURIOUS: 10.0, SCARED: 3.0, THREATENING: 4.0})  # [m]
PATIENCE = MappingProxyType({YIELDS: 30.0, CURIOUS: 30.0, SCARED: inf, THREATENING: 40.0})  # [s] of a run
FIELD_OF_VIEW = pi / 2.0 + 0.17  # [rad] to either side
APPROACH = 0.18  # [1/s] 1.8 m/s at 10 m
CLOSE = 1.5  # [m] at which the curious stop
SCARED_SPEED = 0.6  # [m/s]
SCARE, SCARE_RANGE, TAU = 20.0, 0.2, 0.5  # [m/s^2], [m], [s]
LEAST_GAP = 0.1  # [m] between a scared person and the robot, for the push to stay finite
BLOCK_AHEAD, BLOCK_SPEED = 1.1, 2.0  # [m], [m/s]
GLANCE = 0.01  # [m] from a wall at which people still see past it
WALKING = 0.05  # [m/s] above which a person looks where they walk


class Temperaments:
    """The temperaments of n people, with what each remembers of the robot."""

    def __init__(self, scenario: Scenario, index: Indices):
        people = [scenario.people[i] for i in index]
        names = [person.temperament or REGULAR for person in people]
        self._acting = [(i, name) for i, name in enumerate(names) if name not in (REGULAR, IMPASSIVE)]
        self._places = np.array([i for i, _ in self._acting], int)
        self._bodies = index[self._places]
        # Of those who act, in their order:
        self._radius = [people[i].radius for i, _ in self._acting]
        self._sight = np.array([SIGHT[name] for _, name in self._acting], float)
        self._spent = [0.0] * len(self._acting)  # [s] of patience
        self._looks = np.zeros((len(self._acting), 2))  # where they look, vectors of any length
        self._looks_at_robot = np.ones(len(self._acting), bool)  # and unit vectors where they look at it
        self._near = np.zeros(len(self._acting), np.int64)
        self._walls = floor_of_people(scenario.walls, (), ())
        # For whom the robot is a body to keep clear of: not for those who come near on purpose.
        self.avoids = np.array([name not in (CURIOUS, THREATENING) for name in names], bool)
        self.still = np.array([name == IMPASSIVE for name in names], bool)  # for whom it is a thing at rest

    def applied(self, world: WorldState, desired: Array) -> Array:
        """The wanted velocities (n, 2) [m/s], those of the behaviours where the robot is not seen."""
        robot = world.robot_pose.tolist()
        if not self._acting or isnan(robot[0]):
            return desired
        desired = np.ascontiguousarray(desired, float)
        positions, velocities = np.ascontiguousarray(world.people_position), np.ascontiguousarray(world.people_velocity)
        num_near = _look(
            self._looks, self._looks_at_robot, self._near, positions, velocities, self._bodies, desired, self._places,
            robot[0], robot[1], self._sight,
        )  # fmt: skip
        if not num_near:
            return desired
        desired = desired.copy()
        for k in self._near[:num_near].tolist():
            i, name = self._acting[k]
            position, w = positions[self._bodies[k]].tolist(), desired[i].tolist()
            way = robot[0] - position[0], robot[1] - position[1]
            distance = max(hypot(*way), 1e-9)
            if self._spent[k] < PATIENCE[name] and self._sees(k, position, way, distance, SIGHT[name]):
                self._spent[k] += PERIOD
                ahead = way[0] / distance, way[1] / distance
                desired[i] = _wanted(name, robot, position, ahead, distance, self._radius[k], w)
                if name != SCARED:
                    self._looks[k], self._looks_at_robot[k] = ahead, True
        return desired

    def _sees(self, k: int, position: Sequence[float], way: Point, distance: float, sight: float) -> bool:
        """Whether the robot is near enough, within the field of view, and not behind a wall."""
        (x, y), (dx, dy), (look_x, look_y) = position, way, self._looks[k].tolist()
        if distance > sight:
            return False
        if not self._looks_at_robot[k]:
            length = hypot(look_x, look_y)
            look_x, look_y = look_x / length, look_y / length
        if look_x * dx + look_y * dy < cos(FIELD_OF_VIEW) * distance:
            return False
        return not len(self._walls.boxes) or self._walls.blocking(position, (x + dx, y + dy), GLANCE) is None


@exact
def _look(
    looks: Matrix,
    at_robot: Flags,
    near: Indices,
    position: Matrix,
    velocity: Matrix,
    bodies: Indices,
    desired: Matrix,
    places: Indices,
    x: float,
    y: float,
    sight: Vector,
):
    """Turns the `looks` (n, 2) of all who walk, or want to, to where they do; they look `at_robot` (n,) no more.

    Their places are `bodies` (n,) among all people's positions and velocities, `places` (n,) among the desired ones.
    Who is as near to the robot's place (x, y) as their `sight` (n,), those at the limit included, goes to `near`;
    returns how many.
    """
    num_near = 0
    for k in range(len(looks)):
        body, place = bodies[k], places[k]
        dx, dy = x - position[body, 0], y - position[body, 1]
        if np.isnan(dx):  # who is not there
            continue
        if np.hypot(velocity[body, 0], velocity[body, 1]) > WALKING:
            looks[k, 0], looks[k, 1], at_robot[k] = velocity[body, 0], velocity[body, 1], False
        elif np.hypot(desired[place, 0], desired[place, 1]) > WALKING:
            looks[k, 0], looks[k, 1], at_robot[k] = desired[place, 0], desired[place, 1], False
        if dx * dx + dy * dy <= NEARLY * sight[k] * sight[k]:
            near[num_near] = k
            num_near += 1
    return num_near


def _wanted(
    name: str,
    robot: Sequence[float],
    position: Sequence[float],
    ahead: Point,
    distance: float,
    radius: float,
    w: Sequence[float],
) -> Point:
    """The velocity of an acting temperament; `ahead` is the unit vector towards the robot's pose `robot`."""
    if name == YIELDS or (name == CURIOUS and distance <= CLOSE):
        return 0.0, 0.0
    if name == CURIOUS:
        speed = APPROACH * distance
        return speed * ahead[0], speed * ahead[1]
    if name == SCARED:
        walking, pull = hypot(*w), SCARED_SPEED / TAU
        push = SCARE * SCARE_RANGE / max(distance - radius, LEAST_GAP)
        x, y = (pull * v / walking if walking > 0.0 else 0.0 for v in w)
        x, y = x - push * ahead[0], y - push * ahead[1]
        share = SCARED_SPEED / max(hypot(x, y), 1e-9)
        return share * x, share * y
    x = robot[0] + BLOCK_AHEAD * float(np.cos(robot[2])) - position[0]
    y = robot[1] + BLOCK_AHEAD * float(np.sin(robot[2])) - position[1]
    gap = max(hypot(x, y), 1e-9)
    share = min(BLOCK_SPEED, gap / ARRIVAL_TIME) / gap
    return share * x, share * y
