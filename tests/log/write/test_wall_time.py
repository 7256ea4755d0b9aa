"""Logs are stamped with simulated time, and on request with wall time, which no reader of mjnav notices."""

import time

import pytest
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from mcap.records import Channel, Message

import mjnav
from mjnav.log import open_log
from mjnav.log.read.records import read_records
from mjnav.report.inspection import inspect

SHORT = ("time_limit=1.0", "physics.engine=kinematic")


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """Of one run: in simulated time twice, and in wall time; and the time of day before and after the last."""
    folder = tmp_path_factory.mktemp("logs")
    for name in ("a", "b"):
        mjnav.run(mjnav.load_scenario("crossing1", SHORT), log=folder / f"{name}.mcap")
    before = time.time_ns()
    mjnav.run(mjnav.load_scenario("crossing1", (*SHORT, "log.wall_time=true")), log=folder / "wall.mcap")
    return folder, before, time.time_ns()


def stamps(path):
    """(topic, log time, publish time, data) of each message, as other programs see it."""
    channels = {}
    for record in read_records(path):
        if isinstance(record, Channel):
            channels[record.id] = record.topic
        elif isinstance(record, Message):
            yield channels[record.channel_id], record.log_time, record.publish_time, record.data


def test_players_see_the_time_of_day_in_the_records_and_in_the_stamps(logs):
    folder, before, after = logs
    (simulated, walled) = ([*stamps(folder / name)] for name in ("a.mcap", "wall.mcap"))
    epoch = walled[0][1]
    assert before <= epoch <= after
    assert [(topic, when - epoch) for topic, when, _, _ in walled] == [(topic, when) for topic, when, _, _ in simulated]
    assert all(when == published for _, when, published, _ in walled)
    for topic, when, _, data in walled:
        if topic == "/tf":
            for transform in FrameTransforms.FromString(data).transforms:
                assert transform.timestamp.ToNanoseconds() == when


def test_every_reader_sees_simulated_time(logs):
    folder, *_ = logs
    plain, wall = (open_log(folder / name) for name in ("a.mcap", "wall.mcap"))
    for a, b in zip(plain.messages(), wall.messages(), strict=True):
        assert a.topic == "/tick" or (a[:3], str(a.value)) == (b[:3], str(b.value))
    assert plain.duration == wall.duration
    rates = [
        {name: (topic.hz, topic.max_gap_s, topic.max_gap_at_s) for name, topic in inspect(log).topics.items()}
        for log in (plain, wall)
    ]
    assert rates[0] == rates[1]
    assert (plain.trajectory().estimate == wall.trajectory().estimate).all()
    assert mjnav.replay(folder / "wall.mcap").identical
