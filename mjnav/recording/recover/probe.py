"""What stands at one byte of an MCAP file: a record that its checksum vouches for, one that only reads well, or none.

A record is an opcode (u8), a length (u64) and a body. Chunks and attachments carry checksums of their own. Of all other
records only the form can be told: whether the record, written again, is the same bytes.

Source: https://mcap.dev/spec
"""

import os
import struct
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from types import MappingProxyType
from typing import IO

import mcap.records as records
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.exceptions import McapError
from mcap.opcode import Opcode

from mjnav.errors import DamagedLogError, InputError
from mjnav.recording.read.budget import READING, Budget
from mjnav.recording.read.chunks import LIMIT, BadRecord, chunk_records, parse_record

HEADER_SIZE = 1 + 8  # [bytes] opcode and length
_BLOCK = 2**20  # [bytes] read at a time
_CHUNK_FIELDS = struct.Struct("<QQQII")  # start, end, uncompressed size, checksum, length of the compression's name
_FRAME_MAGIC = MappingProxyType({b"lz4": b"\x04\x22\x4d\x18", b"zstd": b"\x28\xb5\x2f\xfd", b"": b""})


class Bytes:
    """A file of which any range is read without reading the rest; one bit of it, if any, is read as the other."""

    def __init__(self, file: IO[bytes], other_bit: int | None = None):
        self._descriptor = file.fileno()
        self._other_bit = other_bit  # bit 0 is the lowest of byte 0
        self.size = os.fstat(self._descriptor).st_size
        self.budget = Budget(self.size)
        self._name = file.name

    def read(self, start: int, end: int) -> bytes:
        """The bytes from `start` to before `end`, or to the file's end.

        Raises DamagedLogError where the search for what is intact has read more than a file of this size is worth.
        """
        place, end, pieces = start, min(end, self.size), []
        if not self.budget.allows_reading(end - start):
            raise DamagedLogError(
                f"{self._name}: damaged: stopped at byte {start} of {self.size}, "
                f"for the search for intact records has read {READING} times as much as there is"
            )
        while place < end and (piece := os.pread(self._descriptor, end - place, place)):
            pieces.append(piece)
            place += len(piece)
        data = pieces[0] if len(pieces) == 1 else b"".join(pieces)
        if self._other_bit is not None and 0 <= (at := self._other_bit // 8 - start) < len(data):
            data = b"".join((data[:at], bytes([data[at] ^ 1 << self._other_bit % 8]), data[at + 1 :]))
        return data

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


@contextmanager
def opened(path: str | os.PathLike[str], other_bit: int | None = None) -> Iterator[Bytes]:
    """The file's bytes. Raises InputError where it cannot be read."""
    if os.path.exists(path) and not os.path.isfile(path):
        raise InputError(f"{path}: not a file")
    try:
        file = open(path, "rb")  # noqa: SIM115 - closed below
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    with file:
        yield Bytes(file, other_bit)


@dataclass(frozen=True, slots=True)
class Found:
    """What kind of record stands there, where it ends, and whether a checksum of its own vouches for it."""

    opcode: Opcode
    end: int
    records: tuple[records.McapRecord, ...]  # itself, or those in a chunk
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
    """The chunk at a byte, whatever opcode and lengths its header has, if its contents agree with their checksum."""
    fields = file.read(place + HEADER_SIZE, place + HEADER_SIZE + _CHUNK_FIELDS.size)
    if len(fields) < _CHUNK_FIELDS.size:
        return None
    *others, checksum, name_length = _CHUNK_FIELDS.unpack(fields)
    for name, magic in _FRAME_MAGIC.items():
        start = place + HEADER_SIZE + _CHUNK_FIELDS.size + len(name) + 8
        if file.read(start, start + len(magic)) != magic or (not name and name_length):
            continue
        outer = place + HEADER_SIZE + file.header(place)[1] - start
        inner = int.from_bytes(file.read(start - 8, start), "little")
        for length in sorted({outer, inner}):  # the shorter first: what follows a whole frame is passed over
            if not 0 <= length <= min(LIMIT, end - start):
                continue
            header = _CHUNK_FIELDS.pack(*others, checksum, len(name)) + name + length.to_bytes(8, "little")
            try:
                contents = tuple(chunk_records(header + file.read(start, start + length), file.budget))
            except BadRecord:
                continue
            return Found(Opcode.CHUNK, start + length, contents, checked=checksum != 0)
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
    if checksum not in (0, file.checksum(start, data_end)):
        return None
    try:
        attachment = parse_record(Opcode.ATTACHMENT, file.read(start, stop))
    except BadRecord:
        return None
    return attachment and Found(Opcode.ATTACHMENT, stop, (attachment,), checked=checksum != 0)


_UNCHECKED: Mapping[int, type] = MappingProxyType(
    {
        Opcode.HEADER: records.Header,
        Opcode.FOOTER: records.Footer,
        Opcode.SCHEMA: records.Schema,
        Opcode.CHANNEL: records.Channel,
        Opcode.MESSAGE: records.Message,
        Opcode.MESSAGE_INDEX: records.MessageIndex,
        Opcode.CHUNK_INDEX: records.ChunkIndex,
        Opcode.ATTACHMENT_INDEX: records.AttachmentIndex,
        Opcode.STATISTICS: records.Statistics,
        Opcode.METADATA: records.Metadata,
        Opcode.METADATA_INDEX: records.MetadataIndex,
        Opcode.SUMMARY_OFFSET: records.SummaryOffset,
        Opcode.DATA_END: records.DataEnd,
    }
)


def _unchecked_at(file: Bytes, place: int, opcode: int, length: int) -> Found | None:
    """A record without a checksum, if it is the same bytes when it is written again."""
    if (kind := _UNCHECKED.get(opcode)) is None or length > LIMIT:
        return None
    stop = place + HEADER_SIZE + length
    raw = file.read(place, stop)
    stream = ReadDataStream(BytesIO(raw[HEADER_SIZE:]))
    builder = RecordBuilder()
    try:
        record = kind.read(stream, length) if kind is records.Message else kind.read(stream)
        record.write(builder)
    except (McapError, struct.error, ValueError):  # what the library's parsers make of other bytes
        return None
    return Found(Opcode(opcode), stop, (record,)) if builder.end() == raw else None
