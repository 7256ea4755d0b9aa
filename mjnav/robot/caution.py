"""A robot that does not know enough drives more slowly, or stops.

Whatever method decides, its decision stands as long as the robot knows what the method is told. It stops

* without anything usable of a sensor that its estimators go by for PATIENCE,
* where it goes by its lidar and its belief of its own position is wider than MAX_POSITION_STD or MAX_HEADING_STD, or
  more than OFF_MAP of its scan is not where the map would have it: it is somewhere else, or its lidar is wrong,
* where it goes by its lidar and wheels and gyro contradict each other, as when a wheel slips: then it does not go where
  it is sent. At rest they agree, so it stays for a while, for twice as long each time.

And where it goes by its lidar it drives no faster than lets it stop within what its latest scan saw as free on its arc:

    v^2 / (2 a) + max(v, u) L <= d

with a the base's acceleration, u the speed that was decided before, L the time until a next decision can take effect,
and d the way to what the method is not told of (`seen_space`); without a map, also to a cell short of where no scan has
seen the floor free (`local_map`). It brakes by its command; the base ramps towards that at its acceleration limit. It
drives on as soon as it knows again.
"""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mjnav.geometry.distances import widest_std
from mjnav.messages import Beliefs, Decision, Event, Reading, RobotBelief, Status
from mjnav.robot.estimation import assumed_noise
from mjnav.robot.sanity import Sanity
from mjnav.robot.seen_space import SeenSpace
from mjnav.scene.spec import Scenario

if TYPE_CHECKING:
    from mjnav.robot.estimation.lidar.local_map import LocalMap

PATIENCE = 0.5  # [s]; somebody unseen walks 0.7 m in it, and the robot needs 0.8 s more to stop from 0.8 m/s
MAX_POSITION_STD = 0.5  # [m] of the widest direction: a person's width, the room that a robot has in a doorway
MAX_HEADING_STD = 0.5  # [rad]: half a metre to the side after a metre
OFF_MAP = 0.7  # of a scan's returns; in a crowd up to a half are people, of a robot that was carried away 0.9 are off
CONFLICTS = 3  # readings in a row in which wheels and gyro contradict each other: one or two are the tails of noise
FIRST_REST, LONGEST_REST = 1.0, 30.0  # [s] that the robot then stays
SPEEDS = 8  # parts of the decided speed that are tried from the fastest on
CALM = 1.0  # [s] without a limit after which the log says that the robot drives on


class Caution:
    """Limits one run's decisions."""

    def __init__(self, scenario: Scenario, sanity: Sanity):
        robot, obstacles = scenario.estimation.robot, scenario.estimation.obstacles
        self._sanity = sanity
        self._limits, self._period = scenario.robot.limits, scenario.control.period
        sensors = {"pose": "pose", "direct": "pose", "detections": "detections", "lidar": "scan"}
        people = {**sensors, "direct": "detections"}
        self._needs: dict[str, float] = {}  # [s] that the robot waits for each sensor
        if robot.localizer is None:
            self._needs[sensors[robot.source]] = PATIENCE
        if obstacles.tracker is None:
            self._needs[people[obstacles.source]] = PATIENCE
        self._by_lidar = robot.localizer is None and robot.source == "lidar"
        self._space: SeenSpace | None = None
        self._local: LocalMap | None = None  # that the robot draws
        if "scan" in self._needs:
            rate = scenario.sensors.scanner.rate
            self._needs["scan"] += 0.0 if rate is None else 2.0 / rate  # a scan is that old before the next is whole
            self._space = SeenSpace(scenario, assumed_noise(scenario))
        self._conflicts, self._rest, self._rests_until = 0, 0.5 * FIRST_REST, -np.inf
        self._stopped: dict[str, float] = {}  # [s] of the latest stop for each kind of cause that the log tells
        self._events: list[Event] = []

    def follow(self, reading: Reading, beliefs: Beliefs) -> None:
        """One more reading that was checked, and what the robot believes after it."""
        if self._space is None:
            return
        self._space.follow(reading, beliefs.robot.mean, beliefs.people)
        self._conflicts = self._conflicts + 1 if self._space.contradicts else 0
        if self._conflicts == CONFLICTS:
            self._rest = min(2.0 * self._rest, LONGEST_REST)
            self._rests_until = reading.time + self._rest

    def learn(self, local: "LocalMap") -> None:
        """The map as the robot has it now."""
        self._local = local
        if self._space is not None:
            self._space.floor = local.floor

    def limited(self, decision: Decision, belief: RobotBelief, effect: float, before: float = 0.0) -> Decision:
        """The decision, or a slower one with its cause; `effect` is when it takes effect [s].

        `before` [m/s] is the speed that was decided before.
        """
        now = belief.time
        cause = self._ignorance(belief, now)
        v, omega = (0.0, 0.0) if cause else (decision.v, decision.omega)
        kind = cause.partition(" ")[0]
        if not cause and self._space is not None and v != 0.0:
            v = self._within_sight(self._space, v, omega, belief, effect - now + self._period, before)
            if v != decision.v:
                cause, kind = "less seen ahead than it takes to stop", "seen"
        if not cause:
            self._calm(now)
            return decision
        stops = v == 0.0
        if stops:
            self._tell(kind, cause, now)
        else:
            self._calm(now)
        wish = decision.wish or (decision.v, decision.omega)
        status = Status.STOPPED if stops else decision.status
        return replace(decision, v=v, omega=omega, status=status, wish=wish, caution=cause)

    def take_events(self) -> tuple[Event, ...]:
        """Why the robot stopped and that it drives on, since the last call."""
        events, self._events = tuple(self._events), []
        return events

    def _ignorance(self, belief: RobotBelief, now: float) -> str:
        """Why the robot does not know enough to drive at all; empty where it does."""
        for sensor, patience in self._needs.items():
            missing = self._sanity.missing(sensor, now)
            if sensor == "scan" and self._space is not None:
                missing = max(missing, self._space.age(now))
            if missing > patience + 1e-9:
                return f"{sensor}: nothing usable for more than {patience:.1f} s"
        if now < self._rests_until:
            return "wheels and gyro contradict each other"
        if not self._by_lidar:
            return ""
        if self._space is not None and self._space.off_map > OFF_MAP:
            return "the scan is not that of the map"
        position, heading = widest_std(belief.covariance), float(np.sqrt(max(belief.covariance[2, 2], 0.0)))
        if position > MAX_POSITION_STD:
            return f"position known to {position:.1f} m only"
        return "" if heading <= MAX_HEADING_STD else f"heading known to {heading:.1f} rad only"

    def _within_sight(
        self, space: SeenSpace, v: float, omega: float, belief: RobotBelief, delay: float, before: float
    ) -> float:
        """The fastest of the parts of v [m/s] at which the robot can stop within what was seen as free on its arc."""
        for part in np.linspace(1.0, 0.0, SPEEDS, endpoint=False):
            slower = float(part) * v
            until = max(abs(slower), abs(before)) * delay
            needed = slower * slower / (2.0 * self._limits.max_acceleration) + until
            if space.free_way(belief.time, slower, omega, self._limits.discs) < needed:
                continue
            if self._local is None or self._local.is_free(belief.mean, slower, omega, needed):
                return slower
        return 0.0

    def _tell(self, kind: str, cause: str, now: float) -> None:
        if kind not in self._stopped:
            self._events.append(Event("warning", "caution", f"the robot stops: {cause}"))
        self._stopped[kind] = now

    def _calm(self, now: float) -> None:
        if self._stopped and now - max(self._stopped.values()) >= CALM - 1e-9:
            self._stopped.clear()
            self._events.append(Event("info", "caution", "the robot drives on"))
