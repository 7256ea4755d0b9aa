"""mjnav's own small messages as JSON, each with its JSON Schema, and back.

What metrics need is here to the last bit: JSON writes the shortest decimal that reads back as the same double.
"""

import json
from collections.abc import Mapping
from math import isfinite, nan

import numpy as np

from mjnav.messages import (
    PHASES,
    Array,
    Contact,
    Decision,
    Reading,
    RobotBelief,
    TickRecord,
    TickTiming,
    Track,
    WorldState,
)
from mjnav.recording.encode.candidates import chosen_candidate

_encoder = json.JSONEncoder(separators=(",", ":"), allow_nan=False)


def _finite(value: object) -> object:
    """The same document with null for what JSON has no number for."""
    if isinstance(value, float):
        return value if isfinite(value) else None
    if isinstance(value, dict):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(part) for part in value]
    return value


def dumps(document: Mapping) -> bytes:
    """Compact JSON; NaN and infinities become null."""
    try:
        return _encoder.encode(document).encode()
    except ValueError:
        return _encoder.encode(_finite(document)).encode()


# -------------------------------------------------------------------------------------------- encoders


def encode_robot(tick: int, truth: WorldState, belief: RobotBelief | None) -> bytes:
    """mjnav.RobotState."""
    estimate = belief and {
        "mean": belief.mean.tolist(),
        "covariance": belief.covariance.tolist(),
        "ess": belief.ess,
        "recovered": belief.recovered,
    }
    return dumps(
        {
            "tick": tick,
            "time": truth.time,
            "pose": truth.robot_pose.tolist(),
            "twist": truth.robot_twist.tolist(),
            "estimate": estimate,
        }
    )


def encode_odometry(reading: Reading) -> bytes:
    """mjnav.Odometry."""
    v, omega = reading.odometry.tolist()
    return dumps(
        {
            "time": reading.time,
            "interval": reading.interval,
            "v": v,
            "omega": omega,
            "gyro": reading.gyro,
            "pose": reading.pose.tolist(),
        }
    )


def encode_command(tick: int, command: Array) -> bytes:
    """mjnav.Command."""
    v, omega = command.tolist()
    return dumps({"tick": tick, "v": v, "omega": omega})


def encode_decision(tick: int, decision: Decision) -> bytes:
    """mjnav.Decision; `nominal` and `cost` are null for a method without candidates, `wish` only where one differs."""
    nominal = cost = None
    if (costs := decision.costs) is not None:
        nominal = {"v": float(costs.v[costs.nominal]), "omega": float(costs.omega[costs.nominal])}
        if (i := chosen_candidate(decision)) is not None:
            cost = {
                "goal": float(costs.goal[i]),
                "cone": costs.cone[i].tolist(),
                "lane": costs.lane[i].tolist(),
                "total": float(costs.total[i]),
            }
    return dumps(
        {
            "tick": tick,
            "v": float(decision.v),
            "omega": float(decision.omega),
            "status": str(decision.status),
            "advice": decision.status.advice,
            "nominal": nominal,
            "cost": cost,
            **({} if decision.wish is None else {"wish": dict(zip(("v", "omega"), decision.wish, strict=True))}),
        }
    )


def encode_people_truth(tick: int, truth: WorldState) -> bytes:
    """mjnav.People: where they are."""
    people = [
        {"name": f"person{i}", "position": position, "velocity": velocity}
        for i, (position, velocity) in enumerate(
            zip(truth.people_position.tolist(), truth.people_velocity.tolist(), strict=True)
        )
    ]
    return dumps({"tick": tick, "people": people})


def _track(track: Track) -> dict:
    mean = track.mean.tolist()
    return {
        "name": track.name,
        "position": mean[:2],
        "velocity": mean[2:],
        "covariance": track.covariance.tolist(),
        "radius": track.radius,
        "ess": track.ess,
        "recovered": track.recovered,
    }


def encode_people_estimate(record: TickRecord) -> bytes:
    """mjnav.People: where they are believed to be, and what the detector said."""
    document: dict = {"tick": record.tick, "people": [_track(track) for track in record.tracks]}
    if record.reading is not None:
        document["detections"] = record.reading.detections.tolist()
    return dumps(document)


def encode_contacts(tick: int, truth: WorldState) -> bytes:
    """mjnav.Contacts: those seen since the message before."""
    contacts = [
        {"kind": contact.kind, "name": contact.name, "force": contact.force, "time": contact.time}
        for contact in truth.contacts
    ]
    return dumps({"tick": tick, "contacts": contacts})


def encode_timing(timing: TickTiming) -> bytes:
    """mjnav.TickTiming."""
    phases = {f"{phase}_ns": duration for phase, duration in zip(PHASES, timing.phases, strict=True)}
    return dumps(
        {
            "tick": timing.tick,
            **phases,
            "lateness_ns": timing.lateness,
            "deadline_missed": timing.deadline_missed,
        }
    )


# -------------------------------------------------------------------------------------------- decoders


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


def decode_estimate(document: Mapping) -> tuple[Array, Array]:
    """Mean (3,) and covariance (3, 3) of the robot's believed pose."""
    return _array(document["mean"], (3,)), _array(document["covariance"], (3, 3))


def decode_twist(document: Mapping | None) -> Array:
    """(v, omega) of a command or a decision, (2,); NaN where there is none."""
    return np.full(2, np.nan) if document is None else _array([document["v"], document["omega"]], (2,))


def decode_tracks(people: Mapping) -> dict[str, tuple[Array, Array]]:
    """Mean (4,) and covariance (4, 4) of each believed person by name."""
    return {
        person["name"]: (
            _array([*person["position"], *person["velocity"]], (4,)),
            _array(person["covariance"], (4, 4)),
        )
        for person in people["people"]
    }


def decode_timing(document: Mapping) -> TickTiming:
    """The inverse of `encode_timing`."""
    phases = tuple(document[f"{phase}_ns"] for phase in PHASES)
    return TickTiming(document["tick"], phases, document["lateness_ns"], document["deadline_missed"])
