"""Where people walk straight to, on their ways around walls and furniture."""

from math import nan

import numpy as np

from mjnav.compile.compiled import Flags, Indices, Matrix, Vector, exact
from mjnav.geometry.floor import is_open
from mjnav.geometry.shortest_way import WayMap
from mjnav.messages import Array
from mjnav.scene.people import REACHED
from mjnav.scene.spec import Scenario
from mjnav.scene.ways import end_of, ways_of

NEAR = 0.3  # [m] before a corner from which the person looks past it at every decision
LOOK = 5  # decisions, 0.1 s, after which people look whether something stands in their way
REPLAN = 25  # decisions, 0.5 s, after which people on a way around look for a better corner
_KEPT = 1000  # goals of which the distances are kept


class Guide:
    """The points that n people walk straight to, towards goals of their own.

    A person walks straight to the goal as long as the straight line is free. From then on, until the goal changes, the
    person is on a way around: to the corner that is in sight and from which the shortest way is left, whatever pushed
    the person from the way before.
    """

    def __init__(self, scenario: Scenario, index: Indices):
        """For the people with these places in `scenario.people`."""
        self._ways = ways_of(scenario.walls, scenario.tables, scenario.pillars)
        self._floor = self._ways.floor
        self._blocks = len(self._floor.discs) + len(self._floor.boxes) > 0
        self._radius = np.array([scenario.people[i].radius for i in index], float)
        self._decisions = 0
        self._goals = np.full((len(index), 2), nan)
        self._points = self._goals.copy()
        self._around, self._asking = np.zeros((2, len(index)), bool)
        self._known: dict[tuple[WayMap, tuple[float, float]], tuple[Array, Array]] = {}

    def towards(self, positions: Array, goals: Array) -> Array:
        """(n, 2) [m] for people at `positions` (n, 2) with `goals` (n, 2): the goal, or a corner on the way to it.

        It is `goals` itself where everybody walks straight. Asked once each decision. Positions of people who are not
        there are NaN.
        """
        if not self._blocks:
            return goals
        decision = self._decisions
        self._decisions += 1
        asks, turns_aside = _look(
            positions,
            goals,
            self._goals,
            self._points,
            self._around,
            self._asking,
            self._radius,
            decision,
            self._floor.discs,
            self._floor.boxes,
        )
        for i in np.flatnonzero(self._asking) if asks else ():
            self._points[i], self._around[i] = self._planned(positions[i], goals[i], float(self._radius[i]))
        return self._points.copy() if asks or turns_aside else goals

    def _planned(self, position: Array, goal: Array, radius: float) -> tuple[Array, bool]:
        """The next point, and whether it is a corner; the goal where there is no way at all."""
        for ways in self._ways.maps(radius):
            found = self._known_way(ways, goal)
            if found is not None:
                end, distances = found
                point = ways.next_point(position, end, distances)
                if point is not None:
                    return point, not np.array_equal(point, end)
        return goal, False

    def _known_way(self, ways: WayMap, goal: Array) -> tuple[Array, Array] | None:
        """The free place at a goal, and every corner's distance from it."""
        x, y = goal.tolist()
        key = ways, (x, y)
        if key not in self._known:
            end = end_of(ways, (x, y))
            if end is None:
                return None
            if len(self._known) >= _KEPT:
                self._known.clear()
            self._known[key] = end, ways.distances(end)
        return self._known[key]


@exact
def _look(
    positions: Matrix,
    goals: Matrix,
    known: Matrix,
    points: Matrix,
    around: Flags,
    asking: Flags,
    radius: Vector,
    decision: int,
    discs: Matrix,
    boxes: Matrix,
):
    """Sends everybody straight to new goals, and finds who is `asking` for a corner.

    Returns whether anybody asks, and whether anybody is on the way to another point than the goal.
    """
    asks, turns_aside = False, False
    for i in range(len(goals)):
        x, y = positions[i, 0], positions[i, 1]
        fresh = known[i, 0] != goals[i, 0] or known[i, 1] != goals[i, 1]
        if fresh:
            known[i, 0], known[i, 1] = goals[i, 0], goals[i, 1]
            points[i, 0], points[i, 1] = goals[i, 0], goals[i, 1]
            around[i] = False
        asking[i] = False
        dx, dy = points[i, 0] - x, points[i, 1] - y
        distance = np.sqrt(dx * dx + dy * dy)
        if around[i] and (distance < NEAR or (decision + i) % REPLAN == 0):
            asking[i] = True
        elif fresh or (decision + i) % LOOK == 0:
            # The last part before a waypoint does not count, because the person turns there.
            share = 0.0 if around[i] else min(REACHED / distance, 1.0) if distance > 0.0 else 1.0
            end_x, end_y = points[i, 0] - share * dx, points[i, 1] - share * dy
            if not is_open(x, y, end_x, end_y, radius[i], discs, boxes):
                around[i] = asking[i] = True
        asks = asks or asking[i]
        turns_aside = turns_aside or points[i, 0] != goals[i, 0] or points[i, 1] != goals[i, 1]
    return asks, turns_aside
