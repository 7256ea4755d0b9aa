"""Makes a whole log of a damaged one: all that is intact, and what was lost as the metadata `mjnav/recovered`."""

import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from mcap.records import Attachment, Channel, Message, Metadata, Schema
from mcap.writer import MCAP0_MAGIC, CompressionType, Writer

from mjnav.errors import DamagedLogError, InputError, MjnavError
from mjnav.recording.recover.one_bit import changed_bit
from mjnav.recording.recover.probe import Bytes, opened
from mjnav.recording.recover.recovery import Recovery, unknown_topic
from mjnav.recording.recover.salvage import salvage
from mjnav.recording.write.writer import CHUNK_SIZE, check_path

RECOVERED = "mjnav/recovered"

OnByte = Callable[[int], None]


def recover(
    log: str | os.PathLike[str], out: str | os.PathLike[str], *, on_byte: OnByte = lambda place: None
) -> Recovery:
    """Writes all that is intact in `log` to the new file `out`, and says what that is.

    A log that is not damaged, or of which only one bit is (the checksum of its data tells which), comes out byte for
    byte as it was written. Of any other a new file is made of the same schemas, channels, messages, attachments and
    metadata, in the same order, with the metadata `mjnav/recovered`: the file's name and the document of the Recovery.
    `out` appears when it is whole. `on_byte` is told how far in `log` the reading is.

    Raises InputError where `log` cannot be read or is no MCAP file, and where `out` exists or cannot be written;
    DamagedLogError where there is nothing to recover; MjnavError where the disk is full.
    """
    check_path(out)
    recovery = _surveyed(log, None, on_byte)
    if not recovery.intact and (bit := changed_bit(log)) is not None:
        mended = _surveyed(log, bit, on_byte)
        recovery = mended if mended.intact else recovery
    if recovery.holds_nothing:
        with opened(log) as file:
            begins_as_one = file.read(0, len(MCAP0_MAGIC)) == MCAP0_MAGIC
        if begins_as_one:
            raise DamagedLogError(f"{log}: damaged: nothing in it can be recovered")
        raise InputError(f"{log}: not an MCAP file, and nothing in it is a piece of one")
    with _appearing(Path(out)) as file:
        if recovery.intact:
            with opened(log, recovery.changed_bit) as source:
                _copy(source, file, on_byte)
        else:
            _write(log, recovery, file, on_byte)
    return recovery


def _surveyed(log: str | os.PathLike[str], other_bit: int | None, on_byte: OnByte) -> Recovery:
    with opened(log) as file:
        recovery = Recovery(file.size, other_bit)
    for item in salvage(log, other_bit=other_bit, on_byte=on_byte):
        recovery.add(item)
    return recovery


def _copy(source: Bytes, file: IO[bytes], on_byte: OnByte) -> None:
    for place, block in source.blocks(0, source.size):
        on_byte(place)
        file.write(block)


def _write(log: str | os.PathLike[str], recovery: Recovery, file: IO[bytes], on_byte: OnByte) -> None:
    """A new file, whose numbers of schemas and channels may be others."""
    writer = Writer(file, chunk_size=CHUNK_SIZE, compression=CompressionType.LZ4, enable_data_crcs=True)
    writer.start(profile=recovery.profile, library="mjnav recover")
    schemas: dict[int, int] = {}
    channels: dict[int, int] = {}
    for item in salvage(log, on_byte=on_byte):
        if isinstance(item, Message):
            if item.channel_id not in channels:
                channels[item.channel_id] = writer.register_channel(unknown_topic(item.channel_id), "", 0)
            channel = channels[item.channel_id]
            writer.add_message(channel, item.log_time, item.data, item.publish_time, item.sequence)
        elif isinstance(item, Schema) and item.id not in schemas:
            schemas[item.id] = writer.register_schema(item.name, item.encoding, item.data)
        elif isinstance(item, Channel) and item.id not in channels:
            schema = schemas.get(item.schema_id, 0)  # 0: without a schema, as the format has it
            channels[item.id] = writer.register_channel(item.topic, item.message_encoding, schema, item.metadata)
        elif isinstance(item, Attachment):
            writer.flush()  # so that it comes behind the messages before it
            writer.add_attachment(item.create_time, item.log_time, item.name, item.media_type, item.data)
        elif isinstance(item, Metadata):
            writer.flush()
            writer.add_metadata(item.name, item.metadata)
    writer.flush()
    described = {"file": Path(log).name, "size": recovery.size, **recovery.document()}
    writer.add_metadata(
        RECOVERED, {key: value if isinstance(value, str) else json.dumps(value) for key, value in described.items()}
    )
    writer.finish()


@contextmanager
def _appearing(path: Path) -> Iterator[IO[bytes]]:
    """A file beside `path` that gets its name once it is whole and on the disk, or of which nothing is left."""
    partial = path.with_name(f".{path.stem}-{os.getpid()}{path.suffix}")
    try:
        with open(partial, "xb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        check_path(path)  # once more: somebody may have made it meanwhile
        partial.rename(path)
    except OSError as error:
        raise MjnavError(f"{path}: writing failed: {error.strerror or error}") from error
    finally:
        partial.unlink(missing_ok=True)
