"""The recorder: writes one MCAP file a run, complete up to its last flush also where the process is killed.

`LogFile` is the file while it is written: it holds whole records, also after a disk error.
"""

import errno
import gzip
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import IO, Self, cast

from mcap.writer import Writer

from mjnav.errors import InputError, MjnavError
from mjnav.log import log_format
from mjnav.log.encode.geometry import time_ns
from mjnav.log.encode.json_messages import encode_timing
from mjnav.log.encode.topics import EVENTS, TIMING, Topic, encode_event, topics
from mjnav.log.live import LiveServer
from mjnav.log.write.sink import DirectSink, Message, ThreadSink
from mjnav.messages import Event, TickRecord, TickTiming, WorldState
from mjnav.printable import printable
from mjnav.scene import Scenario, dumps


class LogFile:
    """A new file, to which each call of `write` appends all of its bytes, whole MCAP records, or none.

    Nothing is buffered in the process, so that what was written outlives it. Raises FileExistsError where the file
    exists. Every `write` raises OSError where the disk refuses the bytes or the file was deleted or truncated: Linux
    would go on to write to a file without a name, or behind a hole.
    """

    def __init__(self, path: Path):
        self._file = open(path, "xb", buffering=0)  # noqa: SIM115 - closed in close
        state = os.fstat(self._file.fileno())
        self._identity = state.st_dev, state.st_ino
        self._size = 0

    def write(self, data: bytes) -> int:
        """Appends all of `data`, or raises OSError and leaves the file as it was."""
        rest = memoryview(data)
        self.check()
        try:
            while rest.nbytes:
                rest = rest[self._file.write(rest) :]
        except OSError:
            with suppress(OSError):
                self._file.seek(self._size)
                self._file.truncate()
            raise
        self._size += len(data)
        return len(data)

    def tell(self) -> int:
        """The number of bytes written."""
        return self._size

    def flush(self) -> None:
        """Does nothing."""

    def close(self) -> None:
        """Closes the file. Raises OSError where the system reports only now what it could not write."""
        try:
            self._file.close()
        except OSError as error:
            if error.errno != errno.EBADF:  # the descriptor was closed before
                raise

    def check(self) -> None:
        """Raises OSError where the descriptor was closed, or the file was deleted or truncated."""
        try:
            state = os.fstat(self._file.fileno())
        except OSError:
            state = None
        if state is None or (state.st_dev, state.st_ino) != self._identity:  # its number may belong to another file
            raise OSError(errno.EBADF, "its descriptor was closed")
        if not state.st_nlink:
            raise FileNotFoundError(errno.ENOENT, "it was deleted")
        if state.st_size < self._size:
            raise OSError(errno.EIO, "it was truncated")


class LogError(MjnavError):
    """The log cannot be written any more; the message says how much of it can be read."""


def _result_value(value: object) -> str:
    """Text as it is, if printable; any other value as JSON, and so text that is valid JSON itself."""
    if isinstance(value, str):
        try:
            json.loads(value)
        except ValueError:
            return printable(value)  # the name of a file may hold bytes that are no text
    return json.dumps(value)


class Recorder:
    """Writes the log of one run; a context manager, after which the log is readable also where it ends in an exception.

    `path` is checked as `check_path` does, and the file appears with the first tick. `run_info` becomes the metadata
    `mjnav/run` (seed, scene, controller, versions, argv, ...), `model_xml` the attachment `model.xml.gz`. A log that is
    `threaded` encodes and writes on a separate thread: slower in total, but not within the tick in real time. Where
    the disk cannot keep up, such a log drops ticks rather than hold the loop up; `dropped` counts their parts. What is
    written goes to the clients of `live`, too; `path` may then be None for no file. Stamps are simulated time.

    Where the disk takes no more, or the file is deleted or truncated, a call soon after raises LogError, and
    so does every later one. The file then keeps the whole records before and, where there is room, the result.
    """

    def __init__(
        self,
        path: str | os.PathLike | None,
        scenario: Scenario,
        run_info: Mapping[str, str],
        model_xml: str,
        *,
        threaded: bool = False,
        live: LiveServer | None = None,
    ):
        self.path = None if path is None else log_format.check_path(path)
        self._run_info = {**run_info, log_format.FRAMES_KEY: log_format.FRAMES}
        self._attachments = (
            (log_format.SCENARIO, "application/toml", dumps(scenario).encode()),
            (log_format.MODEL, "application/gzip", gzip.compress(model_xml.encode(), mtime=0)),
            (log_format.LAYOUT, "application/json", Path(__file__).with_name(log_format.LAYOUT).read_bytes()),
        )
        every = topics(scenario)
        self._live_only = frozenset(topic.name for topic in every if topic.drawing)
        self._topics = tuple(t for t in every if live is not None or t.name not in self._live_only)
        self._awaited = tuple(t for t in self._topics if t.occasional and path is not None)  # by the file
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}  # of the file, by name
        self._file: LogFile | None = None
        self._writer: Writer | None = None
        self._sink = ThreadSink() if threaded else DirectSink()
        self._last: tuple[int, int] = (-1, 0)  # number and time [ns] of the last tick
        self._closed = False
        self._live = live

    @property
    def dropped(self) -> int:
        """How many parts of ticks were dropped: all of a tick's messages but its timing, or its timing."""
        return self._sink.dropped

    def open(self) -> None:
        """Creates the file; without this call the first tick does.

        Raises InputError where the file cannot be made, or exists by now, LogError where it cannot be written.
        """
        if self._channels or self._closed:
            return
        if self.path is not None:
            self._create(self.path)
        # In the order in which the file has its channels: from its beginning, from a first message on, never.
        order = sorted(self._topics, key=lambda t: (t.name in self._live_only, t.occasional))
        self._channels = {topic.name: number for number, topic in enumerate(order, 1)}
        destination = self._writer
        if self._live is not None:
            destination = self._live.writer(self._channels, self._writer, self._live_only)
        assert destination is not None  # a file, clients or both
        self._sink.attach(destination)

    def write(self, record: TickRecord) -> None:
        """One tick: everything but its timing, which is known only afterwards."""
        self.open()
        now = time_ns(record.truth.time)
        self._last = record.tick, now
        self._put(self._encoded(record, now), may_drop=True)

    def _encoded(self, record: TickRecord, now: int) -> Iterator[Message]:
        """A tick's messages; each is encoded when the iterator reaches it."""
        for reading in record.readings_before:
            for topic in self._topics:
                if topic.encode_reading is not None and (data := topic.encode_reading(reading)) is not None:
                    yield Message(self._channels[topic.name], time_ns(reading.time), record.tick, data)
        for topic in self._topics:
            if topic.encode is not None and (data := topic.encode(record)) is not None:
                if topic.occasional and self._awaited:
                    self._register(self._awaited)
                    self._awaited = ()
                yield Message(self._channels[topic.name], now, record.tick, data)
        for event in record.events:
            yield Message(self._channels[EVENTS], now, record.tick, encode_event(record.truth.time, event))

    def write_timing(self, timing: TickTiming) -> None:
        """The timing of the tick that was written last."""
        if not self._channels:
            raise ValueError("a tick's timing comes after the tick")
        now = self._last[1]
        self._put([Message(self._channels[TIMING], now, timing.tick, encode_timing(timing))], may_drop=True)

    def finish(
        self,
        final: WorldState,
        result: Mapping[str, object],
        events: Iterable[Event] = (),
        replay: Scenario | None = None,
    ) -> None:
        """The state in which the run ended, its last events, the metadata `mjnav/result`, and the end of the file.

        `replay`, where it is not the run's own, is the scenario that repeats it: the attachment `replay.toml`.
        """
        self.open()
        now, tick = time_ns(final.time), self._last[0] + 1
        batch = [
            Message(self._channels[topic.name], now, tick, topic.encode_final(tick, final))
            for topic in self._topics
            if topic.encode_final is not None
        ]
        batch += [Message(self._channels[EVENTS], now, tick, encode_event(final.time, event)) for event in events]
        try:
            self._put(batch)
        finally:
            self._close({key: _result_value(value) for key, value in result.items()}, replay)

    def abort(self) -> None:
        """Ends the file without a result; what was written before is readable. Does nothing after `finish`."""
        if not self._closed:
            with suppress(MjnavError):  # the last call of `write` has raised it
                self._close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.abort()

    def _create(self, path: Path) -> None:
        """Creates the file and writes all that a reader needs before the first message."""
        try:
            self._file = LogFile(path)
        except OSError as error:
            raise InputError(f"{path}: cannot be written: {error.strerror}") from error
        writer = self._writer = log_format.mcap_writer(cast(IO[bytes], self._file))
        try:
            with self._one_line():
                writer.start(library="mjnav")
                writer.add_metadata(log_format.RUN, {log_format.FORMAT_KEY: str(log_format.FORMAT), **self._run_info})
                for name, media_type, data in self._attachments:
                    writer.add_attachment(0, 0, name, media_type, data)
                self._register([t for t in self._topics if not (t.name in self._live_only or t.occasional)])
                writer.flush()
        except LogError:
            path.unlink(missing_ok=True)  # this recorder made it, and it holds no message
            raise

    def _register(self, table: Iterable[Topic]) -> None:
        """Gives the file a channel for each topic, numbered from 1 on; topics share a schema of the same name."""
        writer, schemas = self._writer, self._schemas
        assert writer is not None
        for topic in table:
            schema = topic.schema
            if schema.name not in schemas:
                schemas[schema.name] = writer.register_schema(schema.name, schema.encoding, schema.data)
            writer.register_channel(topic.name, schema.message_encoding, schemas[schema.name])

    def _put(self, batch: Iterable[Message], *, may_drop: bool = False) -> None:
        if self._closed:
            raise ValueError("a log takes nothing after its end")
        with self._one_line():
            self._sink.put(batch, may_drop=may_drop)

    def _close(self, result: Mapping[str, str] | None = None, replay: Scenario | None = None) -> None:
        """Closes the sink and the file, with `mjnav/result` where there is one."""
        self._closed = True
        fault: Exception | None = None
        try:
            with self._one_line():
                try:
                    self._sink.close()
                except OSError:
                    raise
                except Exception as error:  # the file still gets its end
                    fault = error
                if self._writer is not None:
                    _end(self._writer, result, replay)
        except LogError as error:
            if isinstance(error.__cause__, TimeoutError):
                self._file = None  # the thread that hangs still uses it
            if self._file is not None and result is not None:
                with suppress(OSError):  # a single record, where the disk has room for one
                    Writer(cast(IO[bytes], self._file), use_chunking=False).add_metadata(
                        log_format.RESULT, dict(result)
                    )
            raise
        finally:
            if self._file is not None:
                with self._one_line():
                    self._file.close()
        if fault is not None:
            raise fault

    @contextmanager
    def _one_line(self) -> Iterator[None]:
        """Turns an OSError into a LogError of one line."""
        try:
            yield
        except OSError as error:
            raise LogError(f"{self.path}: writing failed: {error.strerror}; {self._left()}") from error

    def _left(self) -> str:
        """How much can be read of a log that cannot be written any more."""
        flushed = self._sink.flushed_ns
        if self._file is None or flushed is None:
            return "nothing of it is left"
        try:
            self._file.check()
        except FileNotFoundError:
            return "nothing of it is left"
        except OSError:
            return "what is left of it can be read"
        return f"it can be read at least up to {flushed // 10**8 / 10:.1f} s"


def _end(writer: Writer, result: Mapping[str, str] | None, replay: Scenario | None) -> None:
    if result is not None:
        writer.flush()
        if replay is not None:
            writer.add_attachment(0, 0, log_format.REPLAY, "application/toml", dumps(replay).encode())
        writer.add_metadata(log_format.RESULT, dict(result))
    writer.finish()
