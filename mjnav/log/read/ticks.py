"""Assembles the ticks of a log from its JSON messages.

Functions such as `decode_truth` turn a JSON message into the loop's own types: the inverse of `encode.json_messages`.

`TickAssembler` takes the messages one at a time and keeps no document longer than its tick.
"""

from array import array
from collections.abc import Mapping
from dataclasses import dataclass
from math import nan
from sys import intern
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjnav.log.read.trajectory import Believed, TrajectoryBuilder
from mjnav.messages import PHASES, Array, Contact, TickTiming, Trajectory, WorldState


def _array(values: object, shape: tuple[int, ...]) -> Array:
    return np.array(values, float).reshape(shape)


def number(value: float | None) -> float:
    """A number; NaN for the null that took its place."""
    return nan if value is None else float(value)


def _contact(document: Mapping) -> Contact:
    kind, name = str(document["kind"]), str(document["name"])
    return Contact(kind, name, number(document["force"]), number(document["time"]))


def decode_truth(robot: Mapping, people: Mapping, contacts: Mapping) -> WorldState:
    """The truth from mjnav.RobotState, mjnav.People and mjnav.Contacts."""
    tells_radius = any("radius" in person for person in people["people"])
    return WorldState(
        time=number(robot["time"]),
        robot_pose=_array(robot["pose"], (3,)),
        robot_twist=_array(robot["twist"], (2,)),
        people_position=_array([person["position"] for person in people["people"]], (-1, 2)),
        people_velocity=_array([person["velocity"] for person in people["people"]], (-1, 2)),
        contacts=tuple(_contact(contact) for contact in contacts["contacts"]),
        people_radius=_array([person["radius"] for person in people["people"]], (-1,)) if tells_radius else None,
    )


def decode_estimate(robot: Mapping) -> Believed | None:
    """What mjnav.RobotState says of the robot's belief: its mean is (3,)."""
    document = robot["estimate"]
    if document is None:
        return None
    mean, covariance = _array(document["mean"], (3,)), _array(document["covariance"], (3, 3))
    ess, recovered = number(document["ess"]), bool(document["recovered"])
    return Believed(mean, covariance, ess, number(robot.get("particles")), recovered)


def decode_twist(document: Mapping | None) -> Array:
    """(v, omega) of a command or a decision, (2,); NaN without a document."""
    return np.full(2, np.nan) if document is None else _array([document["v"], document["omega"]], (2,))


def decode_tracks(people: Mapping) -> dict[str, Believed]:
    """Each believed person by name; the mean is (4,)."""
    return {
        person["name"]: Believed(
            _array([*person["position"], *person["velocity"]], (4,)),
            _array(person["covariance"], (4, 4)),
            number(person["ess"]),
            recovered=bool(person["recovered"]),
            unseen=number(person.get("unseen", 0.0)),
        )
        for person in people["people"]
    }


def decode_timing(document: Mapping) -> TickTiming:
    """The inverse of `encode_timing`."""
    phases = tuple(document[f"{phase}_ns"] for phase in PHASES)
    return TickTiming(document["tick"], phases, document["lateness_ns"], document["deadline_missed"])


TRUTH = ("/robot/state", "/people/truth", "/contacts")
TICK = (*TRUTH, "/people/estimate", "/decision", "/command")
TIMING = "/tick"
# Every tick has these. Others are missing where no sensor was due, or there were no candidates or events.
EVERY_TICK = (
    *TICK,
    TIMING,
    "/tf",
    "/scene",
    "/robot/truth",
    "/robot/estimate",
    "/belief/robot",
    "/belief/obstacles",
)

# What decoding a JSON document that mjnav did not write raises.
NOT_OURS = (LookupError, TypeError, ValueError, AttributeError, OverflowError, RecursionError)


class BadDocument(ValueError):
    """A document that is not what its topic holds."""


@dataclass(frozen=True, slots=True)
class LoggedRun:
    """The whole ticks of a log, T rows, and the timing of every tick that has one."""

    trajectory: Trajectory
    ticks: NDArray[np.int64]  # (T + 1,) their numbers, and that of the last state
    timing: NDArray[np.int64]  # (n, 7) as in a trajectory
    deadline_misses: int


class TickAssembler:
    """Takes a log's documents in the order in which they were written.

    A tick is whole if it has a document of every topic in TICK. The run ends before the first tick that is not whole,
    because the writer dropped it or it was lost since. `across_gaps`, such a tick is left out instead, and so is one
    with documents that mjnav did not write.
    """

    def __init__(self, *, across_gaps: bool = False):
        self._across_gaps = across_gaps
        self._builder = TrajectoryBuilder()
        self._number, self._documents = -1, {}  # of the tick that is being read
        # The last one, with arguments of TrajectoryBuilder.add_states if it is whole: committed when another follows.
        self._held: tuple[int, WorldState, Mapping[str, Any] | None, TickTiming | None] | None = None
        self._ended = False
        self._ticks, self._timing = array("q"), array("q")
        self._misses = 0

    def add(self, topic: str, tick: int, document: Any) -> None:
        """One document of a topic in TICK, or of TIMING. Raises BadDocument, but not across gaps."""
        if tick != self._number:
            self._close()
            self._number = tick
        self._documents[topic] = document

    def finish(self) -> LoggedRun | None:
        """All whole ticks, ended by the state after the last one, or else by its own; None without ticks."""
        self._close()
        if self._held is None:
            return None
        number, final, *_ = self._held
        return LoggedRun(
            self._builder.finish(final),
            ticks=np.array([*self._ticks, number], np.int64),
            timing=np.array(self._timing, np.int64).reshape(-1, len(PHASES) + 2),
            deadline_misses=self._misses,
        )

    def _close(self) -> None:
        """Ends the tick that was being read."""
        found, self._documents = self._documents, {}
        if not found or self._ended:
            return
        try:
            timing = self._read_timing(found.get(TIMING))
            if any(topic not in found for topic in TRUTH):
                return
            truth = decode_truth(*(found[topic] for topic in TRUTH))
            num_people = len(truth.people_position if self._held is None else self._held[1].people_position)
            if not len(truth.people_position) == len(truth.people_velocity) == num_people:
                raise ValueError(f"{num_people} people have become {len(truth.people_position)}")
            if self._held is not None and (truth.people_radius is None) != (self._held[1].people_radius is None):
                raise ValueError("radii of people are told in some ticks alone")
            states = _states(found) if all(topic in found for topic in TICK) else None
        except NOT_OURS as error:
            if not self._across_gaps:
                raise BadDocument(f"tick {self._number} is not one of mjnav's ({error!r})") from error
            return
        self._hold(truth, states, timing)

    def _hold(self, truth: WorldState, states: Mapping[str, Any] | None, timing: TickTiming | None) -> None:
        before = -1 if self._held is None else self._held[0]
        if self._across_gaps and self._number <= before:
            return
        if not self._across_gaps:
            self._ended = self._number != before + 1 or states is None
            if self._number != before + 1:
                return
        self._commit()
        self._held = (self._number, truth, states, timing)

    def _commit(self) -> None:
        if self._held is None:
            return
        number, truth, states, timing = self._held
        if states is None:
            return
        self._builder.add_states(truth, **states)
        if timing is not None:
            self._builder.add_timing(timing)
        self._ticks.append(number)

    def _read_timing(self, document: Any) -> TickTiming | None:
        if document is None:
            return None
        timing = decode_timing(document)
        self._timing.extend(array("q", (timing.tick, *timing.phases, timing.lateness)))  # all or none
        self._misses += bool(timing.deadline_missed)
        return timing


def _states(found: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of TrajectoryBuilder.add_states, from a tick that has a document of every topic in TICK."""
    decision, people = found["/decision"], found["/people/estimate"]
    if found["/command"] is None:  # a nominal control may be
        raise TypeError("no command")
    return {
        "estimate": decode_estimate(found["/robot/state"]),
        "tracks": decode_tracks(people),
        "updated": "detections" in people,
        "command": decode_twist(found["/command"]),
        "decision": decode_twist(decision),
        "nominal": decode_twist(decision["nominal"]),
        "status": intern(decision["status"]),
        "clipped": decision.get("wish") is not None and not (decision.get("caution") or decision.get("recovery")),
        "cautious": bool(decision.get("caution")),
    }
