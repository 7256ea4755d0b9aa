import json
from dataclasses import replace

import numpy as np
import pytest

from mjnav.messages import Decision, Status
from mjnav.recording.encode import documents
from mjnav.recording.encode.schemas import _DOCUMENTS, document_schema


def conforms(value: object, schema: dict, path: str = "") -> None:
    """Checks the part of JSON Schema that mjnav's schemas use."""
    if "enum" in schema:
        assert value in schema["enum"], path
        return
    kinds = schema["type"] if isinstance(schema["type"], list) else [schema["type"]]
    python = {"object": dict, "array": list, "string": str, "boolean": bool, "null": type(None)}
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    assert any(
        is_number
        if kind == "number"
        else isinstance(value, int)
        if kind == "integer"
        else isinstance(value, python[kind])
        for kind in kinds
    ), (path, value, kinds)
    if isinstance(value, dict):
        assert set(schema["required"]) <= set(value) <= set(schema["properties"]), path
        for key, part in value.items():
            conforms(part, schema["properties"][key], f"{path}.{key}")
    elif isinstance(value, list):
        assert schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value)), path
        for part in value:
            conforms(part, schema["items"], f"{path}[]")


def encoded(record, timing) -> list[tuple[str, bytes]]:
    return [
        ("mjnav.RobotState", documents.encode_robot(record.tick, record.truth, record.belief)),
        ("mjnav.RobotState", documents.encode_robot(record.tick, record.truth, None)),
        ("mjnav.Odometry", documents.encode_odometry(record.reading)),
        ("mjnav.Command", documents.encode_command(record.tick, record.command)),
        ("mjnav.Decision", documents.encode_decision(record.tick, record.decision)),
        ("mjnav.Decision", documents.encode_decision(record.tick, Decision(0.0, 0.0, Status.STOPPED))),
        ("mjnav.People", documents.encode_people_truth(record.tick, record.truth)),
        ("mjnav.People", documents.encode_people_estimate(record)),
        ("mjnav.People", documents.encode_people_estimate(replace(record, reading=None, tracks=()))),
        ("mjnav.Contacts", documents.encode_contacts(record.tick, record.truth)),
        ("mjnav.TickTiming", documents.encode_timing(timing)),
    ]


def test_every_message_conforms_to_its_schema(made_up, contact):
    record = made_up.record(7)
    record = replace(record, truth=replace(record.truth, contacts=(contact,)))
    seen = set()
    for name, data in encoded(record, made_up.timing(7)):
        conforms(json.loads(data), json.loads(document_schema(name).data), name)
        seen.add(name)
    assert seen == set(_DOCUMENTS)


def test_numbers_that_json_lacks_become_null(made_up):
    record = made_up.record(0)
    truth = replace(record.truth, robot_pose=np.array([np.nan, np.inf, 1.0]))
    data = documents.encode_robot(0, truth, record.belief)
    assert json.loads(data)["pose"] == [None, None, 1.0]
    decoded = documents.decode_truth(
        json.loads(data),
        json.loads(documents.encode_people_truth(0, truth)),
        json.loads(documents.encode_contacts(0, truth)),
    )
    np.testing.assert_array_equal(decoded.robot_pose, [np.nan, np.nan, 1.0])


def test_a_decision_shows_its_nominal_control_and_what_the_chosen_one_cost(made_up):
    decision = made_up.record(0).decision
    costs = decision.costs
    document = json.loads(documents.encode_decision(5, decision))
    chosen = int(np.argmin(costs.total))
    assert document["cost"]["total"] == costs.total[chosen]
    assert document["cost"]["cone"] == costs.cone[chosen].tolist()
    assert document["nominal"] == {"v": costs.v[costs.nominal], "omega": costs.omega[costs.nominal]}


def test_a_decision_that_is_no_candidate_has_no_cost(made_up):
    decision = replace(made_up.record(0).decision, v=0.123456)
    assert json.loads(documents.encode_decision(0, decision))["cost"] is None


@pytest.mark.parametrize("status", list(Status))
def test_a_status_comes_with_its_advice(status):
    document = json.loads(documents.encode_decision(0, Decision(0.1, 0.2, status)))
    assert (document["status"], document["advice"]) == (status.value, status.advice)


def test_a_timing_reads_back(made_up):
    timing = made_up.timing(3)
    assert documents.decode_timing(json.loads(documents.encode_timing(timing))) == timing
