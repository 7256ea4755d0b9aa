"""A log read back: what it holds, its messages, and the run as arrays."""

import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import mcap.records as records
from mcap_protobuf.decoder import DecoderFactory

from mjnav.errors import DamagedLogError, InputError
from mjnav.messages import Trajectory
from mjnav.recording.read.stream import read_records
from mjnav.recording.read.survey import Survey, TopicSummary
from mjnav.recording.read.ticks import TICK, TIMING, BadDocument, TickAssembler
from mjnav.recording.recover.recover import RECOVERED
from mjnav.recording.recover.salvage import salvage
from mjnav.recording.write.writer import RESULT, RUN, SCENARIO
from mjnav.scenarios import Scenario, loads


class LogMessage(NamedTuple):
    """One decoded message: JSON as a dict, protobuf as its message object, anything else as bytes."""

    topic: str
    time_ns: int
    sequence: int  # the tick
    value: Any


MAX_NESTING = 500  # brackets in a value of metadata


@dataclass(frozen=True, slots=True)
class Log:
    """A log that was read once from end to end; messages are read again when they are asked for."""

    path: Path
    run: Mapping[str, str] | None  # metadata `mjnav/run`; None where mjnav did not write the file
    result: Mapping[str, Any] | None  # metadata `mjnav/result`; None where the run did not end
    attachments: Mapping[str, bytes]
    topics: Mapping[str, TopicSummary]
    truncated: bool  # the file has no end: its writer was killed
    recovered: Mapping[str, Any] | None = None  # metadata `mjnav/recovered`: what was lost of the log it was made from
    damaged: bool = False  # messages are those that are intact before and behind the damage

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

    def scenario(self, attachment: str = SCENARIO) -> Scenario:
        """The run file that the log carries, or another attachment. Raises InputError where it carries none."""
        if attachment not in self.attachments:
            raise InputError(f"{self.path}: holds no {attachment}; was it written by mjnav?")
        file = f"{self.path}: {attachment}"
        try:
            text = self.attachments[attachment].decode()
        except UnicodeDecodeError as error:
            raise InputError(f"{file}: not text in UTF-8") from error
        return loads(text, file=file)

    def messages(self, *topics: str) -> Iterator[LogMessage]:
        """The messages of these topics, or of all, in the order in which they were written.

        Raises DamagedLogError where one is not what its topic says.
        """
        wanted = set(topics) or set(self.topics)
        schemas: dict[int, records.Schema] = {}
        channels: dict[int, tuple[str, Callable[[bytes], Any]]] = {}
        factory = DecoderFactory()  # it remembers schemas by their number in this file
        for record in salvage(self.path) if self.damaged else read_records(self.path):
            if isinstance(record, records.Message):
                if record.channel_id in channels:
                    topic, decode = channels[record.channel_id]
                    with self._decoding(topic):
                        value = decode(record.data)
                    yield LogMessage(topic, record.log_time, record.sequence, value)
            elif isinstance(record, records.Schema):
                schemas[record.id] = record
            elif isinstance(record, records.Channel) and record.topic in wanted:
                if record.message_encoding == "json":
                    decode = json.loads
                else:
                    with self._decoding(record.topic):
                        schema = schemas.get(record.schema_id)
                        decode = factory.decoder_for(record.message_encoding, schema) or bytes
                channels[record.id] = (record.topic, decode)

    @contextmanager
    def _decoding(self, topic: str) -> Iterator[None]:
        try:
            yield
        except Exception as error:  # protobuf's descriptor pool raises what it likes
            raise DamagedLogError(
                f"{self.path}: damaged: {topic} holds what its schema does not say ({error})"
            ) from error

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


def _values(texts: Mapping[str, str]) -> Mapping[str, Any]:
    """Metadata whose values are JSON where they can be read as that, else strings."""
    return MappingProxyType({key: _value(text) for key, text in texts.items()})


def _value(text: str) -> object:
    if text.count("[") + text.count("{") > MAX_NESTING:  # none that is mjnav's: it could be too deep to be printed
        return text
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
    survey = Survey()
    for record in read_records(path):
        survey.add(record)
    return surveyed(path, survey)


def surveyed(path: Path, survey: Survey) -> Log:
    """The log whose records were surveyed."""
    run, result, recovered = (survey.metadata.get(name) for name in (RUN, RESULT, RECOVERED))
    return Log(
        path=path,
        run=None if run is None else MappingProxyType(run),
        result=None if result is None else _values(result),
        recovered=None if recovered is None else _values(recovered),
        attachments=MappingProxyType(survey.attachments),
        topics=MappingProxyType(survey.topics),
        truncated=not survey.has_end,
    )
