"""Events of a run for its log: contacts, goal, time-out, lanes, diverged beliefs, and warnings.

The referee and the watch on beliefs judge by the truth. The robot never hears of either: it cannot know that its belief
has left the truth.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from mjnav.geometry.angles import wrap
from mjnav.geometry.distances import nearest_tracks
from mjnav.messages import Array, Beliefs, Contact, Decision, Event, Status, Track, WorldState, triangle
from mjnav.metrics.consistency import DEPLETED, DIVERGED, DIVERGED_TIME, nees, region
from mjnav.metrics.safety import PERSON, judged
from mjnav.scene.check import HORIZON, is_avoidable, overlapping_people
from mjnav.scene.spec import Scenario

# --------------------------------------------------------------------------------- diverged beliefs


ROBOT = "robot"


class DivergenceWatch:
    """Tells once of each belief that is outside of its 99.9 % region for DIVERGED_TIME.

    There are as many such events as the figures robot_divergences and people_divergences count.
    """

    def __init__(self, period: float):
        """`period` is the time from tick to tick [s]."""
        self._period = period
        self._limit = {num: region(DIVERGED, num) for num in (3, 4)}
        self._since: dict[str, float] = {}  # [s] since when it has been outside, by name
        self._told: set[str] = set()

    def of_tick(self, truth: WorldState, beliefs: Beliefs) -> Iterator[Event]:
        """The events of one tick."""
        outside = dict(self._outside(truth, beliefs))
        self._since = {name: self._since.get(name, truth.time) for name in outside}
        self._told &= outside.keys()
        for name, distance in outside.items():
            if name not in self._told and truth.time - self._since[name] + self._period >= DIVERGED_TIME - 1e-9:
                self._told.add(name)
                share = f"outside of its {100.0 * DIVERGED:g} % region for {DIVERGED_TIME:g} s"
                yield Event("warning", "divergence", f"the belief about {name} is {distance:.2f} m off, {share}")

    def _outside(self, truth: WorldState, beliefs: Beliefs) -> Iterator[tuple[str, float]]:
        """Whose belief is outside, and how far from the truth [m]."""
        error = beliefs.robot.mean - truth.robot_pose
        error[2] = wrap(error[2])
        if _squared(error[None], beliefs.robot.covariance[None])[0] > self._limit[3]:
            yield ROBOT, float(np.hypot(*error[:2]))
        tracks = _by_person(truth, beliefs.people)
        if not tracks:
            return
        people = [*tracks]
        states = np.concatenate([truth.people_position[people], truth.people_velocity[people]], axis=1)
        errors = np.array([track.mean for track in tracks.values()]) - states
        squared = _squared(errors, np.array([track.covariance for track in tracks.values()]))
        for i in np.flatnonzero(squared > self._limit[4]).tolist():
            yield f"person{people[i]}", float(np.hypot(*errors[i, :2]))


def _by_person(truth: WorldState, tracks: tuple[Track, ...]) -> dict[int, Track]:
    """Each person's track, by its name or, of tracks that carry none, by the assignment that figures use."""
    places = {f"person{i}": i for i in range(len(truth.people_position))}
    named = {places[track.name]: track for track in tracks if track.name in places}
    unnamed = [track for track in tracks if track.name not in places]
    return named | nearest_tracks(truth.people_position, unnamed) if unnamed else named


def _squared(errors: Array, covariances: Array) -> Array:
    """The NEES of errors (B, n) with covariances (B, n, n), (B,)."""
    try:
        return (errors * np.linalg.solve(covariances, errors[..., None])[..., 0]).sum(axis=1)
    except np.linalg.LinAlgError:
        return nees(errors, triangle(covariances))


# ------------------------------------------------------------------------------------------ referee


GOAL, COLLISION, TIMEOUT, ABORTED = "goal", "collision", "timeout", "aborted"


class Referee:
    """Watches the true states of one run."""

    def __init__(self, scenario: Scenario):
        self._goal = scenario.robot.route[-1]
        self._tolerance = scenario.robot.goal_tolerance
        self._time_limit = scenario.time_limit
        self._stop = scenario.stop_on_collision

    def outcome(self, truth: WorldState, *, on_last_leg: bool) -> str | None:
        """How the run has ended, or None while it goes on. A collision counts before the goal, the goal before time."""
        if truth.contacts and self._stop:
            return COLLISION
        dx, dy = truth.robot_pose[0] - self._goal[0], truth.robot_pose[1] - self._goal[1]
        if on_last_leg and dx * dx + dy * dy <= self._tolerance**2:
            return GOAL
        return TIMEOUT if truth.time >= self._time_limit - 1e-9 else None


# ------------------------------------------------------------------------------------------- events


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

    def __init__(self, period: float, *, sees: Sequence[bool] = ()):
        """`period` is the time from tick to tick [s]; `sees` says of each person whether they see the robot."""
        self._sees = tuple(sees)
        self._divergence = DivergenceWatch(period)
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
        if beliefs is not None:
            events += [*(self._filters(beliefs) if updated else ()), *self._divergence.of_tick(truth, beliefs)]
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
        """Who has entered and who has left since the tick before."""
        there = ~np.isnan(truth.people_position[:, 0])
        if self._before is not None:
            before = ~np.isnan(self._before.people_position[:, 0])
            for i in np.flatnonzero(there != before).tolist():
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
