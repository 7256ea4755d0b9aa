"""Who is in the scene: people enter, leave, and come again elsewhere.

A newcomer waits until the place is free: of walls and furniture, ROOM from everybody, and from the robot as far as the
file says. Who is replayed waits on their track: they come in where it has led meanwhile, as near to others as touching.
Who has left stays away for a reading of the sensors and a tick of the loop, so that trackers drop the track and nobody
jumps from one tick to the next.
"""

from dataclasses import dataclass

import numpy as np

from mjnav.geometry.kernel_types import Flags
from mjnav.messages import Array, WorldState
from mjnav.rng import stream
from mjnav.scenarios.crowd.spline import TrackSplines
from mjnav.scenarios.people import Replay, Walker
from mjnav.scenarios.people.trips import AGAIN, CLEAR_OF_ROBOT, Area
from mjnav.scenarios.ranges import Point
from mjnav.scenarios.spec import Scenario
from mjnav.scenarios.ways import ways_of

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
        going = np.flatnonzero(self.present & (arrived | (world.time >= self._leaves - 1e-9))).tolist()
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
