from dataclasses import replace
from math import atan2

import numpy as np
import pytest
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from mjnav.log.encode.scene import SceneEncoder
from mjnav.messages import Detection


def test_a_person_has_a_name_and_the_estimate_its_own_entity_beside_it(scenario, made_up):
    record = made_up.record(4)
    track = replace(record.tracks[2], mean=np.array([1.0, 2.0, -0.3, 0.4]))
    update = SceneUpdate.FromString(SceneEncoder(scenario).encode(record.truth, (track,)))
    named = {entity.id: entity for entity in update.entities}
    for i, (x, y) in enumerate(record.truth.people_position.tolist()):
        (body,), (text,) = named[f"person{i}"].cylinders, named[f"person{i}"].texts
        assert (body.pose.position.x, body.pose.position.y, body.size.x) == (x, y, 2 * scenario.people[i].radius)
        assert (text.pose.position.x, text.pose.position.y, text.text) == (x, y, f"person{i}")
    believed = named["person2_estimate"]
    assert believed.timestamp.ToNanoseconds() == 400_000_000
    assert believed.lifetime.ToNanoseconds() == 200_000_000
    (disc,), (arrow,) = believed.cylinders, believed.arrows
    assert (disc.pose.position.x, disc.pose.position.y) == (arrow.pose.position.x, arrow.pose.position.y) == (1.0, 2.0)
    assert 2 * atan2(arrow.pose.orientation.z, arrow.pose.orientation.w) == pytest.approx(atan2(0.4, -0.3))
    assert arrow.shaft_length == pytest.approx(0.5)
    assert [name for name in named if name.endswith("_estimate")] == ["person2_estimate"]


def test_a_detection_is_a_disc_with_its_95_percent_ellipse(scenario, made_up):
    record = made_up.record(4)
    found = Detection(0.4, np.array([3.0, -1.0]), np.array([[0.01, 0.0], [0.0, 0.04]]), 0.3, 12)
    update = SceneUpdate.FromString(SceneEncoder(scenario).encode(record.truth, (), None, (found, found)))
    (entity,) = (one for one in update.entities if one.id == "detections")
    assert entity.lifetime.ToNanoseconds() == 200_000_000
    body, region = entity.cylinders[2:]
    assert (body.pose.position.x, body.pose.position.y, body.size.x, body.size.y) == (3.0, -1.0, 0.6, 0.6)
    assert (region.size.x, region.size.y) == pytest.approx((0.4 * 5.991**0.5, 0.2 * 5.991**0.5))
    turn = 2 * atan2(region.pose.orientation.z, region.pose.orientation.w)
    assert abs(turn) == pytest.approx(np.pi / 2)  # the longer axis is y
