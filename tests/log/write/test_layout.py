"""The layout names only what a log holds."""

import json
from importlib.resources import files

import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorSet

from mjnav.log import open_log
from mjnav.log.encode.geometry import TRUE_FRAME
from mjnav.log.encode.topics import topics

SHIPPED = (files("mjnav") / "log" / "write" / "foxglove-layout.json").read_bytes()
LAYOUT = json.loads(SHIPPED)
PANELS = LAYOUT["configById"]
DRAWN = (  # what a 3-D panel can show
    "foxglove.SceneUpdate",
    "foxglove.LaserScan",
    "foxglove.PointCloud",
    "foxglove.PoseInFrame",
)


@pytest.fixture
def schemas(scenario):
    return {topic.name: topic.schema for topic in topics(scenario)}


def of_kind(kind: str) -> list[dict]:
    return [config for name, config in PANELS.items() if name.startswith(f"{kind}!")]


def test_the_package_ships_the_file_that_logs_carry(recorded):
    assert open_log(recorded).attachments["foxglove-layout.json"] == SHIPPED


def test_the_room_shows_topics_that_can_be_drawn_and_follows_a_frame_that_exists(schemas):
    (room,) = of_kind("3D")
    for name in room["topics"]:
        assert schemas[name].name in DRAWN, name
    assert {name for name, schema in schemas.items() if schema.name in DRAWN} == set(room["topics"])
    assert room["followTf"] == TRUE_FRAME


PATHS = [path["value"] for config in of_kind("Plot") for path in config["paths"]]


@pytest.mark.parametrize("path", PATHS)
def test_every_plotted_path_leads_to_a_number(schemas, path):
    topic = max((name for name in schemas if path.startswith(f"{name}.")), key=len)
    fields = path.removeprefix(topic).replace("[", ".[").split(".")[1:]
    schema = schemas[topic]
    if schema.encoding == "protobuf":
        messages = {
            f"{file.package}.{message.name}": message
            for file in FileDescriptorSet.FromString(schema.data).file
            for message in file.message_type
        }
        (name,) = fields
        (field,) = [field for field in messages[schema.name].field if field.name == name]
        assert field.type in (field.TYPE_DOUBLE, field.TYPE_FLOAT)
        return
    node = json.loads(schema.data)
    for field in fields:
        node = node["items"] if field.startswith("[") else node["properties"][field]
    assert node["type"] in ("number", "integer")
