"""A rerun recording, read back with rerun's own reader: entities, rows and values are those of the log."""

from collections import defaultdict

import numpy as np
import pytest
from rerun.chunk import RrdReader

from mjnav.metrics.safety import min_clearance
from mjnav.recording.encode.particles import decode_particles
from mjnav.recording.export.export import export


@pytest.fixture(scope="module")
def recording(driven, tmp_path_factory):
    """Of each entity path, its static chunks and a column of all of its rows in order of time."""
    path = tmp_path_factory.mktemp("rerun") / "a.rrd"
    counts = export(driven, "rrd", path)
    still, moving = set(), defaultdict(list)
    for chunk in RrdReader(path).stream():
        entity = chunk.entity_path.removeprefix("/")
        if chunk.is_static:
            still.add(entity)
        else:
            assert chunk.timeline_names == ["sim_time"]
            moving[entity] += chunk.to_record_batch().to_pylist()
    assert {entity: len(rows) for entity, rows in moving.items()} == counts
    return still, moving


def values(rows, name):
    return [row[name] for row in rows]


def documents(log, topic):
    return [message.value for message in log.messages(topic)]


def test_the_scene_and_the_bodies_are_there_for_all_times(driven, recording):
    still, _ = recording
    people = {f"world/people/person{i}" for i in range(len(driven.scenario().people))}
    assert still >= people | {"world/goal", "world/robot/truth", "world/robot/estimate"}


def test_the_robot_is_where_the_log_says_at_the_same_times(driven, recording):
    _, moving = recording
    states, rows = documents(driven, "/robot/state"), moving["world/robot/truth"]
    seconds = [row["sim_time"].total_seconds() for row in rows]
    assert seconds == pytest.approx([state["time"] for state in states], abs=1e-6)
    places = np.array(values(rows, "Transform3D:translation"))[:, 0]
    np.testing.assert_array_equal(places[:, :2], np.float32([state["pose"][:2] for state in states]))
    turns = np.array(values(rows, "Transform3D:quaternion"))[:, 0]
    np.testing.assert_allclose(2 * np.arctan2(turns[:, 2], turns[:, 3]), [s["pose"][2] for s in states], atol=1e-6)


def test_particles_scan_and_people_are_those_of_the_log(driven, recording):
    _, moving = recording
    for topic, entity in (("/belief/robot", "world/robot/particles"), ("/belief/obstacles", "world/tracks/particles")):
        for cloud, points in zip(documents(driven, topic), values(moving[entity], "Points3D:positions"), strict=True):
            columns = decode_particles(cloud)
            np.testing.assert_array_equal(np.array(points)[:, :2].T, np.float32([columns["x"], columns["y"]]))
    hits = [int(np.isfinite(scan.ranges).sum()) for scan in documents(driven, "/scan")]
    assert [len(points) for points in values(moving["world/scan"], "Points3D:positions")] == hits
    truth = [people["people"][0]["position"] for people in documents(driven, "/people/truth")]
    places = np.array(values(moving["world/people/person0"], "Transform3D:translation"))[:, 0, :2]
    np.testing.assert_array_equal(places, np.float32(truth))


def test_scalars_are_the_logs_and_clearance_is_the_metrics(driven, recording):
    _, moving = recording
    speeds = [command["v"] for command in documents(driven, "/command")]
    assert [row[0] for row in values(moving["plots/command/v"], "Scalars:scalars")] == speeds
    clearance = [row[0] for row in values(moving["plots/clearance"], "Scalars:scalars")]
    least = min_clearance(driven.trajectory(), driven.scenario())  # also between the ticks
    assert least <= min(clearance) <= least + 0.1
    statuses = [text[0].split()[0] for text in values(moving["log/status"], "TextLog:text")]
    logged = [decision["status"] for decision in documents(driven, "/decision")]
    assert statuses == [status for i, status in enumerate(logged) if i == 0 or status != logged[i - 1]]


def test_the_chosen_arc_begins_at_the_believed_pose(driven, recording):
    _, moving = recording
    believed = [state["estimate"]["mean"][:2] for state in documents(driven, "/robot/state") if state["estimate"]]
    arcs = values(moving["world/chosen_arc"], "LineStrips3D:strips")
    np.testing.assert_array_equal([strips[0][0][:2] for strips in arcs], np.float32(believed))
