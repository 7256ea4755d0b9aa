"""The way to the goal for every method: planned on what the robot knows, planned again where it is blocked.

    field     what a way costs from everywhere to the route's next point, around all that stands      (`way_field`)
    point     the farthest point of the way from where the robot is that it can drive to straight, at most `ahead` of it

Methods that look one step ahead drive to the point as to a goal; planners take the whole field. What stands is the
robot's map, with what its scans have added where it draws one, and people who have stood for STOOD: they may stay. A
person who walks is the method's affair. The field is planned again where any of it changed, at most every AGAIN.

Without progress for `patience` the robot recovers: it turns towards the way, the next time backs off if it can, and
waits otherwise. A differential-drive robot turns on the spot, which touches nothing.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mjnav.geometry.angles import wrap
from mjnav.geometry.distance_field import DistanceField, FieldGrid
from mjnav.geometry.floor import Floor, floor_of_map
from mjnav.geometry.way_field import BLOCKED, CELL, MAX_CELLS, WayField
from mjnav.messages import Array, Decision, Event, KnownMap, RobotLimits, Status, Track, Way
from mjnav.scene.bodies import Wall, wall_box
from mjnav.scene.route import Route
from mjnav.scene.ways import floor_of
from mjnav.sealed import sealed

STOOD = 2.0  # [s] of standing after which somebody is in the way
STANDS = 0.2  # [m/s] below which somebody stands
MOVED = 0.3  # [m] by which they have left their place
AGAIN = 0.5  # [s] between two plans
STEP = 0.1  # [m] along the way
PROGRESS = 0.25  # [m] of way that is one
TURNED = 0.2  # [rad] off the way's direction at which a recovery by turning ends
RECOVERY = 3.0  # [s] that a recovery takes at most
BACK = 0.2  # [m/s] of backing off


def _unseen_floor(strips: Sequence[Wall]) -> FieldGrid | None:
    """1 on strips of floor, and 0 elsewhere within their bounds."""
    if not strips:
        return None
    floor = floor_of(wall_box("", strip) for strip in strips)
    bounds = floor.bounds
    assert bounds is not None
    low, sides = bounds[0], bounds[1] - bounds[0]
    cell = max(CELL, float(sides.max()) / (MAX_CELLS - 1))
    columns, rows = np.ceil(sides / cell).astype(int) + 1
    grid = FieldGrid(np.empty((rows, columns)), float(low[0]), float(low[1]), cell)
    return grid._replace(clearance=(floor.clearance(DistanceField(grid).nodes) <= 0.0).astype(float))


class Wayfinder:
    """The way of one run."""

    def __init__(self, route: Route, limits: RobotLimits):
        self._route, self._limits = route, limits
        self._unseen = _unseen_floor(route.unseen or ())
        self._field: WayField | None = None
        self._way: Way | None = None
        self._planned = -np.inf  # [s]
        self._known: KnownMap | None = None  # that it was planned on
        self._blocked: tuple[bytes, bytes] = (b"", b"")  # the goal, and who stands, that it was planned with
        self._floor = Floor(np.zeros((0, 3)), np.zeros((0, 6)))
        self._standing: dict[str, tuple[Array, float]] = {}  # where and since when, by name
        self._best, self._since = np.inf, 0.0  # least way left [m], and when it was reached
        self._recovering: tuple[str, float] | None = None  # how, and until when
        self._tries = 0
        self._events: list[Event] = []

    def follow(
        self,
        now: float,
        pose: Array,
        goal: Array,
        known: KnownMap,
        people: Sequence[Track],
        unseen: FieldGrid | None = None,
    ) -> None:
        """What is known at `now` [s]: the robot's pose (3,), the route's next point (2,), the map, and who is there.

        `unseen` is 1 where a map that the robot draws has nothing yet, and 0 elsewhere; without one it is the route's.
        """
        unseen = self._unseen if unseen is None else unseen
        standing = self._who_stands(now, people)
        key = (goal.tobytes(), standing.tobytes())
        new_goal = key[0] != self._blocked[0]
        changed = key != self._blocked or known is not self._known
        if new_goal or (changed and now >= self._planned + AGAIN - 1e-9):
            if self._field is not None and not new_goal and key != self._blocked:
                text = "around people who stand" if len(standing) else "as nobody stands in the way any more"
                self._events.append(Event("info", "route", f"planned again, {text}"))
            self._plan(now, pose, goal, known, standing, unseen)
            self._blocked = key
        self._watch(now, pose, new_goal)

    @property
    def minds_unseen(self) -> bool:
        """Whether a way over unseen floor costs more than its length."""
        return self._route.unknown > 1.0

    def _who_stands(self, now: float, people: Sequence[Track]) -> Array:
        """Those who have stood for STOOD, as discs (k, 3)."""
        there = {person.name: person for person in people}
        self._standing = {name: place for name, place in self._standing.items() if name in there}
        for name, person in there.items():
            place = self._standing.get(name)
            away = place is None or np.hypot(*(person.mean[:2] - place[0])) > MOVED
            if away and np.hypot(*person.mean[2:]) < STANDS:
                self._standing[name] = (person.mean[:2].copy(), now)
            elif away:
                self._standing.pop(name, None)
        long = [(*at, there[name].radius) for name, (at, since) in self._standing.items() if now >= since + STOOD]
        return np.array(long, float).reshape(-1, 3)

    def _plan(
        self, now: float, pose: Array, goal: Array, known: KnownMap, standing: Array, unseen: FieldGrid | None
    ) -> None:
        floor = floor_of_map(known)
        self._floor = Floor(np.concatenate([floor.discs, standing]), floor.boxes)
        radius = self._limits.half_width
        dear = {} if unseen is None else {"unseen": unseen, "factor": self._route.unknown}
        self._field = field = WayField.of(self._floor, goal, radius, pose[None, :2], soft=self._route.clearance, **dear)
        grid, number = field.grid, 0 if self._way is None else self._way.number + 1
        corner, line = np.array([grid.x, grid.y]), field.followed(pose[:2], 2.0 * STEP)
        self._way = Way(number, sealed(goal), sealed(grid.detour), sealed(corner), grid.cell, sealed(line))
        self._planned, self._known = now, known

    def _watch(self, now: float, pose: Array, new_goal: bool) -> None:
        """Begins and ends recoveries."""
        assert self._field is not None
        left = float(self._field.way_left(pose[:2])[0])
        if new_goal or left < self._best - PROGRESS or self._recovering is not None:
            self._best, self._since = left, now
            self._tries = 0 if self._recovering is None else self._tries
        if self._recovering is not None:
            how, until = self._recovering
            if now >= until - 1e-9 or (how == "turn" and abs(self._turn(pose)) < TURNED):
                self._recovering = None
        elif now - self._since >= self._route.patience - 1e-9:
            hows = ("turn", "back off" if self._limits.min_speed < 0.0 else "wait")
            how = hows[self._tries % len(hows)]
            self._recovering, self._tries, self._best = (how, now + RECOVERY), self._tries + 1, np.inf
            more = ", and no way is free" if left > BLOCKED * STEP + np.hypot(*(self._way_point() - pose[:2])) else ""
            text = f"no progress for {self._route.patience:g} s{more}: the robot recovers ({how})"
            self._events.append(Event("warning", "route", text))

    def _way_point(self) -> Array:
        assert self._way is not None
        return self._way.point

    def _turn(self, pose: Array) -> float:
        """From the robot's heading to the way's direction [rad]."""
        assert self._field is not None
        x, y = self._field.direction(pose[:2])[0]
        return float(wrap(np.arctan2(y, x) - pose[2]))

    def ahead(self, position: Array) -> tuple[Array, Way]:
        """Where to drive from `position` (2,): a point on the way (2,), and the way."""
        assert self._field is not None
        assert self._way is not None
        goal, at, found = self._way.point, position, None
        for _ in range(int(np.ceil(self._route.ahead / STEP))):
            at = goal if np.hypot(*(goal - at)) <= STEP else at + STEP * self._field.direction(at)[0]
            if found is None or self._floor.blocking(position, at, self._limits.half_width) is None:
                found = at
            if at is goal:
                break
        return goal if found is None else found, self._way

    def recovered(self, decision: Decision, pose: Array) -> Decision:
        """The decision, or what a recovery that is under way does in its place."""
        if self._recovering is None:
            return decision
        how = self._recovering[0]
        v, omega = 0.0, 0.0
        if how == "turn":
            omega = float(np.copysign(0.5 * self._limits.max_turn_rate, self._turn(pose)))
        elif how == "back off":
            v = max(self._limits.min_speed, -BACK)
        status = Status.STOPPED if v == omega == 0.0 else decision.status
        wish = decision.wish or (decision.v, decision.omega)
        return replace(decision, v=v, omega=omega, status=status, wish=wish, recovery=how)

    def take_events(self) -> tuple[Event, ...]:
        """What was planned again, and recoveries, since the last call."""
        events, self._events = tuple(self._events), []
        return events
