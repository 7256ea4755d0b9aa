import json
import resource
import threading
from dataclasses import replace
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_protobuf.decoder import DecoderFactory

from mjnav.errors import InputError
from mjnav.log import Recorder, open_log
from mjnav.log.encode.topics import topics
from mjnav.log.log_format import check_path
from mjnav.log.write.sink import QUEUE_SIZE
from mjnav.log.write.writer import LogError

FINAL_TOPICS = {"/tf", "/scene", "/robot/truth", "/robot/state", "/people/truth", "/contacts"}
RESULT = {"outcome": "goal", "success": True, "time_s": 12.345, "collisions": {"person": 0}, "lane_violation_s": None}


@pytest.fixture
def log_path(tmp_path, scenario, made_up, event) -> Path:
    path = tmp_path / "run.mcap"
    with Recorder(path, scenario, {"seed": "3", "scene": "made-up"}, "<mujoco/>") as recorder:
        for tick in range(4):
            recorder.write(made_up.record(tick, events=(event,) if tick == 2 else ()))
            recorder.write_timing(made_up.timing(tick))
        recorder.finish(made_up.truth(4), RESULT, (event,))
    return path


def test_mcaps_own_reader_decodes_every_topic_by_the_schema_in_the_file(log_path, scenario):
    class Json(DecoderFactory):
        def decoder_for(self, message_encoding, schema):
            return json.loads if message_encoding == "json" and schema.encoding == "jsonschema" else None

    with open(log_path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory(), Json()])
        decoded = list(reader.iter_decoded_messages())
    assert {(message.channel.topic, message.schema.name) for message in decoded} == {
        (topic.name, topic.schema.name)
        for topic in topics(scenario)
        if topic.name not in ("/candidates/arcs", "/plan", "/way", "/detections")
    }
    times = {}
    for message in decoded:
        times.setdefault(message.channel.topic, []).append(message.message.log_time)
        if message.schema.encoding == "jsonschema":
            assert json.loads(message.schema.data)["title"] == message.schema.name
    whole = [0, 100_000_000, 200_000_000, 300_000_000]
    for topic, at in times.items():
        assert at == (
            [200_000_000, 400_000_000] if topic == "/events" else whole + [400_000_000] * (topic in FINAL_TOPICS)
        ), topic


def test_paths_that_cannot_be_written_are_refused_and_nothing_is_made(tmp_path):
    (tmp_path / "file").write_text("")
    (tmp_path / "dangling").symlink_to(tmp_path / "nowhere")
    for path in (
        tmp_path,
        tmp_path / "file",
        tmp_path / "file" / "x.mcap",
        tmp_path / "dangling",
        tmp_path / "new" / "x.mcap",
    ):
        with pytest.raises(InputError) as error:
            check_path(path)
        assert error.value.exit_code == 2
    assert check_path(tmp_path / "x.mcap") == tmp_path / "x.mcap"
    assert not (tmp_path / "new").exists()


def test_a_log_has_candidates_without_drawings_of_them(tmp_path, scenario, made_up):
    with Recorder(tmp_path / "run.mcap", scenario, {}, "<mujoco/>") as recorder:
        recorder.write(made_up.record(0))
    log = open_log(tmp_path / "run.mcap")
    assert log.scenario() == scenario
    assert "/candidates/arcs" not in log.topics
    assert log.topics["/candidates"].messages == 1


@pytest.mark.parametrize("threaded", [False, True])
def test_a_full_disk_is_an_error_of_one_line_and_what_was_written_stays(tmp_path, scenario, made_up, threaded):
    path, record = tmp_path / "run.mcap", made_up.record(0)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    recorder = Recorder(path, scenario, {}, "<mujoco/>", threaded=threaded)

    def run_on():
        with recorder:
            for tick in range(1000):
                recorder.write(made_up.at(record, tick))
            recorder.finish(made_up.truth(1000), {"outcome": "timeout"})

    resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, limits[1]))
    try:
        with pytest.raises(
            LogError, match=r"writing failed: File too large; it can be read at least up to [0-9.]+ s$"
        ) as raised:
            run_on()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    log = open_log(path)
    kept = sequences(log, "/command")
    assert kept == list(range(len(kept)))
    assert f"up to {0.1 * kept[-1]:.1f} s" in str(raised.value)
    assert 200_000 < path.stat().st_size <= 400_000


def test_every_reading_of_a_tick_is_there_at_its_own_time(tmp_path, scenario, made_up):
    first, second = (made_up.record(tick) for tick in (0, 3))
    before = tuple(replace(second.reading, time=time) for time in (0.1, 0.2))
    with Recorder(tmp_path / "run.mcap", scenario, {}, "<mujoco/>") as recorder:
        recorder.write(first)
        recorder.write(replace(second, tick=1, readings_before=before))
    log = open_log(tmp_path / "run.mcap")
    for topic in ("/odometry", "/scan"):
        found = [(message.sequence, message.time_ns) for message in log.messages(topic)]
        assert found == [(0, 0), (1, 100_000_000), (1, 200_000_000), (1, 300_000_000)]
    assert [message.value["time"] for message in log.messages("/odometry")] == pytest.approx([0.0, 0.1, 0.2, 0.3])


# -------------------------------------------------------------------------------------- dropped ticks


@pytest.fixture
def disk(monkeypatch):
    """A disk that takes nothing until `go_on` is set."""

    class Disk:
        entered, go_on = threading.Event(), threading.Event()

    add_message = Writer.add_message

    def blocking(self, *arguments):
        Disk.entered.set()
        Disk.go_on.wait()
        add_message(self, *arguments)

    monkeypatch.setattr(Writer, "add_message", blocking)
    yield Disk
    Disk.go_on.set()


def sequences(log, topic: str) -> list[int]:
    return [message.sequence for message in log.messages(topic)]


def test_a_log_that_cannot_keep_up_counts_what_it_drops_and_readers_see_the_gap(tmp_path, scenario, made_up, disk):
    path, first = tmp_path / "a.mcap", made_up.record(0)
    whole = QUEUE_SIZE // 2  # ticks that fill the queue: of each its messages and its timing
    with Recorder(path, scenario, {}, "<mujoco/>", threaded=True) as recorder:
        recorder.write(first)
        disk.entered.wait()  # the thread has taken the first batch out of the queue
        recorder.write_timing(made_up.timing(0))
        for tick in range(1, whole + 4):
            recorder.write(made_up.at(first, tick))
            recorder.write_timing(made_up.timing(tick))
        assert recorder.dropped == 7  # the timing of one tick, and both parts of three
        disk.go_on.set()
        recorder.finish(made_up.truth(whole + 4), {"outcome": "goal"})
        assert recorder.dropped == 7
    log = open_log(path)
    assert (log.complete, log.result["outcome"]) == (True, "goal")
    assert sequences(log, "/command") == [*range(whole + 1)]
    assert sequences(log, "/tick") == [*range(whole)]
    assert sequences(log, "/robot/truth") == [*range(whole + 1), whole + 4]  # the end is never dropped
    trajectory = log.trajectory()  # reaches to the gap
    assert (len(trajectory.command), len(trajectory.time), len(trajectory.timing)) == (whole, whole + 1, whole)
