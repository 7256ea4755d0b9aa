"""A log that was opened for reading: what it holds, its messages, and its run as arrays.

`adapter` brings messages to simulated time, where they are stamped with wall time.
"""

import json
import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from mcap import records
from mcap_protobuf.decoder import DecoderFactory

from mjnav.errors import DamagedLogError, InputError
from mjnav.log import log_format
from mjnav.log.encode.protobuf import Schema
from mjnav.log.read.records import LostBytes, read_records
from mjnav.log.read.tables import LogMessage, data_frame, find_table
from mjnav.log.read.ticks import TICK, TIMING, BadDocument, LoggedRun, TickAssembler
from mjnav.messages import Trajectory
from mjnav.output_files import path_text
from mjnav.printable import printable
from mjnav.scene import Scenario, loads

if TYPE_CHECKING:
    from pandas import DataFrame


MAX_NESTING = 500  # brackets in a value of metadata


@dataclass(slots=True)
class TopicSummary:
    """What one topic holds. Times are simulated nanoseconds; sequence numbers are ticks where mjnav wrote the log."""

    schema: str
    messages: int = 0
    first_ns: int | None = None
    last_ns: int | None = None
    max_gap_ns: int | None = None  # the longest time between two successive messages
    max_gap_at_ns: int | None = None  # when it began
    first_sequence: int | None = None
    last_sequence: int | None = None
    skipped: int = 0  # sequence numbers between those of successive messages
    bytes: int = 0  # of the messages, before compression

    @property
    def hz(self) -> float | None:
        """Messages a second over the topic's own span; None where they span no time."""
        if self.first_ns is None or self.last_ns is None or self.last_ns <= self.first_ns:
            return None
        return (self.messages - 1) / (1e-9 * (self.last_ns - self.first_ns))

    def add(self, time_ns: int, sequence: int, size: int) -> None:
        """Counts one more message."""
        self.messages += 1
        self.bytes += size
        if self.last_ns is None or self.last_sequence is None:
            self.first_ns, self.first_sequence = time_ns, sequence
        else:
            gap = time_ns - self.last_ns
            if self.max_gap_ns is None or gap > self.max_gap_ns:
                self.max_gap_ns, self.max_gap_at_ns = max(0, gap), self.last_ns
            if sequence > self.last_sequence + 1:
                self.skipped += sequence - self.last_sequence - 1
        self.last_ns, self.last_sequence = time_ns, sequence


@dataclass(frozen=True, slots=True)
class Log:
    """A log that was read once from end to end; messages are read again when they are asked for."""

    path: Path
    size: int  # [bytes] of the file
    run: Mapping[str, str] | None  # metadata `mjnav/run`; None where mjnav did not write the file
    result: Mapping[str, Any] | None  # metadata `mjnav/result`; None where the run did not end
    recovered: Mapping[str, Any] | None  # metadata `mjnav/recovered`: what was lost of the log it was made from
    attachments: Mapping[str, bytes]
    topics: Mapping[str, TopicSummary]
    truncated: bool  # the file has no end: its writer was killed
    unregistered: int  # messages of which no record says the topic
    lost: tuple[LostBytes, ...] = ()
    error: DamagedLogError | None = None  # None where nothing but the end is missing

    def __repr__(self) -> str:
        run = self.run or {}
        parts = [
            f"{word}{run[key]}" for key, word in (("scene", ""), ("controller", ""), ("seed", "seed ")) if key in run
        ]
        parts += [f"{self.duration or 0.0:.1f} s", f"{sum(t.messages for t in self.topics.values())} messages"]
        state = "damaged" if self.damaged else "no end" if self.truncated else ""
        return f"Log({str(self.path)!r}: {printable(', '.join([*parts, *([state] if state else [])]))})"

    @property
    def damaged(self) -> bool:
        """Messages are those that are intact before and behind the damage."""
        return self.error is not None

    @property
    def complete(self) -> bool:
        """The run ended and said so."""
        return self.result is not None

    @property
    def start_ns(self) -> int | None:
        """When the first message was [ns]; None without messages."""
        return min((topic.first_ns for topic in self.topics.values() if topic.first_ns is not None), default=None)

    @property
    def duration(self) -> float | None:
        """Simulated time from the first message to the last [s]; None without messages."""
        lasts = [topic.last_ns for topic in self.topics.values() if topic.last_ns is not None]
        return None if self.start_ns is None else 1e-9 * (max(lasts) - self.start_ns)

    def scenario(self, attachment: str = log_format.SCENARIO) -> Scenario:
        """The run file that the log carries, or another attachment. Raises InputError where it carries none."""
        if attachment not in self.attachments:
            raise InputError(f"{self.path}: holds no {attachment}; was it written by mjnav?")
        file = f"{self.path}: {attachment}"
        try:
            text = self.attachments[attachment].decode()
        except UnicodeDecodeError as error:
            raise InputError(f"{file}: not text in UTF-8") from error
        return loads(text, file=file, recorded=True)

    def messages(self, *topics: str) -> Iterator[LogMessage]:
        """The messages of these topics, or of all, in the order in which they were written.

        Raises DamagedLogError where one cannot be decoded as its topic's schema says.
        """
        factory = DecoderFactory()  # it remembers schemas by their number in this file
        decoders: dict[int, Callable[[bytes], Any]] = {}
        for schema, channel, message in self._encoded(*(topics or self.topics)):
            try:
                if (decode := decoders.get(channel.id)) is None:
                    decode = decoders[channel.id] = _decoder(factory, schema, channel.message_encoding)
                value = decode(message.data)
            except Exception as error:  # protobuf's descriptor pool documents none of its exceptions
                what = f"{channel.topic} holds what its schema does not say ({error})"
                raise DamagedLogError(f"{self.path}: damaged: {what}") from error
            yield LogMessage(channel.topic, message.log_time, message.sequence, value)

    def table(self, name: str) -> "DataFrame":
        """A topic's table, with the columns and values of `mjnav export --format csv`.

        A row has the number of its tick and its simulated time [s] in the columns `tick` and `time`, and a topic has
        none, one or many rows a tick. `name` is a topic's, which gives the first of its tables, or that of a CSV file
        without suffix ("decision_cone"). `attrs["units"]` has the unit of each column.

        Raises InputError for an unknown name, another program's log or where pandas is not installed, DamagedLogError
        where a message is not one of mjnav's.
        """
        topic, table = find_table(name)
        self.check_ours()
        return data_frame(self.path, table, self.messages(topic))

    def check_ours(self) -> None:
        """Raises InputError where another program wrote the log."""
        if self.run is None:
            raise InputError(f"{self.path}: not a run of mjnav, and no other log can be exported")

    def trajectory(self) -> Trajectory:
        """The run as arrays: the same as the loop's own, to the last bit.

        It ends before the first tick that is not whole, where the writer was killed or the log dropped one, so that
        every row is one period after the one before; the last tick before which everything is there gives the truth's
        last row. Raises InputError where there is no whole tick, DamagedLogError where one is not mjnav's.
        """
        assembler = TickAssembler()
        try:
            for message in self.messages(*TICK, TIMING):
                assembler.add(message.topic, message.sequence, message.value)
            run = assembler.finish()
        except BadDocument as error:
            raise DamagedLogError(f"{self.path}: {error}") from error
        if run is None:
            raise InputError(f"{self.path}: holds no whole tick of a run")
        return run.trajectory

    def whole_ticks(self) -> tuple[LoggedRun | None, Mapping[str, int]]:
        """All whole ticks, across gaps; and how many documents are not JSON, by topic.

        Memory is bounded by the largest chunk and a row of arrays a tick.
        """
        assembler, not_json = TickAssembler(across_gaps=True), Counter[str]()
        for _, channel, message in self._encoded(*TICK, TIMING):
            if channel.message_encoding == "json":
                try:
                    assembler.add(channel.topic, message.sequence, json.loads(message.data))
                except (ValueError, RecursionError):
                    not_json[channel.topic] += 1
        return assembler.finish(), not_json

    def _encoded(self, *topics: str) -> Iterator[tuple[records.Schema | None, records.Channel, records.Message]]:
        """Each message of these topics with its schema and channel."""
        schemas: dict[int, records.Schema] = {}
        channels: dict[int, tuple[records.Schema | None, records.Channel]] = {}
        for record in read_records(self.path):
            if isinstance(record, records.Message):
                if record.channel_id in channels:
                    yield *channels[record.channel_id], record
            elif isinstance(record, records.Schema):
                schemas[record.id] = record
            elif isinstance(record, records.Channel) and record.topic in topics:
                channels[record.id] = schemas.get(record.schema_id), record


def _decoder(factory: DecoderFactory, schema: records.Schema | None, encoding: str) -> Callable[[bytes], Any]:
    return json.loads if encoding == "json" else factory.decoder_for(encoding, schema) or bytes


def decoder(schema: Schema) -> Callable[[bytes], Any]:
    """How `Log.messages` decodes the messages of a schema that mjnav writes."""
    record = records.Schema(id=1, data=schema.data, encoding=schema.encoding, name=schema.name)
    return _decoder(DecoderFactory(), record, schema.message_encoding)


def open_log(path: str | os.PathLike[str], *, allow_damage: bool = False) -> Log:
    """Reads a log from end to end and verifies every checksum.

    A file whose writer was killed is read as far as it goes. With `allow_damage`, damaged records of any other are left
    out, and `Log.error` says what is wrong.

    Raises InputError where the file is missing or not MCAP, and, unless allowed, DamagedLogError where a checksum fails
    or nothing in it can be read.
    """
    path, error = Path(path_text("log", path)), None
    metadata: dict[str, dict[str, str]] = {}
    attachments: dict[str, bytes] = {}
    topics: dict[str, TopicSummary] = {}
    schemas: dict[int, str] = {}  # names
    topic_of: dict[int, TopicSummary] = {}  # by channel
    lost: list[LostBytes] = []
    truncated, unregistered = True, 0
    for record in read_records(path):
        if isinstance(record, records.Message):
            if (topic := topic_of.get(record.channel_id)) is None:
                unregistered += 1
            else:
                topic.add(record.log_time, record.sequence, len(record.data))
        elif isinstance(record, records.Schema):
            schemas[record.id] = record.name
        elif isinstance(record, records.Channel):
            summary = TopicSummary(schemas.get(record.schema_id, ""))
            topic_of[record.id] = topics.setdefault(record.topic, summary)
        elif isinstance(record, records.Metadata):
            metadata[record.name] = record.metadata
        elif isinstance(record, records.Attachment):
            attachments[record.name] = record.data
        elif isinstance(record, records.Footer):
            truncated = False
        elif isinstance(record, LostBytes):
            lost.append(record)
            if record.is_damage and error is None:
                error = DamagedLogError(f"{path}: damaged: bytes {record.start} to {record.end}: {record.why}")
                if not allow_damage:
                    raise error
    run = metadata.get(log_format.RUN)
    if run is not None:
        log_format.check_version(path, run)
    return Log(
        path=path,
        size=path.stat().st_size,
        run=None if run is None else MappingProxyType(run),
        result=_values(metadata.get(log_format.RESULT)),
        recovered=_values(metadata.get(log_format.RECOVERED)),
        attachments=MappingProxyType(attachments),
        topics=MappingProxyType(topics),
        truncated=truncated,
        unregistered=unregistered,
        lost=tuple(lost),
        error=error,
    )


def _values(texts: Mapping[str, str] | None) -> Mapping[str, Any] | None:
    """Metadata whose values are JSON where they can be read as that, else strings."""
    return None if texts is None else MappingProxyType({key: _value(text) for key, text in texts.items()})


def _value(text: str) -> object:
    if text.count("[") + text.count("{") > MAX_NESTING:  # none of mjnav's: it could be too deep to be printed
        return text
    try:
        return json.loads(text)
    except ValueError:
        return text
