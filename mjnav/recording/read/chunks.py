"""From bytes to records, believing nothing that a damaged or foreign file says about itself.

mcap's own reader allocates what a length field asks for, takes a record cut short for a whole one and decompresses
without bound: fine for what one wrote oneself, not for what one wants to find out about.
"""

import struct
import zlib
from collections.abc import Iterator
from io import BytesIO

import lz4.frame
import zstandard
from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, McapError
from mcap.opcode import Opcode

from mjnav.recording.read.budget import Budget

LIMIT = 256 * 1024 * 1024  # [bytes] of one record, and of one chunk decompressed; writers' chunks are around 1 MiB
LZ4_EXPANSION = 255  # at most: a byte of a match's length stands for 255

_RECORD = struct.Struct("<BQ")  # opcode, length
_CHUNK = struct.Struct("<QQQII")  # start and end time, size, checksum, length of the compression's name
_MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time

_PARSED = {
    Opcode.HEADER: records.Header,
    Opcode.FOOTER: records.Footer,
    Opcode.SCHEMA: records.Schema,
    Opcode.CHANNEL: records.Channel,
    Opcode.METADATA: records.Metadata,
    Opcode.DATA_END: records.DataEnd,
}


class BadRecord(ValueError):
    """A record that contradicts itself; the text says how."""


class _Exact(BytesIO):
    """Reads all that is asked for or nothing."""

    def read(self, size: int | None = -1, /) -> bytes:
        if size is None or not 0 <= size <= self.getbuffer().nbytes - self.tell():
            raise EndOfFile
        return super().read(size)


def parse_record(opcode: int, body: bytes) -> records.McapRecord | None:
    """A record that is no chunk; None for an index, a statistic or what the format does not know. Raises BadRecord."""
    try:
        if opcode == Opcode.MESSAGE:
            return _message(memoryview(body))
        if opcode == Opcode.ATTACHMENT:
            return _attachment(body)
        kind = _PARSED.get(opcode)  # type: ignore[call-overload]
        return None if kind is None else kind.read(ReadDataStream(_Exact(body)))
    except (McapError, struct.error, ValueError) as error:
        raise BadRecord(f"a record that makes no sense ({_name(opcode)}: {error or type(error).__name__})") from error


def chunk_records(body: bytes, budget: Budget | None = None) -> Iterator[records.McapRecord]:
    """The schemas, channels and messages in a chunk whose checksum holds. Raises BadRecord.

    Takes off the budget of the file that it is in what it holds.
    """
    budget = budget or Budget(len(body))
    data = memoryview(chunk_data(body, budget))
    position, end = 0, len(data)
    while position < end:
        if end - position < _RECORD.size:
            raise BadRecord("a chunk that ends within a record")
        opcode, length = _RECORD.unpack_from(data, position)
        position += _RECORD.size
        if opcode == 0:
            raise BadRecord("a chunk with a record of kind 0, which does not exist")
        if length > end - position:
            raise BadRecord(f"a chunk with a record of {length} bytes, of which it holds {end - position}")
        if not budget.allows_record():
            raise BadRecord("more records in its chunks than a file of its size may hold")
        content = data[position : position + length]
        position += length
        if opcode == Opcode.MESSAGE:
            yield _message(content)
        elif (record := parse_record(opcode, bytes(content))) is not None:
            yield record


def chunk_data(body: bytes, budget: Budget) -> bytes:
    """A chunk's content, decompressed and with its checksum verified. Raises BadRecord."""
    try:
        _, _, size, checksum, name_length = _CHUNK.unpack_from(body)
        (length,) = struct.unpack_from("<Q", body, _CHUNK.size + name_length)
    except struct.error as error:
        raise BadRecord(f"a chunk without its beginning ({error})") from error
    compression = body[_CHUNK.size : _CHUNK.size + name_length]
    data = memoryview(body)[_CHUNK.size + name_length + 8 :]
    if length != len(data):
        raise BadRecord(f"a chunk of {length} bytes, of which it holds {len(data)}")
    if size > LIMIT:
        raise BadRecord(f"a chunk of {size} bytes decompressed, more than the {LIMIT} that are read")
    if not budget.allows_contents(size):
        raise BadRecord(f"a chunk that claims {size} bytes of contents for {length} compressed: more than allowed")
    content = _decompress(compression, data, size)
    if checksum and zlib.crc32(content) != checksum:
        raise BadRecord("a chunk that does not match its checksum")
    return content


def _decompress(compression: bytes, data: memoryview, size: int) -> bytes:
    """Exactly `size` bytes, never more."""
    try:
        match compression:
            case b"lz4" if size <= LZ4_EXPANSION * len(data):
                content = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size) if size else b""
            case b"zstd" if zstandard.frame_content_size(data) in (-1, size):  # -1: it does not say
                content = zstandard.ZstdDecompressor().decompress(data, max_output_size=size) if size else b""
            case b"":
                content = bytes(data)
            case b"lz4" | b"zstd":
                raise BadRecord(f"a chunk that cannot hold the {size} bytes it speaks of")
            case _:
                raise BadRecord(f"a chunk whose compression {compression[:20].decode(errors='replace')!r} is unknown")
    except (RuntimeError, EOFError, zstandard.ZstdError, MemoryError) as error:
        raise BadRecord(f"a chunk that cannot be decompressed ({error})") from error
    if len(content) != size:
        raise BadRecord(f"a chunk of {len(content)} bytes that speaks of {size}")
    return content


def _message(content: memoryview) -> records.Message:
    if len(content) < _MESSAGE.size:
        raise BadRecord(f"a message of {len(content)} bytes")
    channel, sequence, log_time, publish_time = _MESSAGE.unpack_from(content)
    return records.Message(channel, log_time, bytes(content[_MESSAGE.size :]), publish_time, sequence)


def _attachment(body: bytes) -> records.Attachment:
    attachment = records.Attachment.read(ReadDataStream(_Exact(body)))
    (checksum,) = struct.unpack("<I", body[-4:])
    if checksum and zlib.crc32(body[:-4]) != checksum:
        raise BadRecord("an attachment that does not match its checksum")
    return attachment


def _name(opcode: int) -> str:
    try:
        return Opcode(opcode).name.lower()
    except ValueError:
        return f"kind {opcode}"
