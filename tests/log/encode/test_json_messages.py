import json
from dataclasses import replace

import numpy as np

from mjnav.log.encode import json_messages
from mjnav.log.encode.json_messages import document_schema
from mjnav.log.read import ticks as documents
from mjnav.messages import Decision, Detection, Status, Way

KINDS = {"object": dict, "array": list, "string": str, "boolean": bool, "integer": int, "number": int | float}


def conforms(value: object, schema: dict, path: str = "") -> None:
    """Checks the part of JSON Schema that viewers know; any value may be null, and a list of lists has no schema."""
    assert value is None or isinstance(value, KINDS[schema["type"]]), (path, value)
    if isinstance(value, dict):
        unknown = {key: part for key, part in value.items() if key not in schema["properties"]}
        assert all(isinstance(part[0], list) for part in unknown.values()), path
        assert set(schema["required"]) <= set(value), path
        for key in value.keys() - unknown:
            conforms(value[key], schema["properties"][key], f"{path}.{key}")
    elif isinstance(value, list):
        for part in value:
            conforms(part, schema["items"], f"{path}[]")


WAY = Way(3, np.zeros(2), np.zeros((2, 2)), np.zeros(2), 0.1, np.array([[0.0, 0.0], [1.0, 0.5], [2.0, 0.5]]))


def by_scan(record):
    """The record as of a robot that tracks people by its scans."""
    tracks = tuple(
        replace(track, name=f"track{7 + i}", age=1.5, unseen=0.2 * i) for i, track in enumerate(record.tracks)
    )
    found = (Detection(record.truth.time, np.array([1.0, 2.0]), np.diag([0.01, 0.04]), 0.3, 12),)
    return replace(record, tracks=tracks, detections=found)


def encoded(record, timing) -> list[tuple[str, bytes]]:
    return [
        ("mjnav.RobotState", json_messages.encode_robot(record.tick, record.truth, record.belief)),
        ("mjnav.RobotState", json_messages.encode_robot(record.tick, record.truth, None)),
        ("mjnav.Odometry", json_messages.encode_odometry(record.reading)),
        ("mjnav.Command", json_messages.encode_command(record.tick, record.command)),
        ("mjnav.Decision", json_messages.encode_decision(record.tick, record.decision)),
        ("mjnav.Decision", json_messages.encode_decision(record.tick, Decision(0.0, 0.0, Status.STOPPED))),
        ("mjnav.People", json_messages.encode_people_truth(record.tick, record.truth)),
        ("mjnav.People", json_messages.encode_people_estimate(record)),
        ("mjnav.People", json_messages.encode_people_estimate(replace(record, reading=None, tracks=()))),
        ("mjnav.People", json_messages.encode_people_estimate(by_scan(record))),
        ("mjnav.Detections", json_messages.encode_detections(record.tick, by_scan(record).detections)),
        ("mjnav.Contacts", json_messages.encode_contacts(record.tick, record.truth)),
        ("mjnav.Way", json_messages.encode_way(record.tick, WAY, np.array([[1.0, 2.0, 0.1]]))),
        ("mjnav.TickTiming", json_messages.encode_timing(timing)),
    ]


def test_every_message_conforms_to_its_schema(made_up, contact):
    record = made_up.record(7)
    record = replace(record, truth=replace(record.truth, contacts=(contact,)))
    seen = set()
    for name, data in encoded(record, made_up.timing(7)):
        conforms(json.loads(data), json.loads(document_schema(name).data), name)
        seen.add(name)
    assert seen == set(json_messages.MESSAGES)


def test_numbers_that_json_lacks_become_null(made_up):
    record = made_up.record(0)
    truth = replace(record.truth, robot_pose=np.array([np.nan, np.inf, 1.0]))
    data = json_messages.encode_robot(0, truth, record.belief)
    assert json.loads(data)["pose"] == [None, None, 1.0]
    decoded = documents.decode_truth(
        json.loads(data),
        json.loads(json_messages.encode_people_truth(0, truth)),
        json.loads(json_messages.encode_contacts(0, truth)),
    )
    np.testing.assert_array_equal(decoded.robot_pose, [np.nan, np.nan, 1.0])
