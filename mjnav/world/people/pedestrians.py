"""All people of a scene in a run: each with their behaviour; they enter, leave, and go round people whom they touch.

A user's own behaviour gives a person's desired velocity.

People who touch get past one another: a person who walks into another goes round them. This is a layer over any
behaviour, for both engines: bodies do not overlap, and two people who meet head-on would otherwise push against each
other for the rest of the run.

People enter, leave, and come again elsewhere. A newcomer waits until the place is free: of walls and furniture, ROOM
from everybody, and from the robot as far as the file says. A replayed newcomer waits on their track: they come in where
the track has led meanwhile, as near to others as touching. A person who has left stays away for a reading of the
sensors and a tick of the loop, so that trackers drop the track and nobody jumps from one tick to the next.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from math import hypot
from typing import Any

import numpy as np

from mjnav.compile.compiled import Flags, Indices, Matrix, Vector, exact
from mjnav.errors import PluginFault
from mjnav.messages import Array, WorldState
from mjnav.rng import stream
from mjnav.scene.crowd import TrackSplines
from mjnav.scene.people import AGAIN, CLEAR_OF_ROBOT, MAX_WALKING_SPEED, PERIOD, Area, Behaviour, Replay, Walker
from mjnav.scene.ranges import Point
from mjnav.scene.spec import Scenario
from mjnav.scene.ways import ways_of
from mjnav.sealed import checked_copy, sealed, sealed_message
from mjnav.settings.plugins import BehaviourPlugin
from mjnav.world.engine import Engine
from mjnav.world.people.temperament import Temperaments
from mjnav.world.people.walk import Walk

# ----------------------------------------------------------------------- behaviours of a user's own


class OwnWalk(Walk):
    """The desired velocities of the people who have behaviours of a user's own."""

    def __init__(self, scenario: Scenario, index: Indices, seed: int):
        super().__init__(scenario, index, seed)
        self._walks: list[tuple[str, Any]] = [_made(scenario, int(i), seed) for i in index]

    def velocities(self, world: WorldState) -> Array:
        """See `Walk`. Raises PluginFault for what is no velocity."""
        world = sealed_message(world)
        found = np.zeros((len(self._walks), 2))
        for i, (name, walk) in enumerate(self._walks):
            if not np.isnan(world.people_position[self.index[i], 0]):
                with PluginFault.told(name, "velocity()"):
                    found[i] = _checked(name, walk.velocity(world))
        return found


def _made(scenario: Scenario, person: int, seed: int) -> tuple[str, Any]:
    behaviour = scenario.people[person].behaviour
    assert isinstance(behaviour, BehaviourPlugin)
    return behaviour.name, behaviour.make(scenario, person, stream(seed, "behaviour", f"person{person}"))


def _checked(name: str, velocity: Any) -> Sequence[float]:
    vx, vy = checked_copy(f"{name}: velocity()", velocity, (2,)).tolist()
    if hypot(vx, vy) > MAX_WALKING_SPEED:
        raise PluginFault(f"{name}: velocity() returned ({vx}, {vy}), not at most {MAX_WALKING_SPEED:g} m/s")
    return vx, vy


# --------------------------------------------------------------------- going round whom one touches


TOUCHING = 0.05  # [m] between two people's surfaces below which they touch
AHEAD = 0.3  # cosine of the angle between the way and the other person, above which they are in the way: 73 degrees
SIDEWAYS = 0.6  # share of the speed with which somebody steps to the side, at least


def sidestepped(desired: Array, position: Array, radii: Array, straight: Array) -> Array:
    """Desired velocities (P, 2) [m/s] of people at position (P, 2) [m] with radii (P,) who go round whom they touch.

    With n towards the nearest of those who are touched and in the way (d.n > AHEAD |d|), and t across it, the velocity
    becomes s |d| max(|d.t| / |d|, SIDEWAYS) t, where s is the side of d.t; to the right where d.t = 0. Who walks
    `straight` (P,) does not.
    """
    if len(desired) < 2:
        return desired
    return _sidestepped(np.ascontiguousarray(desired), np.ascontiguousarray(position), radii, straight)


@exact
def _sidestepped(desired: Matrix, position: Matrix, radii: Vector, straight: Flags):
    num_people = len(desired)
    turned = desired.copy()
    for i in range(num_people):
        if straight[i]:
            continue
        speed = np.hypot(desired[i, 0], desired[i, 1])
        nearest = TOUCHING
        for j in range(num_people):
            reach = radii[i] + radii[j] + TOUCHING
            x, y = position[j, 0] - position[i, 0], position[j, 1] - position[i, 1]
            if j == i or not (abs(x) < reach and abs(y) < reach):  # nor with somebody who is not there
                continue
            distance = np.hypot(x, y)
            gap = distance + TOUCHING - reach
            ahead = desired[i, 0] * x + desired[i, 1] * y
            if gap < nearest and ahead > AHEAD * speed * distance:
                nearest = gap
                right = (desired[i, 0] * y - desired[i, 1] * x) / distance  # d.t with t = (y, -x) / distance
                side = 1.0 if right >= 0.0 else -1.0
                share = side * max(abs(right), SIDEWAYS * speed) / distance
                turned[i, 0], turned[i, 1] = share * y, -share * x
    return turned


# ----------------------------------------------------------------------------- entering and leaving


ROOM = 0.1  # [m] between a newcomer and other people, surface to surface; none for people of a recording
ROOM_OF_ROBOT = 0.5  # [m] between a newcomer and the robot, surface to surface
TRIES = 32  # ways drawn for each trip, of which the first that is free is taken: equally many whatever is free


@dataclass(frozen=True, slots=True)
class Newcomer:
    """Somebody who comes in; `goal` is None for who enters for the first time."""

    person: int
    start: Point
    goal: Point | None


def comes_or_goes(scenario: Scenario) -> bool:
    """Whether anybody of the scene enters or leaves."""
    return any(
        person.enters is not None
        or person.leaves is not None
        or (isinstance(person.behaviour, Walker) and person.behaviour.leaves_within is not None)
        for person in scenario.people
    )


class Presence:
    """Who is there, who comes and who goes."""

    def __init__(self, scenario: Scenario, seed: int):
        self._people = scenario.people
        self._enters = np.array([person.enters or 0.0 for person in scenario.people])
        self._leaves = np.array([np.inf if person.leaves is None else person.leaves for person in scenario.people])
        self.present: Flags = np.array([person.from_the_start for person in scenario.people])  # (P,)
        self._radii = np.array([person.radius for person in scenario.people])
        self._robot_radius = scenario.robot.radius
        self._ways = ways_of(scenario.walls, scenario.tables, scenario.pillars)
        self._floor = self._ways.floor
        self._rngs = [stream(seed, "people.again", f"person{i}") for i in range(len(scenario.people))]
        self._pause = max(1.0 / scenario.sensors.rate, scenario.control.period)  # [s]
        tracks = {i: one.behaviour.track for i, one in enumerate(self._people) if isinstance(one.behaviour, Replay)}
        self._replayed = {person: row for row, person in enumerate(tracks)}
        self._splines = TrackSplines([np.array(track) for track in tracks.values()]) if tracks else None
        self.stranded: tuple[int, ...] = ()  # who stay away for good: none of the ways drawn for them can be walked
        # Who will come, with their ways, (start, goal) each, and when they may [s].
        self._waiting: dict[int, tuple[list[tuple[Point, Point | None]], float]] = {
            i: ([(scenario.people[i].start, None)], float(self._enters[i]))
            for i in np.flatnonzero(~self.present).tolist()
        }

    def leaving(self, world: WorldState, arrived: Flags) -> list[int]:
        """Who leaves now: those whose time is over, and those who have `arrived` (P,)."""
        goes = self.present & (arrived | (world.time >= self._leaves - 1e-9))
        going = np.flatnonzero(goes).tolist() if goes.any() else []
        for i in going:
            self.present[i] = False
            walk = self._people[i].behaviour
            if isinstance(walk, Walker) and walk.at_end == AGAIN and world.time < self._leaves[i] - 1e-9:
                ways = self._drawn(i, walk)
                if any(self._leads(i, *way) for way in ways):
                    self._waiting[i] = ways, world.time + self._pause
                else:
                    self.stranded += (i,)
        return going

    def coming(self, world: WorldState) -> list[Newcomer]:
        """Who comes in now, in the order of the scenario; the positions of `world` hold those who are there."""
        positions, found = world.people_position.copy(), []
        for i, (ways, earliest) in sorted(self._waiting.items()):
            if world.time < earliest - 1e-9:
                continue
            if world.time >= self._leaves[i] - 1e-9:
                del self._waiting[i]
                continue
            room = ROOM_OF_ROBOT + self._radii[i] + self._robot_radius
            walk = self._people[i].behaviour
            if isinstance(walk, Walker) and ways and ways[0][1] is not None:
                room = max(room, CLEAR_OF_ROBOT if walk.clear_of_robot is None else walk.clear_of_robot)
            if self._splines is not None and i in self._replayed:
                x, y = self._splines.positions(world.time)[self._replayed[i]].tolist()
                ways = [((x, y), None)] if self._floor.clearance(np.array([[x, y]]))[0] >= self._radii[i] else []
            free = next(
                (
                    way
                    for way in ways
                    if self._is_free(i, way[0], room, positions, world.robot_pose) and self._leads(i, *way)
                ),
                None,
            )
            if free is not None:
                del self._waiting[i]
                self.present[i] = True
                positions[i] = free[0]
                found.append(Newcomer(i, *free))
        return found

    def _is_free(self, person: int, start: Point, room: float, positions: Array, robot_pose: Array) -> bool:
        """Whether a person may come in at `start`, `room` [m] from the robot's centre."""
        if np.hypot(*(robot_pose[:2] - start)) < room:
            return False
        gaps = np.hypot(*(positions - start).T) - self._radii - self._radii[person]
        return not (gaps < (0.0 if person in self._replayed else ROOM)).any()  # NaN for who is not there

    def _leads(self, person: int, start: Point, goal: Point | None) -> bool:
        """Whether the person can walk from the start to the goal, if there is one."""
        radius = float(self._radii[person])
        if goal is None or self._floor.blocking(start, goal, radius) is None:
            return True
        return self._ways.plan(start, goal, radius) is not None

    def _drawn(self, person: int, walk: Walker) -> list[tuple[Point, Point | None]]:
        """TRIES ways, without those that begin or end in walls or furniture."""
        rng, known = self._rngs[person], list(walk.trips or ())
        trips = [known[k] for k in rng.integers(len(known), size=TRIES)]
        uniform = rng.random((TRIES, 2, 2))
        starts = np.array([_at(trip.start, share) for trip, share in zip(trips, uniform[:, 0], strict=True)])
        goals = np.array([_at(trip.goal, share) for trip, share in zip(trips, uniform[:, 1], strict=True)])
        free = np.minimum(self._floor.clearance(starts), self._floor.clearance(goals)) >= self._radii[person]
        ways = zip(starts[free].tolist(), goals[free].tolist(), strict=True)
        return [((x, y), (to_x, to_y)) for (x, y), (to_x, to_y) in ways]


def _at(area: Area, share: Array) -> Array:
    """The point of an area at shares (2,) of its sides."""
    first, second = np.array(area)
    return first + share * (second - first)


# --------------------------------------------------------------------------------------- all people


def _made_walk(behaviour: Behaviour | BehaviourPlugin, scenario: Scenario, index: Indices, seed: int) -> Walk:
    """The walk that a behaviour names, for all people who have it."""
    module, _, name = behaviour.walk.partition(":")
    return getattr(import_module(f"mjnav.world.people.{module}"), name)(scenario, index, seed)


class Pedestrians:
    """The people, in groups that have one behaviour and all see the robot or all do not."""

    period = PERIOD  # [s] between decisions
    first = False  # whether they decide before the sensors read
    radius = None  # (P,) [m] where it changes in a run

    def __init__(self, scenario: Scenario, seed: int):
        people = scenario.people
        self._radii = np.array([person.radius for person in people], float)
        self._groups: list[tuple[Indices | slice, bool, Walk, Temperaments | None]] = []
        self._straight = np.zeros(len(people), bool)  # who do not go round whom they touch
        kinds = [(type(person.behaviour), person.sees) for person in people]
        for kind in dict.fromkeys(kinds):
            index = np.array([i for i, other in enumerate(kinds) if other == kind])
            first, last = int(index[0]), int(index[-1]) + 1
            together = last - first == len(index)  # a slice is written to in a third of the time
            place = slice(first, last) if together else index
            sees = kind[1]
            walk = _made_walk(people[first].behaviour, scenario, index, seed)
            temperaments = None if walk.tempers or not sees else Temperaments(scenario, index)
            self._straight[place] = not walk.sidesteps
            self._groups.append((place, sees or not walk.heeds_robot, walk, temperaments))
        self._shows_all = all(shown for _, shown, _, _ in self._groups)
        self._unseen = sealed(np.full(3, np.nan)), sealed(np.full(2, np.nan))  # pose and twist of the robot
        self._presence = Presence(scenario, seed) if comes_or_goes(scenario) else None

    @property
    def stranded(self) -> tuple[int, ...]:
        """Who were to come again and stay away for good, as none of the ways drawn for them can be walked."""
        return () if self._presence is None else self._presence.stranded

    def at_start(self, world: WorldState) -> tuple[WorldState, Array]:
        """The world without those who are not there from the beginning, and everybody's desired velocity, (P, 2)."""
        if self._presence is not None:
            world = _placed(world, dict.fromkeys(np.flatnonzero(~self._presence.present).tolist(), (np.nan, np.nan)))
        return world, self.velocities(world)

    def decide(self, world: WorldState, engine: Engine) -> None:
        """Lets people come and go, and tells the engine how all of them want to walk."""
        if self._presence is None:
            engine.walk(self.velocities(world))
            return
        arrived = np.zeros(len(self._radii), bool)
        for place, _, walk, _ in self._groups:
            arrived[place] = walk.arrived(world)
        leaving = self._presence.leaving(world, arrived)
        for person in leaving:
            engine.remove(person)
        world = _placed(world, dict.fromkeys(leaving, (np.nan, np.nan)))
        coming = self._presence.coming(world)
        for newcomer in coming:
            if newcomer.goal is not None:
                walk, place = self._walk_of(newcomer.person)
                walk.begin(place, newcomer.start, newcomer.goal)
        world = _placed(world, {newcomer.person: newcomer.start for newcomer in coming})
        desired = self.velocities(world)
        for newcomer in coming:
            engine.place(newcomer.person, newcomer.start, desired[newcomer.person])
        engine.walk(desired)

    def _walk_of(self, person: int) -> tuple[Walk, int]:
        """A person's walk, and the place in it."""
        for _, _, walk, _ in self._groups:
            if (found := np.flatnonzero(walk.index == person)).size:
                return walk, int(found[0])
        raise LookupError(f"person{person} has no walk")

    def velocities(self, world: WorldState) -> Array:
        """Desired velocities of all people, (P, 2) [m/s]; zero for those who are not there."""
        desired = np.zeros((len(self._radii), 2))
        pose, twist = self._unseen
        unseen = world if self._shows_all else replace(world, robot_pose=pose, robot_twist=twist)
        for place, shown, walk, temperaments in self._groups:
            wanted = walk.velocities(world if shown else unseen)
            desired[place] = wanted if temperaments is None else temperaments.applied(world, wanted)
        if self._presence is not None:
            desired[~self._presence.present] = 0.0
        return sidestepped(desired, world.people_position, self._radii, self._straight)


def _placed(world: WorldState, places: Mapping[int, Point]) -> WorldState:
    """The world with some people at other places, at rest; NaN for who is not there."""
    if not places:
        return world
    position, velocity = world.people_position.copy(), world.people_velocity.copy()
    for person, place in places.items():
        position[person] = place
        velocity[person] = 0.0 * position[person]
    return replace(world, people_position=position, people_velocity=velocity)
