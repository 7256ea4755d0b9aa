"""Events of a run for its log: contacts, goal, time-out, filters that were lost, and warnings.

The referee judges by the truth. The robot never hears of it. A time-out of a robot that waits where it believes the
goal to be is told apart: it is `believed` where the goal lies within what the belief itself says of its error.
"""

from collections.abc import Iterator, Sequence
from math import dist, inf

import numpy as np

from mjnav.geometry.distances import widest_std
from mjnav.messages import Array, Beliefs, Contact, Decision, Event, RobotBelief, Status, Track, WorldState
from mjnav.metrics.consistency import DEPLETED
from mjnav.metrics.safety import PERSON, judged
from mjnav.scene.check import HORIZON, is_avoidable, overlapping_people
from mjnav.scene.spec import Scenario

# ------------------------------------------------------------------------------------------ referee


GOAL, BELIEVED, COLLISION, TIMEOUT, ABORTED = "goal", "believed", "collision", "timeout", "aborted"
STATED = 3.0  # standard deviations of its widest direction, by which a belief may be wrong as it says itself


class Referee:
    """Watches the true states of one run."""

    def __init__(self, scenario: Scenario):
        self._goal = scenario.robot.route[-1]
        self._tolerance = scenario.robot.goal_tolerance
        self._time_limit = scenario.time_limit
        self._stop = scenario.stop_on_collision
        self._limit_first = scenario.published is not None and scenario.published.rules.limit_first

    def outcome(self, truth: WorldState, belief: RobotBelief | None, *, on_last_leg: bool) -> str | None:
        """How the run has ended, or None while it goes on. A collision counts before the goal, the goal before time.

        In the published crowds that judge so, time counts before both. `belief` is the robot's latest.
        """
        over = truth.time >= self._time_limit - 1e-9
        if over and self._limit_first:
            return TIMEOUT
        if truth.contacts and self._stop:
            return COLLISION
        if on_last_leg and self._near(truth.robot_pose, self._tolerance):
            return GOAL
        if not over:
            return None
        if on_last_leg and belief is not None and self._near(belief.mean, self._tolerance):
            stated = STATED * widest_std(belief.covariance)
            return BELIEVED if self._near(truth.robot_pose, self._tolerance + stated) else TIMEOUT
        return TIMEOUT

    def _near(self, pose: Array, distance: float) -> bool:
        dx, dy = pose[0] - self._goal[0], pose[1] - self._goal[1]
        return bool(dx * dx + dy * dy <= distance**2)


# ------------------------------------------------------------------------------------------- events


ROBOT = "robot"
MAX_NAMED = 3  # pairs of people in a warning
GIVEN = "given"  # the event of the first decision that is not the controller's


def warnings_of(scenario: Scenario) -> tuple[Event, ...]:
    """What is worth a warning before the run: people who overlap at the start, and contact that nobody can avoid."""
    return (*_overlaps(scenario), *_unavoidable(scenario))


def _unavoidable(scenario: Scenario) -> tuple[Event, ...]:
    if is_avoidable(scenario):
        return ()
    text = f"no control of the robot avoids contact in the first {HORIZON:g} s: the run is no test of a method"
    return (Event("warning", "start", text),)


def _overlaps(scenario: Scenario) -> tuple[Event, ...]:
    pairs = overlapping_people(scenario)
    if not pairs:
        return ()
    named = ", ".join(f"person{i} and person{j}" for i, j in pairs[:MAX_NAMED])
    more = f", and {len(pairs) - MAX_NAMED} more" if len(pairs) > MAX_NAMED else ""
    count = f"{len(pairs)} pairs of people overlap" if len(pairs) > 1 else "two people overlap"
    return (Event("warning", "overlap", f"{count} at the start and step apart: {named}{more}"),)


class Events:
    """The events of one run, tick by tick. A status that lasts is told once, and so are commands beyond the limits."""

    def __init__(self, sees: Sequence[bool] = (), farthest: float = inf):
        """`sees` says of each person whether they see the robot, whom a step of more than `farthest` [m] kidnapped."""
        self._sees, self._farthest = tuple(sees), farthest
        self._before: WorldState | None = None  # the truth of the tick before
        self._waiting: tuple[Event, ...] = ()
        self._status = Status.OK
        self._stranded: tuple[int, ...] = ()
        self._clipping_told = self._given_told = False
        self._depleted: set[str] = set()  # whose belief was at the last reading

    def note(self, *events: Event) -> None:
        """Events that the next tick will carry."""
        self._waiting += events

    def strand(self, people: tuple[int, ...]) -> None:
        """Who stay away for good until now, in the order in which they left; those told before are left out."""
        for i in people[len(self._stranded) :]:
            self.note(Event("warning", "people", f"person{i} stays away for good: no way leads along any trip drawn"))
        self._stranded = people

    def of_tick(
        self,
        truth: WorldState,
        beliefs: Beliefs | None,
        decision: Decision,
        *,
        updated: bool = True,
        given: bool = False,
    ) -> tuple[Event, ...]:
        """The events of one tick.

        Beliefs are not `updated` where no sensor was due; a `given` decision is no controller's.
        """
        events = [*self._waiting, *self._comings(truth), *map(self._contact, truth.contacts)]
        self._waiting, self._before = (), truth
        if beliefs is not None and updated:
            events += self._filters(beliefs)
        if decision.status != self._status:
            level = "info" if decision.status == Status.OK else "warning"
            text = ": ".join(part for part in (decision.status.value, decision.status.advice) if part)
            events.append(Event(level, "decision", text))
            self._status = decision.status
        if decision.wish is not None and decision.clipped and not self._clipping_told:
            events.append(Event("warning", "clipped", _clipping(decision, decision.wish)))
            self._clipping_told = True
        if given and not self._given_told:
            events.append(
                Event("info", GIVEN, "the command was given to Simulation.step, not decided by the controller")
            )
            self._given_told = True
        return tuple(events)

    def _filters(self, beliefs: Beliefs) -> Iterator[Event]:
        """Filters that were spread again, and those of which hardly a particle counts, unlike at the reading before."""
        before, self._depleted = self._depleted, set()
        for belief in (beliefs.robot, *beliefs.people):
            name = belief.name if isinstance(belief, Track) else ROBOT
            if belief.recovered:
                yield Event("warning", "recovery", f"the filter of {name} was spread again")
            if belief.ess < DEPLETED * len(belief.weights):
                self._depleted.add(name)
                if name not in before:
                    text = f"{belief.ess:.1f} of the {len(belief.weights)} particles of {name} count"
                    yield Event("warning", "depletion", text)

    def _comings(self, truth: WorldState) -> Iterator[Event]:
        """Who has entered, who has left and where the robot was put since the tick before."""
        there = ~np.isnan(truth.people_position[:, 0])
        if self._before is not None:
            x, y, _ = truth.robot_pose.tolist()
            if dist((x, y), self._before.robot_pose[:2].tolist()) > self._farthest:
                yield Event("warning", "kidnap", f"the robot was put elsewhere: to {x:.2f}, {y:.2f} m")
            changed = there != ~np.isnan(self._before.people_position[:, 0])
            for i in np.flatnonzero(changed).tolist() if changed.any() else ():
                yield Event("info", "people", f"person{i} {'enters' if there[i] else 'leaves'}")

    def at_end(self, final: WorldState, outcome: str, log_dropped: int) -> list[Event]:
        """The events that come with the state in which the run ended."""
        events = [*self._waiting, *map(self._contact, final.contacts)]
        if log_dropped:
            text = f"{log_dropped} parts of ticks are missing: the disk could not keep up"
            events.append(Event("warning", "log", text))
        return [*events, Event("info" if outcome == GOAL else "warning", "end", f"the run ended: {outcome}")]

    def _contact(self, contact: Contact) -> Event:
        text = f"contact with {contact.kind} {contact.name} at {contact.time:.3f} s, {contact.force:.0f} N"
        before = self._before
        if contact.kind == PERSON and before is not None:
            people = (before.people_position, before.people_velocity)
            text += f"; {judged(contact, before.robot_pose, before.robot_twist, *people, sees=self._sees)}"
        return Event("error", "contact", text)


def _clipping(decision: Decision, wish: tuple[float, float]) -> str:
    v, omega = wish
    return (
        f"the controller chose {v:g} m/s, {omega:g} rad/s, which is beyond the robot's limits; the command is "
        f"{decision.v:g} m/s, {decision.omega:g} rad/s. clipped_ticks in the summary counts such ticks"
    )
