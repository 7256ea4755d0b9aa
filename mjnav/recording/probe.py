"""What stands at one byte of an MCAP file: a record that its checksum vouches for, one that only reads well, or none.

A record is an opcode (u8), a length (u64) and a body. Chunks and attachments carry checksums of their own. Of all other
records only the form can be told: whether the record, written again, is the same bytes.

Source: https://mcap.dev/spec
"""

import os
import struct
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from io import BytesIO
from types import MappingProxyType
from typing import IO

import lz4.frame
import mcap.records as records
import zstandard
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.stream_reader import breakup_chunk

HEADER_SIZE = 1 + 8  # [bytes] opcode and length
MAX_CHUNK = 2**28  # [bytes] before compression and after
MAX_UNCHECKED = 2**26  # [bytes] of a record without a checksum
_BLOCK = 2**20  # [bytes] read at a time
_CHUNK_FIELDS = struct.Struct("<QQQII")  # start, end, uncompressed size, checksum, length of the compression's name
_FRAME_MAGIC = MappingProxyType({"lz4": b"\x04\x22\x4d\x18", "zstd": b"\x28\xb5\x2f\xfd", "": b""})
_UNREADABLE = (McapError, struct.error, ValueError)  # what the library's parsers make of other bytes


class Bytes:
    """A file of which any range is read without reading the rest."""

    def __init__(self, file: IO[bytes]):
        self._descriptor = file.fileno()
        self.size = os.fstat(self._descriptor).st_size

    def read(self, start: int, end: int) -> bytes:
        """The bytes from `start` to before `end`, or to the file's end."""
        length = max(0, min(end, self.size) - start)
        pieces = []
        while length > 0 and (piece := os.pread(self._descriptor, length, start)):
            pieces.append(piece)
            start += len(piece)
            length -= len(piece)
        return pieces[0] if len(pieces) == 1 else b"".join(pieces)

    def blocks(self, start: int, end: int, overlap: int = 0) -> Iterator[tuple[int, bytes]]:
        """Where each block starts, and the block with `overlap` bytes of the next."""
        end = min(end, self.size)
        for place in range(start, end, _BLOCK):
            yield place, self.read(place, min(place + _BLOCK + overlap, end))

    def checksum(self, start: int, end: int) -> int:
        """CRC-32 of a range."""
        checksum = 0
        for _, block in self.blocks(start, end):
            checksum = zlib.crc32(block, checksum)
        return checksum

    def header(self, place: int) -> tuple[int, int]:
        """Opcode and length of the record at a byte; opcode 0, which no record has, where the file ends."""
        raw = self.read(place, place + HEADER_SIZE)
        return struct.unpack("<BQ", raw) if len(raw) == HEADER_SIZE else (0, 0)


@dataclass(frozen=True, slots=True)
class Found:
    """A record, where it ends, what is in it if it is a chunk, and whether a checksum of its own vouches for it."""

    record: records.McapRecord
    end: int
    contents: tuple[records.McapRecord, ...] = ()
    checked: bool = False


def record_at(file: Bytes, place: int, end: int) -> Found | None:
    """The record at a byte, if it is intact as far as can be told and does not pass `end`."""
    opcode, length = file.header(place)
    stop = place + HEADER_SIZE + length
    if stop > end:
        return None
    if opcode == Opcode.CHUNK:
        found = chunk_at(file, place, end)
    elif opcode == Opcode.ATTACHMENT:
        found = attachment_at(file, place, end)
    else:
        found = _unchecked_at(file, place, opcode, length)
    return found if found is not None and found.end == stop else None


def chunk_at(file: Bytes, place: int, end: int) -> Found | None:
    """The chunk at a byte, whatever opcode and lengths its header has, if its contents agree with their checksum.

    No more is decompressed than the size that the chunk states.
    """
    fields = file.read(place + HEADER_SIZE, place + HEADER_SIZE + _CHUNK_FIELDS.size)
    if len(fields) < _CHUNK_FIELDS.size:
        return None
    start_time, end_time, size, checksum, name_length = _CHUNK_FIELDS.unpack(fields)
    if size > MAX_CHUNK:
        return None
    for name, magic in _FRAME_MAGIC.items():
        start = place + HEADER_SIZE + _CHUNK_FIELDS.size + len(name) + 8
        if file.read(start, start + len(magic)) != magic or (not name and name_length):
            continue
        inner = int.from_bytes(file.read(start - 8, start), "little")
        outer = place + HEADER_SIZE + file.header(place)[1] - start
        for length in dict.fromkeys((outer, inner)):
            if not 0 <= length <= min(MAX_CHUNK, end - start):
                continue
            data = _decompressed(name, file.read(start, start + length), size)
            if data is None or not (agrees(checksum, zlib.crc32(data)) or (checksum == 0 and len(data) == size)):
                continue
            chunk = records.Chunk("", data, end_time, start_time, uncompressed_crc=0, uncompressed_size=size)
            try:
                contents = tuple(breakup_chunk(chunk))
            except _UNREADABLE:
                continue
            return Found(chunk, start + length, contents, checked=checksum != 0)
    return None


def attachment_at(file: Bytes, place: int, end: int) -> Found | None:
    """The attachment at a byte, whatever opcode and length its header has, if its bytes agree with their checksum.

    The checksum is computed in blocks before the attachment is read into memory.
    """
    start = place + HEADER_SIZE
    size_at = start + 16  # behind the times
    for _ in ("name", "media type"):
        size_at += 4 + int.from_bytes(file.read(size_at, size_at + 4), "little")
    data_end = size_at + 8 + int.from_bytes(file.read(size_at, size_at + 8), "little")
    stop = data_end + 4
    if stop > end:
        return None
    checksum = int.from_bytes(file.read(data_end, stop), "little")
    if checksum != 0 and not agrees(checksum, file.checksum(start, data_end)):
        return None
    try:
        attachment = records.Attachment.read(ReadDataStream(BytesIO(file.read(start, stop))))
    except _UNREADABLE:
        return None
    return Found(attachment, stop, checked=checksum != 0)


def agrees(stated: int, computed: int) -> bool:
    """Whether a checksum is that of the bytes, or differs in one bit: then it is the checksum that was damaged.

    No single changed bit of the bytes changes only one bit of their CRC-32, and any other damage does so once in 2^27.
    """
    return stated != 0 and (stated ^ computed).bit_count() <= 1


def _decompressed(name: str, data: bytes, size: int) -> bytes | None:
    """A chunk's data, at most `size` bytes; None where they cannot be decompressed or are more."""
    try:
        if name == "lz4":
            data = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1)
        elif name == "zstd":
            data = zstandard.ZstdDecompressor().stream_reader(data).read(size + 1)
    except (RuntimeError, EOFError, MemoryError, zstandard.ZstdError):
        return None
    return data if len(data) <= size else None


_Read = Callable[[ReadDataStream, int], records.McapRecord]


def _reader(kind: type) -> _Read:
    return lambda stream, length: kind.read(stream)


_UNCHECKED: Mapping[int, _Read] = MappingProxyType(
    {
        Opcode.HEADER: _reader(records.Header),
        Opcode.FOOTER: _reader(records.Footer),
        Opcode.SCHEMA: _reader(records.Schema),
        Opcode.CHANNEL: _reader(records.Channel),
        Opcode.MESSAGE: records.Message.read,
        Opcode.MESSAGE_INDEX: _reader(records.MessageIndex),
        Opcode.CHUNK_INDEX: _reader(records.ChunkIndex),
        Opcode.ATTACHMENT_INDEX: _reader(records.AttachmentIndex),
        Opcode.STATISTICS: _reader(records.Statistics),
        Opcode.METADATA: _reader(records.Metadata),
        Opcode.METADATA_INDEX: _reader(records.MetadataIndex),
        Opcode.SUMMARY_OFFSET: _reader(records.SummaryOffset),
        Opcode.DATA_END: _reader(records.DataEnd),
    }
)


def _unchecked_at(file: Bytes, place: int, opcode: int, length: int) -> Found | None:
    """A record without a checksum, if it is the same bytes when it is written again."""
    if (read := _UNCHECKED.get(opcode)) is None or length > MAX_UNCHECKED:
        return None
    stop = place + HEADER_SIZE + length
    raw = file.read(place, stop)
    builder = RecordBuilder()
    try:
        record = read(ReadDataStream(BytesIO(raw[HEADER_SIZE:])), length)
        record.write(builder)
    except _UNREADABLE:
        return None
    return Found(record, stop) if builder.end() == raw else None
