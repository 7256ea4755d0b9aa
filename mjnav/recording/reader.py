"""A log read back: what it holds, its messages, and the run as arrays."""

import json
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import mcap.records as records
from mcap_protobuf.decoder import DecoderFactory

from mjnav.errors import InputError
from mjnav.messages import Trajectory
from mjnav.recording import documents
from mjnav.recording.stream import read_records
from mjnav.recording.trajectory import TrajectoryBuilder
from mjnav.recording.writer import RESULT, RUN, SCENARIO
from mjnav.scenarios import Scenario, loads


@dataclass(frozen=True, slots=True)
class TopicSummary:
    """What one topic holds. Times are simulated nanoseconds."""

    schema: str
    messages: int = 0
    first_ns: int | None = None
    last_ns: int | None = None
    max_gap_ns: int | None = None  # the longest time between two successive messages
    bytes: int = 0  # of the messages, before compression

    @property
    def hz(self) -> float | None:
        """Messages a second over the topic's own span; None where they span no time."""
        if self.first_ns is None or self.last_ns is None or self.last_ns <= self.first_ns:
            return None
        return (self.messages - 1) / (1e-9 * (self.last_ns - self.first_ns))

    def with_message(self, time_ns: int, size: int) -> "TopicSummary":
        """The summary after one more message."""
        gap = None if self.last_ns is None else max(self.max_gap_ns or 0, time_ns - self.last_ns)
        first = time_ns if self.first_ns is None else self.first_ns
        return replace(
            self, messages=self.messages + 1, first_ns=first, last_ns=time_ns, max_gap_ns=gap, bytes=self.bytes + size
        )


class LogMessage(NamedTuple):
    """One decoded message: JSON as a dict, protobuf as its message object, anything else as bytes."""

    topic: str
    time_ns: int
    sequence: int  # the tick
    value: Any


@dataclass(frozen=True, slots=True)
class Log:
    """A log that was read once from end to end; messages are read again when they are asked for."""

    path: Path
    run: Mapping[str, str] | None  # metadata `mjnav/run`; None where mjnav did not write the file
    result: Mapping[str, Any] | None  # metadata `mjnav/result`; None where the run did not end
    attachments: Mapping[str, bytes]
    topics: Mapping[str, TopicSummary]
    truncated: bool  # the file has no end: its writer was killed

    @property
    def complete(self) -> bool:
        """The run ended and said so."""
        return self.result is not None

    @property
    def duration(self) -> float | None:
        """Simulated time from the first message to the last [s]; None without messages."""
        firsts = [topic.first_ns for topic in self.topics.values() if topic.first_ns is not None]
        lasts = [topic.last_ns for topic in self.topics.values() if topic.last_ns is not None]
        return 1e-9 * (max(lasts) - min(firsts)) if firsts else None

    def scenario(self) -> Scenario:
        """The run file that the log carries. Raises InputError where it carries none."""
        if SCENARIO not in self.attachments:
            raise InputError(f"{self.path}: holds no {SCENARIO}; was it written by mjnav?")
        return loads(self.attachments[SCENARIO].decode(), file=f"{self.path}: {SCENARIO}")

    def messages(self, *topics: str) -> Iterator[LogMessage]:
        """The messages of these topics, or of all, in the order in which they were written."""
        wanted = set(topics) or set(self.topics)
        schemas: dict[int, records.Schema] = {}
        channels: dict[int, tuple[str, Callable[[bytes], Any]]] = {}
        factory = DecoderFactory()  # it remembers schemas by their number in this file
        for record in read_records(self.path):
            if isinstance(record, records.Message):
                if record.channel_id in channels:
                    topic, decode = channels[record.channel_id]
                    yield LogMessage(topic, record.log_time, record.sequence, decode(record.data))
            elif isinstance(record, records.Schema):
                schemas[record.id] = record
            elif isinstance(record, records.Channel) and record.topic in wanted:
                if record.message_encoding == "json":
                    decode = json.loads
                else:
                    decode = factory.decoder_for(record.message_encoding, schemas.get(record.schema_id)) or bytes
                channels[record.id] = (record.topic, decode)

    def trajectory(self) -> Trajectory:
        """The run as arrays: the same as the loop's own, to the last bit.

        Where the writer was killed or dropped a tick, the last tick before which everything is there gives the truth's
        last row. Raises InputError where there is no whole tick.
        """
        by_topic: dict[str, dict[int, Any]] = {topic: {} for topic in _TRUTH + _TICK}
        timings = []
        for message in self.messages(*by_topic, "/tick"):
            if message.topic == "/tick":
                timings.append(documents.decode_timing(message.value))
            else:
                by_topic[message.topic][message.sequence] = message.value
        states = _leading(by_topic, _TRUTH)
        ticks = min(_leading(by_topic, _TRUTH + _TICK), states - 1)
        if ticks < 0:
            raise InputError(f"{self.path}: holds no whole tick of a run")
        builder = TrajectoryBuilder()
        for tick in range(ticks):
            _add_tick(builder, {topic: values[tick] for topic, values in by_topic.items()})
        for timing in timings:
            if timing.tick < ticks:
                builder.add_timing(timing)
        return builder.finish(documents.decode_truth(*(by_topic[topic][ticks] for topic in _TRUTH)))


_TRUTH = ("/robot/state", "/people/truth", "/contacts")
_TICK = ("/people/estimate", "/decision", "/command")


def _leading(by_topic: Mapping[str, Mapping[int, Any]], topics: tuple[str, ...]) -> int:
    """How many ticks from the first on have a message of each of these topics."""
    tick = 0
    while all(tick in by_topic[topic] for topic in topics):
        tick += 1
    return tick


def _add_tick(builder: TrajectoryBuilder, documents_of: Mapping[str, Any]) -> None:
    robot, decision = documents_of["/robot/state"], documents_of["/decision"]
    builder.add_states(
        documents.decode_truth(*(documents_of[topic] for topic in _TRUTH)),
        estimate=documents.decode_estimate(robot["estimate"]),
        tracks=documents.decode_tracks(documents_of["/people/estimate"]),
        command=documents.decode_twist(documents_of["/command"]),
        decision=documents.decode_twist(decision),
        nominal=documents.decode_twist(decision["nominal"]),
        status=decision["status"],
    )


def _result_value(text: str) -> object:
    """The inverse of the writer's: JSON where it is JSON, else the string."""
    try:
        return json.loads(text)
    except ValueError:
        return text


def open_log(path: str | os.PathLike[str]) -> Log:
    """Reads a log from end to end and verifies every checksum.

    Raises InputError where the file is missing or not MCAP, DamagedLogError where a checksum fails or nothing in it can
    be read. A file whose writer was killed is read as far as it goes.
    """
    path = Path(path)
    metadata: dict[str, dict[str, str]] = {}
    attachments: dict[str, bytes] = {}
    schemas: dict[int, str] = {0: ""}
    topic_of: dict[int, str] = {}
    topics: dict[str, TopicSummary] = {}
    truncated = True
    for record in read_records(path):
        if isinstance(record, records.Message):
            topic = topic_of[record.channel_id]
            topics[topic] = topics[topic].with_message(record.log_time, len(record.data))
        elif isinstance(record, records.Schema):
            schemas[record.id] = record.name
        elif isinstance(record, records.Channel):
            topic_of[record.id] = record.topic
            topics.setdefault(record.topic, TopicSummary(schemas[record.schema_id]))
        elif isinstance(record, records.Metadata):
            metadata[record.name] = record.metadata
        elif isinstance(record, records.Attachment):
            attachments[record.name] = record.data
        truncated = truncated and not isinstance(record, records.Footer)
    run, result = metadata.get(RUN), metadata.get(RESULT)
    return Log(
        path=path,
        run=run and MappingProxyType(run),
        result=result and MappingProxyType({key: _result_value(value) for key, value in result.items()}),
        attachments=MappingProxyType(attachments),
        topics=MappingProxyType(topics),
        truncated=truncated,
    )
