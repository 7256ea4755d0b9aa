"""Random access to a damaged MCAP file: the intact record at a given byte, if any, and the file's summary section.

A record is an opcode (u8), a length (u64) and a body. Chunks and attachments have checksums of their own. Of all other
records only the form can be checked: whether the record, written again, is the same bytes.

The summary section at the end of the file is used where its checksum fits. It repeats every schema and channel and
counts the messages, which helps to read a damaged log. Where bytes were inserted or removed before it, it has moved:
then it is searched for behind the record that ends the data.

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

from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, Channel, Footer, McapRecord, Message, MetadataIndex, Schema, Statistics
from mcap.writer import MCAP0_MAGIC

from mjnav.errors import DamagedLogError
from mjnav.recording.read.records import (
    CHUNK_FIELDS,
    CONTENTS,
    FOOTER_SIZE,
    HEADER,
    INDICES,
    LIMIT,
    READING,
    BadRecord,
    Budget,
    chunk_records,
    open_file,
    parse_record,
)

# -------------------------------------------------------------------------------------------- records


_BLOCK = 2**20  # [bytes] read at a time
_FRAME_MAGIC = MappingProxyType({b"lz4": b"\x04\x22\x4d\x18", b"zstd": b"\x28\xb5\x2f\xfd", b"": b""})
_UNCHECKED: Mapping[int, type] = MappingProxyType({**CONTENTS, **INDICES, Opcode.MESSAGE: Message})


class FileBytes:
    """A file of which any range is read without reading the rest; one bit of it, if any, is read inverted."""

    def __init__(self, file: IO[bytes], inverted_bit: int | None = None):
        self._descriptor = file.fileno()
        self._inverted_bit = inverted_bit  # bit 0 is the lowest of byte 0
        self.size = os.fstat(self._descriptor).st_size
        self.budget = Budget(self.size)
        self._name = file.name

    def read(self, start: int, end: int) -> bytes:
        """The bytes from `start` to before `end`, or to the file's end.

        Raises DamagedLogError where the search for intact records has read more than the budget allows.
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
        if self._inverted_bit is not None and 0 <= (at := self._inverted_bit // 8 - start) < len(data):
            data = b"".join((data[:at], bytes([data[at] ^ 1 << self._inverted_bit % 8]), data[at + 1 :]))
        return data

    def integer(self, start: int, size: int) -> int:
        """The unsigned integer in `size` bytes."""
        return int.from_bytes(self.read(start, start + size), "little")

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
        raw = self.read(place, place + HEADER.size)
        return HEADER.unpack(raw) if len(raw) == HEADER.size else (0, 0)


@contextmanager
def file_bytes(path: str | os.PathLike[str], inverted_bit: int | None = None) -> Iterator[FileBytes]:
    """The file's bytes. Raises InputError where it cannot be read."""
    with open_file(path) as file:
        yield FileBytes(file, inverted_bit)


@dataclass(frozen=True, slots=True)
class FoundRecord:
    """What kind of record stands at a byte, where it ends, and whether a checksum of its own fits."""

    opcode: Opcode
    end: int
    records: tuple[McapRecord, ...]  # itself, or those in a chunk
    checked: bool = False


def record_at(file: FileBytes, place: int, end: int) -> FoundRecord | None:
    """The record at a byte, if it is intact as far as can be checked and ends at `end` or before."""
    opcode, length = file.header(place)
    stop = place + HEADER.size + length
    if stop > end:
        return None
    if opcode == Opcode.CHUNK:
        found = chunk_at(file, place, end)
    elif opcode == Opcode.ATTACHMENT:
        found = attachment_at(file, place, end)
    else:
        found = _unchecked_at(file, place, opcode, length)
    return found if found is not None and found.end == stop else None


def chunk_at(file: FileBytes, place: int, end: int) -> FoundRecord | None:
    """The chunk at a byte, whatever opcode and lengths its header has, if its contents fit their checksum."""
    fields = file.read(place + HEADER.size, place + HEADER.size + CHUNK_FIELDS.size)
    if len(fields) < CHUNK_FIELDS.size:
        return None
    *others, checksum, name_length = CHUNK_FIELDS.unpack(fields)
    for name, magic in _FRAME_MAGIC.items():
        start = place + HEADER.size + CHUNK_FIELDS.size + len(name) + 8
        if file.read(start, start + len(magic)) != magic or (not name and name_length):
            continue
        outer = place + HEADER.size + file.header(place)[1] - start
        inner = file.integer(start - 8, 8)
        for length in sorted({outer, inner}):  # the shorter first: what follows a whole frame is ignored
            if not 0 <= length <= min(LIMIT, end - start):
                continue
            header = CHUNK_FIELDS.pack(*others, checksum, len(name)) + name + length.to_bytes(8, "little")
            try:
                contents = tuple(chunk_records(header + file.read(start, start + length), file.budget))
            except BadRecord:
                continue
            return FoundRecord(Opcode.CHUNK, start + length, contents, checked=checksum != 0)
    return None


def attachment_at(file: FileBytes, place: int, end: int) -> FoundRecord | None:
    """The attachment at a byte, whatever opcode and length its header has, if its bytes fit their checksum.

    The checksum is computed in blocks before the attachment is read into memory.
    """
    start = place + HEADER.size
    size_at = start + 16  # behind the times
    for _ in ("name", "media type"):
        size_at += 4 + file.integer(size_at, 4)
    data_end = size_at + 8 + file.integer(size_at, 8)
    stop = data_end + 4
    if stop > end:
        return None
    checksum = file.integer(data_end, 4)
    if checksum not in (0, file.checksum(start, data_end)):
        return None
    try:
        attachment = parse_record(Opcode.ATTACHMENT, file.read(start, stop))
    except BadRecord:
        return None
    return attachment and FoundRecord(Opcode.ATTACHMENT, stop, (attachment,), checked=checksum != 0)


def _unchecked_at(file: FileBytes, place: int, opcode: int, length: int) -> FoundRecord | None:
    """A record without a checksum, if it is the same bytes when it is written again."""
    if (kind := _UNCHECKED.get(opcode)) is None or length > LIMIT:
        return None
    stop = place + HEADER.size + length
    raw = file.read(place, stop)
    stream = ReadDataStream(BytesIO(raw[HEADER.size :]))
    builder = RecordBuilder()
    try:
        record = kind.read(stream, length) if kind is Message else kind.read(stream)
        record.write(builder)
    except (McapError, struct.error, ValueError):  # what the library's parsers raise at other bytes
        return None
    return FoundRecord(Opcode(opcode), stop, (record,)) if builder.end() == raw else None


# ------------------------------------------------------------------------------------ summary section


DATA_END_SIZE = HEADER.size + 4
_FOOTER_HEADER = HEADER.pack(Opcode.FOOTER, FOOTER_SIZE - HEADER.size)
_DATA_END_HEADER = HEADER.pack(Opcode.DATA_END, DATA_END_SIZE - HEADER.size)
_FOOTER_SEARCH = 2**20  # [bytes] from the end
_START_SEARCH = 2**26  # [bytes] before the footer
_MAX_STARTS = 64  # that are tried
_WANTED = (Schema, Channel, Statistics, AttachmentIndex, MetadataIndex)


@dataclass(frozen=True, slots=True)
class SummarySection:
    """Where the summary stands, and what it says of the data; nothing where it has no checksum."""

    start: int
    end: int  # of the footer
    footer: Footer
    records: tuple[McapRecord, ...]  # Schema, Channel, Statistics, AttachmentIndex and MetadataIndex


def find_summary(file: FileBytes) -> SummarySection | None:
    """The summary, or None where none is left whose checksum fits."""
    tail_start = max(0, file.size - _FOOTER_SEARCH)
    tail = file.read(tail_start, file.size)
    at = len(tail)
    while (at := tail.rfind(_FOOTER_HEADER, 0, at)) >= 0:
        found = record_at(file, tail_start + at, file.size)
        if found is not None and isinstance(footer := found.records[0], Footer):
            for start in _starts(file, tail_start + at, footer):
                if _intact(file, start, tail_start + at, footer):
                    return _read(file, start, found.end, footer)
    return None


def _starts(file: FileBytes, footer_at: int, footer: Footer) -> Iterator[int]:
    """Where the summary may start: where the footer says, and behind each record that may end the data."""
    yield footer.summary_start or footer_at
    first = max(0, footer_at - _START_SEARCH)
    blocks = [place for place, _ in file.blocks(first, footer_at)]
    tried = 0
    for place, stop in zip(reversed(blocks), reversed([*blocks[1:], footer_at]), strict=True):
        block = file.read(place, min(stop + HEADER.size - 1, footer_at))
        at = len(block)
        while tried < _MAX_STARTS and (at := block.rfind(_DATA_END_HEADER, 0, at)) >= 0:
            tried += 1
            yield place + at + DATA_END_SIZE


def _intact(file: FileBytes, start: int, footer_at: int, footer: Footer) -> bool:
    if not DATA_END_SIZE <= start <= footer_at or _belongs_inside(file, start - footer.summary_start):
        return False
    if footer.summary_crc == 0:  # written without: where it stands can still be told
        found = record_at(file, start - DATA_END_SIZE, start)
        return found is not None and found.opcode == Opcode.DATA_END
    return file.checksum(start, footer_at + FOOTER_SIZE - 4) == footer.summary_crc


def _belongs_inside(file: FileBytes, shift: int) -> bool:
    """Whether the summary that stands `shift` bytes behind where its footer says is of a log attached to this one."""
    if shift <= 0 or file.read(shift, shift + len(MCAP0_MAGIC)) != MCAP0_MAGIC:
        return False
    return record_at(file, len(MCAP0_MAGIC), file.size) is not None


def _read(file: FileBytes, start: int, end: int, footer: Footer) -> SummarySection:
    described: list[McapRecord] = []
    place = start
    while footer.summary_crc != 0 and (found := record_at(file, place, end)) is not None:
        described += [record for record in found.records if isinstance(record, _WANTED)]
        place = found.end
    return SummarySection(start, end, footer, tuple(described))
