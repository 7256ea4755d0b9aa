"""The log's JSON messages as what the loop knows; the inverse of `encode.json_messages`."""

from collections.abc import Mapping
from math import nan

import numpy as np

from mjnav.messages import PHASES, Array, Contact, TickTiming, WorldState
from mjnav.recording.read.believed import Believed


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
    return WorldState(
        time=number(robot["time"]),
        robot_pose=_array(robot["pose"], (3,)),
        robot_twist=_array(robot["twist"], (2,)),
        people_position=_array([person["position"] for person in people["people"]], (-1, 2)),
        people_velocity=_array([person["velocity"] for person in people["people"]], (-1, 2)),
        contacts=tuple(_contact(contact) for contact in contacts["contacts"]),
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
    """(v, omega) of a command or a decision, (2,); NaN where there is none."""
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
