"""People who avoid others: the walk that all laws share, and the laws ORCA and social force.

The shared walk says where people want to go, and gathers all bodies that a law looks at. With ORCA
(optimal reciprocal collision avoidance) people avoid one another reciprocally; social forces push people.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin, sqrt
from typing import TypeVar

import numpy as np

from mjnav.compile.compiled import Flags, Indices, Matrix, Vector, exact
from mjnav.messages import Array, WorldState
from mjnav.motion.orca import OrcaSettings, velocities
from mjnav.motion.social_force import FORMS, SocialForce, accelerations
from mjnav.rng import stream
from mjnav.scene.people import MAX_WALKING_SPEED, PERIOD, Avoiding, Orca
from mjnav.scene.people import SocialForce as SocialForceKeys
from mjnav.scene.ranges import Point
from mjnav.scene.spec import Scenario
from mjnav.scene.ways import floor_of_people
from mjnav.world.draws import Normal, Uniform
from mjnav.world.people.temperament import Temperaments
from mjnav.world.people.walk import Route, Walk

# ------------------------------------------------------------------------------- shared by all laws


HALF_RIGHT = sqrt(0.5)  # cosine and sine of 45 degrees
# [rad] to the right of the way, where people want to walk, so that two who meet exactly head-on pass: the laws leave
# them standing before one another. Noise breaks such symmetries in the examples of ORCA's authors.
TO_THE_RIGHT = 0.02


Law = TypeVar("Law")


@dataclass(frozen=True, slots=True)
class Bodies:
    """The people of a scene, then the robot."""

    position: Array  # (P + 1, 2) [m], NaN for who is not there or not seen
    velocity: Array  # (P + 1, 2) [m/s]
    robot: int  # the robot's place


class AvoidingWalk(Walk):
    """People on a route who avoid others by a law; the law is the subclass's.

    What a law says is reached with the person's acceleration at most. The velocity that is integrated so is the
    person's will: a body that others hold back, or a servo that lags, leaves it.
    """

    tempers = True

    def __init__(self, scenario: Scenario, index: Indices, seed: int):
        super().__init__(scenario, index, seed)
        behaviours = self.behaviours(scenario, Avoiding)
        self._route = Route(scenario, index, seed)
        self._temperaments = Temperaments(scenario, index)
        self._speed = np.array([behaviour.speed for behaviour in behaviours], float)
        self._acceleration = np.array([behaviour.acceleration for behaviour in behaviours], float)
        self._will = np.full((len(index), 2), np.nan)
        self._radius = np.array([*(person.radius for person in scenario.people), scenario.robot.radius])
        self._floor = floor_of_people(scenario.walls, scenario.tables, scenario.pillars)
        self._decisions = 0
        self._diagonal = [
            _Turns(behaviours, every, index, seed)
            for every in sorted({one.diagonal.every for one in behaviours if one.diagonal is not None})
        ]
        self._turned = np.zeros(len(index), bool)
        self._std = np.array([behaviour.unsteadiness for behaviour in behaviours], float)
        self._unsteady = np.flatnonzero(self._std > 0.0)
        streams = [stream(seed, "behaviour.unsteadiness", f"person{index[i]}") for i in self._unsteady]
        self._noise = Normal(streams)

    def wanted(self, world: WorldState) -> Array:
        """(n, 2) [m/s] along the routes, changes of mind and temperaments included."""
        desired = self._route.velocities(world)
        for turns in self._diagonal:
            if self._decisions % turns.every == 0:
                self._turned[turns.drawn()] = True
        self._decisions += 1
        _turn(desired, self._turned)
        return self._temperaments.applied(world, desired)

    def arrived(self, world: WorldState) -> Flags:
        """See `Walk`."""
        return self._route.arrived(world)

    def begin(self, place: int, start: Point, goal: Point) -> None:
        """See `Walk`; whoever changed their mind walks straight again."""
        self._route.begin(place, start, goal)
        self._turned[place] = False

    def bodies(self, world: WorldState) -> Bodies:
        """Everybody, and the robot as one more: at NaN where these people do not see it."""
        (x, y, heading), speed = world.robot_pose.tolist(), float(world.robot_twist[0])
        robot = len(world.people_position)
        position, velocity = np.empty((2, robot + 1, 2))
        position[:robot], position[robot] = world.people_position, (x, y)
        velocity[:robot], velocity[robot] = world.people_velocity, (speed * cos(heading), speed * sin(heading))
        return Bodies(position, velocity, robot)

    def unsteady(self, velocities: Array) -> Array:
        """The velocities with the noise of those who walk unsteadily, at most MAX_WALKING_SPEED; drawn each time."""
        if not self._unsteady.size:
            return velocities
        return _shaken(velocities, self._unsteady, self._std, self._noise.row())


def groups(laws: Sequence[Law]) -> list[tuple[Indices, Law]]:
    """Who has the same law, and the law: one call of it moves them all."""
    return [(np.flatnonzero([other == one for other in laws]), one) for one in dict.fromkeys(laws)]


@exact
def _accelerate(will: Matrix, wanted: Matrix, acceleration: Vector, position: Matrix, index: Indices):
    """Moves the wills (n, 2) on to the wanted velocities, each by at most its acceleration (n,) [m/s^2] times PERIOD.

    Who has no will yet takes the velocity at once, and who is not there has none.
    """
    for i in range(len(will)):
        dx, dy = wanted[i, 0] - will[i, 0], wanted[i, 1] - will[i, 1]
        change, most = np.hypot(dx, dy), PERIOD * acceleration[i]
        if np.isnan(position[index[i], 0]):
            will[i, 0], will[i, 1] = np.nan, np.nan
        elif change > most:
            will[i, 0], will[i, 1] = will[i, 0] + most / change * dx, will[i, 1] + most / change * dy
        else:  # also where the change is NaN
            will[i, 0], will[i, 1] = wanted[i, 0], wanted[i, 1]


@exact
def _turn(desired: Matrix, diagonal: Flags):
    """Turns the velocities (n, 2) in place TO_THE_RIGHT, and those of who walks `diagonal` (n,) 45 degrees first."""
    for i in range(len(desired)):
        x, y = desired[i, 0], desired[i, 1]
        if diagonal[i]:
            x, y = HALF_RIGHT * (x - y), HALF_RIGHT * (x + y)
        desired[i, 0], desired[i, 1] = x + TO_THE_RIGHT * y, y - TO_THE_RIGHT * x


@exact
def _shaken(velocities: Matrix, unsteady: Indices, std: Vector, noise: Matrix):
    """The velocities (n, 2), those of who is `unsteady` (k,) with `std` (n,) times `noise` (k, 2)."""
    shaken = velocities.copy()
    for k in range(len(unsteady)):
        i = unsteady[k]
        x, y = velocities[i, 0] + std[i] * noise[k, 0], velocities[i, 1] + std[i] * noise[k, 1]
        share = MAX_WALKING_SPEED / max(np.hypot(x, y), MAX_WALKING_SPEED)
        shaken[i, 0], shaken[i, 1] = share * x, share * y
    return shaken


class _Turns:
    """The changes of mind of all who draw them equally often."""

    def __init__(self, behaviours: Sequence[Avoiding], every: int, index: Indices, seed: int):
        self.every = every
        given = [one.diagonal for one in behaviours]
        self._who = np.array([i for i, one in enumerate(given) if one is not None and one.every == every])
        self._probability = np.array([one.probability for one in given if one is not None and one.every == every])
        streams = [stream(seed, "behaviour.diagonal", f"person{index[i]}") for i in self._who]
        self._draws = Uniform(streams)

    def drawn(self) -> Indices:
        """Who turns now."""
        return self._who[self._draws.row() < self._probability]


# --------------------------------------------------------------------------------------------- ORCA


class OrcaWalk(AvoidingWalk):
    """Velocities of `motion.orca`, nearest to those along the routes; never faster than these."""

    sidesteps = False  # the law says how to pass, also when people touch

    def __init__(self, scenario: Scenario, index: Indices, seed: int):
        super().__init__(scenario, index, seed)
        self._groups = groups([settings_of(behaviour) for behaviour in self.behaviours(scenario, Orca)])

    def velocities(self, world: WorldState) -> Array:
        """See `Walk`."""
        wanted, bodies = self.wanted(world), self.bodies(world)
        max_speed = np.maximum(self._speed, np.hypot(wanted[:, 0], wanted[:, 1]))
        found = np.empty_like(wanted)
        tempers, discs, boxes = self._temperaments, self._floor.discs, self._floor.boxes
        for group, settings in self._groups:
            found[group] = velocities(
                bodies.position, bodies.velocity, self._radius, self.index[group], wanted[group], max_speed[group],
                tempers.avoids[group], tempers.still[group], bodies.robot, discs, boxes, settings,
            )  # fmt: skip
        _accelerate(self._will, found, self._acceleration, bodies.position, self.index)
        return self.unsteady(self._will)


def settings_of(keys: Orca) -> OrcaSettings:
    """What the run file says."""
    return OrcaSettings(
        keys.time_horizon, keys.wall_horizon, keys.neighbour_distance, keys.max_neighbours, keys.robot_share,
        keys.personal_space, PERIOD,
    )  # fmt: skip


# ------------------------------------------------------------------------------------- social force


STANDING_TIME = 0.5  # [s] in which who arrives comes to rest where a form has no tau (libpedsim)


class SocialForceWalk(AvoidingWalk):
    """Velocities that follow the accelerations of `motion.social_force`, by Euler's steps of PERIOD.

    The will is at most the wanted speed, times a factor of the form.
    """

    def __init__(self, scenario: Scenario, index: Indices, seed: int):
        super().__init__(scenario, index, seed)
        self._groups = groups([law_of(behaviour) for behaviour in self.behaviours(scenario, SocialForceKeys)])
        # In MuJoCo bodies that touch slide past one another; in the kinematic world they stand.
        self.sidesteps = scenario.physics.engine == "kinematic"

    def velocities(self, world: WorldState) -> Array:
        """See `Walk`."""
        wanted, bodies = self.wanted(world), self.bodies(world)
        found = np.empty_like(wanted)
        _begin(self._will, wanted, bodies.position, bodies.velocity, self.index)
        tempers, discs, boxes = self._temperaments, self._floor.discs, self._floor.boxes
        for group, law in self._groups:
            _follow(
                found, self._will, group, wanted, self._speed, self.index, tempers.avoids, tempers.still,
                bodies.position, bodies.velocity, self._radius, bodies.robot, discs, boxes, law,
            )  # fmt: skip
        _accelerate(self._will, found, self._acceleration, bodies.position, self.index)
        return self.unsteady(self._will)


@exact
def _begin(will: Matrix, wanted: Matrix, position: Matrix, velocity: Matrix, index: Indices):
    """Gives a will (n, 2) to those who have none yet or are not there; it becomes everybody's velocity.

    It is what the others react to: noise is not.
    """
    for i in range(len(will)):
        body = index[i]
        if np.isnan(will[i, 0]) or np.isnan(position[body, 0]):
            will[i, 0], will[i, 1] = wanted[i, 0], wanted[i, 1]
        velocity[body, 0], velocity[body, 1] = will[i, 0], will[i, 1]


@exact
def _follow(
    found: Matrix,
    will: Matrix,
    group: Indices,
    wanted: Matrix,
    speed: Vector,
    index: Indices,
    avoids: Flags,
    still: Flags,
    position: Matrix,
    velocity: Matrix,
    radius: Vector,
    robot: int,
    discs: Matrix,
    boxes: Matrix,
    law: SocialForce,
):
    """Writes to `found` (n, 2) a group's wills after PERIOD under a law, no faster than its `excess` times the wanted.

    `wanted`, `speed`, `index`, `avoids` and `still` are of all n people, `position`, `velocity` and `radius` of all
    bodies. Who slows down to stand comes to rest in STANDING_TIME where the form has no relaxation time.
    """
    push = accelerations(
        position, velocity, radius, index[group], wanted[group], will[group], avoids[group], still[group], robot,
        discs, boxes, law,
    )  # fmt: skip
    for g in range(len(group)):
        i = group[g]
        size = np.hypot(wanted[i, 0], wanted[i, 1])
        stands = not law.relaxation_time > 0.0 and size < (1.0 - 1e-9) * speed[i]
        for k in range(2):
            a = push[g, k]
            if stands:
                a += (wanted[i, k] - will[i, k]) / STANDING_TIME - law.drive * wanted[i, k]
            found[i, k] = will[i, k] + PERIOD * a
        fastest = law.excess * max(speed[i], size)
        share = min(1.0, fastest / max(np.hypot(found[i, 0], found[i, 1]), 1e-9))
        found[i, 0] *= share
        found[i, 1] *= share


def law_of(keys: SocialForceKeys) -> SocialForce:
    """The constants of a run file's form, with those that the file gives in their place."""
    law, given = FORMS[keys.form], keys.constants
    if "field_of_view" in given:
        given["view_cosine"] = cos(0.5 * given.pop("field_of_view"))
    if "relaxation_time" in given:
        given["drive"] = 0.0
    elif "drive" in given:
        given["relaxation_time"] = 0.0
    return law._replace(**given, personal_space=keys.personal_space)
