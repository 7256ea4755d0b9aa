"""How people take a robot that they see: what a temperament makes of the velocity that the behaviour wants.

After HuNavSim (Perez-Higueras, Otero, Caballero & Merino 2023, "HuNavSim: a ROS 2 human navigation simulator for
benchmarking human-aware robot navigation"), whose constants stand below. With d the distance between the centres:

    regular       w, the behaviour's
    yields        0 while the robot is seen within 4 m, for 30 s of a run at most ("surprised" there)
    impassive     w; the robot does not exist for this person
    curious       towards the robot at 1.8 d / 10 m/s while it is seen within 10 m, 0 from 1.5 m on; 30 s at most
    scared        0.6 m/s towards  w / (|w| tau) 0.6 + 20 sigma / (d - r) n  while the robot is seen within 3 m, n the
                  unit vector away from it, r the person's radius, tau = 0.5 s, sigma = 0.2 m
    threatening   at 2 m/s to the point 1.1 m ahead of the robot while it is seen within 4 m; 40 s at most

A person sees what lies up to 100 degrees from where they walk or look, and behind no wall. Who stands for the robot,
walks up to it or blocks its way, looks at it. Differences from HuNavSim: there walls hide nothing; impassive people
take the robot as an obstacle at rest; and the robot is no source of social forces for yields and scared.
"""

from collections.abc import Sequence
from math import cos, hypot, inf, isnan, pi
from types import MappingProxyType

import numpy as np

from mjnav.geometry.kernel_types import Indices
from mjnav.messages import Array, WorldState
from mjnav.scenarios.floor import floor_of_people
from mjnav.scenarios.people import PERIOD
from mjnav.scenarios.people.temperament import CURIOUS, IMPASSIVE, REGULAR, SCARED, THREATENING, YIELDS
from mjnav.scenarios.ranges import Point
from mjnav.scenarios.spec import Scenario
from mjnav.world.people.walk import ARRIVAL_TIME

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
        self._radius = [person.radius for person in people]
        self._spent = [0.0] * len(names)  # [s] of patience
        self._looks: list[Point] = [(0.0, 0.0)] * len(names)  # unit vectors
        self._walls = floor_of_people(scenario.walls, (), ())
        # For whom the robot is a body to keep clear of: not for those who come near on purpose.
        self.avoids = np.array([name not in (CURIOUS, THREATENING) for name in names], bool)

    def applied(self, world: WorldState, desired: Array) -> Array:
        """The wanted velocities (n, 2) [m/s], those of the behaviours where the robot is not seen."""
        robot = world.robot_pose.tolist()
        if not self._acting or isnan(robot[0]):
            return desired
        desired = np.array(desired)
        positions = world.people_position[self._bodies].tolist()
        velocities = world.people_velocity[self._bodies].tolist()
        wanted = desired[self._places].tolist()
        for (i, name), position, velocity, w in zip(self._acting, positions, velocities, wanted, strict=True):
            if isnan(position[0]):
                continue
            way = robot[0] - position[0], robot[1] - position[1]
            distance = max(hypot(*way), 1e-9)
            self._look(i, velocity, w)
            if self._spent[i] < PATIENCE[name] and self._sees(i, position, way, distance, SIGHT[name]):
                self._spent[i] += PERIOD
                ahead = way[0] / distance, way[1] / distance
                desired[i] = _wanted(name, robot, position, ahead, distance, self._radius[i], w)
                if name != SCARED:
                    self._looks[i] = ahead
        return desired

    def _look(self, i: int, *velocities: Sequence[float]) -> None:
        for x, y in velocities:
            speed = hypot(x, y)
            if speed > WALKING:
                self._looks[i] = x / speed, y / speed
                return

    def _sees(self, i: int, position: Sequence[float], way: Point, distance: float, sight: float) -> bool:
        """Whether the robot is near enough, within the field of view, and not behind a wall."""
        (x, y), (dx, dy), (look_x, look_y) = position, way, self._looks[i]
        if distance > sight or look_x * dx + look_y * dy < cos(FIELD_OF_VIEW) * distance:
            return False
        return not len(self._walls.boxes) or self._walls.blocking(position, (x + dx, y + dy), GLANCE) is None


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
