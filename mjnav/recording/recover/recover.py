"""Makes a whole log of a damaged one: all that is intact, and what was lost as the metadata `mjnav/recovered`."""

import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import IO

from mcap.records import Attachment, Channel, Header, Message, Metadata, Schema
from mcap.writer import MCAP0_MAGIC

from mjnav.errors import DamagedLogError, InputError, MjnavError
from mjnav.recording.log_format import RECOVERED, check_path, mcap_writer
from mjnav.recording.read.file_bytes import FileBytes, file_bytes
from mjnav.recording.read.intact_records import intact_records
from mjnav.recording.recover.one_bit import changed_bit
from mjnav.recording.recover.recovery import Recovery, count_intact, unknown_topic

OnByte = Callable[[int], None]


def recover(
    log: str | os.PathLike[str], out: str | os.PathLike[str], *, on_byte: OnByte = lambda place: None
) -> Recovery:
    """Writes all that is intact in `log` to the new file `out`, and says what that is.

    A log that is not damaged, or of which only one bit is (the checksum of its data tells which), comes out byte for
    byte as it was written. Of any other a new file is made of the same schemas, channels, messages, attachments and
    metadata, in the same order, with the metadata `mjnav/recovered`: the file's name and the fields of the Recovery.
    `out` appears when it is whole. `on_byte` is told how far in `log` the reading is.

    Raises InputError where `log` cannot be read or is no MCAP file, and where `out` exists or cannot be written;
    DamagedLogError where there is nothing to recover; MjnavError where the disk is full.
    """
    check_path(out)
    found = count_intact(intact_records(log, on_byte=on_byte))
    if found.how != "intact" and (bit := changed_bit(log)) is not None:
        mended = count_intact(intact_records(log, inverted_bit=bit, on_byte=on_byte), bit)
        found = mended if mended.how == "mended" else found
    if found.how == "recovered" and not (found.messages or found.attachments or found.metadata):
        with file_bytes(log) as file:
            begins_as_one = file.read(0, len(MCAP0_MAGIC)) == MCAP0_MAGIC
        if begins_as_one:
            raise DamagedLogError(f"{log}: damaged: nothing in it can be recovered")
        raise InputError(f"{log}: not an MCAP file, and nothing in it is a piece of one")
    with _appearing(Path(out)) as file:
        if found.how == "recovered":
            _write(log, found, file, on_byte)
        else:
            with file_bytes(log, found.changed_bit) as source:
                _copy(source, file, on_byte)
    return found


def _copy(source: FileBytes, file: IO[bytes], on_byte: OnByte) -> None:
    for place, block in source.blocks(0, source.size):
        on_byte(place)
        file.write(block)


def _write(log: str | os.PathLike[str], found: Recovery, file: IO[bytes], on_byte: OnByte) -> None:
    """A new file, whose numbers of schemas and channels may be others."""
    writer = mcap_writer(file)
    writer.start(profile=_profile(log), library="mjnav recover")
    schemas: dict[int, int] = {}
    channels: dict[int, int] = {}
    for record, _ in intact_records(log, on_byte=on_byte):
        if isinstance(record, Message):
            if record.channel_id not in channels:
                channels[record.channel_id] = writer.register_channel(unknown_topic(record.channel_id), "", 0)
            channel = channels[record.channel_id]
            writer.add_message(channel, record.log_time, record.data, record.publish_time, record.sequence)
        elif isinstance(record, Schema) and record.id not in schemas:
            schemas[record.id] = writer.register_schema(record.name, record.encoding, record.data)
        elif isinstance(record, Channel) and record.id not in channels:
            schema = schemas.get(record.schema_id, 0)  # 0: without a schema, as the format has it
            channels[record.id] = writer.register_channel(
                record.topic, record.message_encoding, schema, record.metadata
            )
        elif isinstance(record, Attachment):
            writer.flush()  # so that it comes behind the messages before it
            writer.add_attachment(record.create_time, record.log_time, record.name, record.media_type, record.data)
        elif isinstance(record, Metadata):
            writer.flush()
            writer.add_metadata(record.name, record.metadata)
    writer.flush()
    described = {"file": Path(log).name, "size": os.path.getsize(log), **asdict(found)}
    writer.add_metadata(
        RECOVERED, {key: value if isinstance(value, str) else json.dumps(value) for key, value in described.items()}
    )
    writer.finish()


def _profile(log: str | os.PathLike[str]) -> str:
    """What the file's header says that it follows; empty where the header is lost."""
    for record, _ in intact_records(log):
        if isinstance(record, Header):
            return record.profile
        if isinstance(record, Message | Attachment | Metadata):
            break
    return ""


@contextmanager
def _appearing(path: Path) -> Iterator[IO[bytes]]:
    """A file beside `path` that gets its name once it is whole and on the disk, or of which nothing is left."""
    partial = path.with_name(f".{path.stem}-{os.getpid()}{path.suffix}")
    try:
        with open(partial, "xb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        check_path(path)  # once more: the file may have been made meanwhile
        partial.rename(path)
    except OSError as error:
        raise MjnavError(f"{path}: writing failed: {error.strerror or error}") from error
    finally:
        partial.unlink(missing_ok=True)
